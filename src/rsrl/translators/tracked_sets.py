"""Sets of tyres of tracked cars: what is on them, how worn it is, what is left; and what is assumed where a source does not say."""

from collections import Counter
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.season import COMPOUNDS, GREEN, VSC, RaceRecord
from rsrl.simulator import Figures
from rsrl.simulator import layout as at
from rsrl.translators.race_tracker import RaceTracker
from rsrl.translators.tracked_car import Stint, TrackedCar

WET_TYRES: Final = ("I", "W")

HARDEST: Final = COMPOUNDS[-1]


class FittedSet(NamedTuple):
    """The set on a car: compound S, M or H, the laps it had run when it was fitted, and which of the two were assumed."""

    compound: str
    laps_before: int
    fitted_lap: int
    compound_assumed: bool
    age_assumed: bool


def fitted_set(tracker: RaceTracker, record: RaceRecord, car: TrackedCar, stint: Stint | None, lap: int) -> FittedSet:
    """The set of a stint; one that the source does not tell (None) is taken to be fitted at the end of `lap`.

    A compound that is not known is taken to be the one that the field has fitted most often at its stops, among those that the car has not
    run on if it has run on one only; the hardest before anybody has stopped. Laps before the race that are not known are those of the
    freshest set that the car had left, as stops fit them in the simulator.
    """
    fitted_lap = lap if stint is None else stint.fitted_lap
    told = stint.compound if stint is not None and stint.compound in COMPOUNDS else None
    compound = told or _likely_compound(tracker, car)
    if stint is not None and stint.laps_before is not None:
        return FittedSet(compound, stint.laps_before, fitted_lap, told is None, False)
    if stint is not None and stint.new:
        return FittedSet(compound, 0, fitted_lap, told is None, False)
    before = sum(s.compound == compound and s.fitted_lap < fitted_lap for s in car.stints)
    own = _sets_of(record, car)[COMPOUNDS.index(compound)]
    return FittedSet(compound, own[before] if before < len(own) else 0, fitted_lap, told is None, True)


def sets_left(record: RaceRecord, car: TrackedCar) -> tuple[int, int, int]:
    """Sets of soft, medium and hard that a car has left: as the source says, or those of the season file less the sets it has run on."""
    if car.sets_told is not None:
        return car.sets_told
    used = Counter(s.compound for s in car.stints)
    soft, medium, hard = (max(len(sets) - used[c], 0) for c, sets in zip(COMPOUNDS, _sets_of(record, car), strict=True))
    return soft, medium, hard


def lap_wear(figures: Figures, status: int) -> float:
    """What a lap under a track status adds to the wear of a set, in racing laps."""
    if status == GREEN:
        return 1.0
    return float(figures.track[at.T_WEAR_VSC if status == VSC else at.T_WEAR_SC])


def worn_by_lap(wear: NDArray[np.float32], sets: list[FittedSet], lap: int) -> NDArray[np.float32]:
    """Wear at the end of each lap of the set on which it was driven, float32 [lap + 1], in racing laps; entry 0 is before the start.

    Args:
        wear: float32 [lap + 1], what each lap adds.
        sets: fitted so far, in order.
    """
    worn = np.zeros(lap + 1, np.float32)
    fitted = {s.fitted_lap: s for s in sets}
    now = np.float32(sets[0].laps_before) if sets else np.float32(0)
    for n in range(1, lap + 1):
        if n - 1 in fitted:
            now = np.float32(fitted[n - 1].laps_before)
        now += wear[n]
        worn[n] = now
    return worn


def _likely_compound(tracker: RaceTracker, car: TrackedCar) -> str:
    run_on = {s.compound for s in car.stints if s.compound in COMPOUNDS}
    fitted = Counter(s.compound for other in tracker.cars.values() for s in other.stints if s.fitted_lap > 0 and s.compound in COMPOUNDS)
    open_to = [c for c, _ in fitted.most_common() if c is not None and not (len(run_on) == 1 and c in run_on)]
    return open_to[0] if open_to else HARDEST


def _sets_of(record: RaceRecord, car: TrackedCar) -> tuple[tuple[int, ...], ...]:
    codes = [entry.driver for entry in record.cars]
    return record.sets_of(codes.index(car.driver) if car.driver in codes else None)
