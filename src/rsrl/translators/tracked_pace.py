"""Form and set luck of the cars of a tracked race: the simulator's own posterior (`simulator.pace_posterior`) on measured laps.

A lap shows a car's own pace under the same conditions as in the simulator: a racing lap from line to line, no stop at either end, no
change of place, not ended right behind another car. The posterior of a car is computed from its first lap on whenever it is asked for
after a change, so that a set corrected later corrects everything that followed from it.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.season import COMPOUNDS, GREEN, RED, SC, RaceRecord
from rsrl.simulator import Figures
from rsrl.simulator import layout as at
from rsrl.simulator.measured_laps import (
    L_COLUMNS,
    L_COMPOUND,
    L_GAP,
    L_LAP,
    L_NEW_SET,
    L_NO_AID,
    L_SHOWS,
    L_TIME,
    L_WEAR,
    learn_laps,
)
from rsrl.simulator.pace_posterior import HELD_S
from rsrl.simulator.traffic import FAR
from rsrl.translators.race_tracker import RaceTracker
from rsrl.translators.tracked_car import TrackedCar
from rsrl.translators.tracked_gaps import PitCosts, standings


class LapSeen(NamedTuple):
    """A lap of a car as it ended: gap to the car ahead at its beginning, s; whether it shows the car's own pace; whether DRS was off."""

    gap_s: float
    shows: bool
    no_aid: bool


class PaceTracker:
    """Posterior means of every car's form and set luck, lap by lap.

    Call `lap_done` at every completed lap, at once: who was ahead and where is known then.
    """

    def __init__(self, record: RaceRecord, figures: Figures, costs: PitCosts) -> None:
        self._record, self._figures, self._costs = record, figures, costs
        self._index = {car.driver: i for i, car in enumerate(record.cars)}
        self._seen: dict[int, dict[int, LapSeen]] = {}
        self._held_s = float(figures.track[at.T_FOLLOW] + HELD_S)
        self._f, self._k = np.zeros((at.F_ROWS, at.CARS), np.float32), np.zeros((at.K_ROWS, at.CARS), np.int32)
        self._r = np.zeros(at.R_SIZE, np.int32)

    def lap_done(self, tracker: RaceTracker, car: TrackedCar) -> None:
        """Note how a car's lap just completed went, as far as the cars around it are concerned."""
        lap = car.laps
        if car.driver not in self._index or lap not in car.crossings:
            return
        ends = _place(tracker, car, lap, self._costs)
        begins = _place(tracker, car, lap - 1, self._costs) if lap > 1 else None
        if ends is None or begins is None:
            return
        (place, ahead_s), (place_before, gap_s) = ends, begins
        alone = place == place_before and (place == 0 or ahead_s > self._held_s)
        shows = alone and self._raced(tracker, car, lap)
        self._seen.setdefault(car.number, {})[lap] = LapSeen(gap_s, shows, aid_is_off(tracker, self._record.drs_off_laps, car, lap))

    def laps_seen(self, car: TrackedCar) -> int:
        """Laps of a car that have been noted."""
        return len(self._seen.get(car.number, {}))

    def posterior(self, car: TrackedCar, lap: int, worn_laps: NDArray[np.float32]) -> tuple[float, float]:
        """Form and set luck of a car after `lap` laps and the stop that may have ended them, s.

        Args:
            worn_laps: float32 [lap + 1], wear of the set on which each lap was driven, at its end, in racing laps.
        """
        rows = self._rows(car, lap, worn_laps)
        column = self._index[car.driver]
        self._f[:, column], self._k[:, column] = 0.0, 0
        learn_laps(self._figures, rows, column, self._f, self._k, self._r)
        return float(self._f[at.F_FORM, column]), float(self._f[at.F_LUCK, column])

    def _rows(self, car: TrackedCar, lap: int, worn_laps: NDArray[np.float32]) -> NDArray[np.float32]:
        seen = self._seen.get(car.number, {})
        rows = np.zeros((lap, L_COLUMNS), np.float32)
        rows[:, L_LAP], rows[:, L_WEAR] = np.arange(1, lap + 1), worn_laps[1:]
        for stint in car.stints:
            if 0 < stint.fitted_lap <= lap:
                rows[stint.fitted_lap - 1, L_NEW_SET] = 1
        for n, known in seen.items():
            stint_on = car.stint_at(n - 1) if known.shows and n <= lap and n in car.lap_times else None
            if stint_on is not None and stint_on.compound in COMPOUNDS:
                row = rows[n - 1]
                row[L_TIME], row[L_GAP], row[L_COMPOUND] = car.lap_times[n], known.gap_s, COMPOUNDS.index(stint_on.compound)
                row[L_NO_AID], row[L_SHOWS] = known.no_aid, 1
        return rows

    def _raced(self, tracker: RaceTracker, car: TrackedCar, lap: int) -> bool:
        """Whether a car drove a lap under green from line to line, without a stop at either end or a restart."""
        if lap < 2 or car.visit(lap) is not None or car.visit(lap - 1) is not None or lap - 1 not in car.crossings:
            return False
        if tracker.lap_status(lap - 1) == RED:
            return False
        return all(status == GREEN for status, _ in tracker.statuses_between(car.crossings[lap - 1], car.crossings[lap]))


def aid_is_off(tracker: RaceTracker, rule: int, car: TrackedCar, lap: int) -> bool:
    """Whether a car had no following aid on a lap: as race control said, or `rule` laps after the start, a safety car or a red flag."""
    begun_s = car.crossings.get(lap - 1)
    if tracker.aid_spans and begun_s is not None:
        return not next((enabled for from_s, enabled in reversed(tracker.aid_spans) if from_s <= begun_s), False)
    return lap <= rule or any(tracker.lap_status(n) >= SC for n in range(max(lap - rule, 1), lap))


def _place(tracker: RaceTracker, car: TrackedCar, lap: int, costs: PitCosts) -> tuple[int, float] | None:
    """Place of a car after a lap, from 0, and its gap to the car ahead, s; None where its time is not known."""
    order = standings(tracker, lap, costs, under_way=False)
    if car.number not in order:
        return None
    numbers = list(order)
    place = numbers.index(car.number)
    return place, float(FAR) if place == 0 else order[car.number].time_s - order[numbers[place - 1]].time_s
