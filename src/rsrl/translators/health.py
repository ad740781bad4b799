"""How far a state from a feed can be trusted: the age of what it rests on, what is missing, and where each field is from."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from rsrl.season import RaceRecord, grand_prix_of
from rsrl.translators.race_tracker import RaceTracker
from rsrl.translators.tracked_car import TrackedCar
from rsrl.translators.tracked_gaps import Standing
from rsrl.translators.tracked_sets import FittedSet

MEASURED: Final = "measured"
DERIVED: Final = "derived"
ASSUMED: Final = "assumed"

GONE_LAPS: Final = 10
"""A car of which nothing is heard for so many laps does not come back."""


@dataclass(frozen=True)
class Health:
    """Of one state.

    Attributes:
        age_s: how long ago the source last said anything of a car on the track, s.
        gaps: running cars by where their gap is from (`tracked_gaps`): measured, derived, projected, stated.
        fields: where the fields of the called car are from, "measured", "derived" or "assumed", by name.
        missing: in words, what the source does not say though the state needs it, and what stands in for it.
        unheard: cars taken to be out because nothing is heard of them, while they may still come back: `GONE_LAPS` laps.
    """

    age_s: float
    gaps: dict[str, int] = field(default_factory=dict)
    fields: dict[str, str] = field(default_factory=dict)
    missing: tuple[str, ...] = ()
    unheard: tuple[str, ...] = ()


def health_of(
    tracker: RaceTracker, record: RaceRecord, own: TrackedCar, order: Mapping[int, Standing], sets: Mapping[int, FittedSet]
) -> Health:
    """The health of a state of car `own`, from the standings and sets by car number that it was made of."""
    return Health(
        age_s=round(tracker.age_s, 3),
        gaps=dict(Counter(standing.source for standing in order.values())),
        fields=_fields(own, order, sets),
        missing=tuple(_missing(tracker, record, own, order, sets)),
        unheard=tuple(car.driver for car in tracker.cars.values() if _lately_silent(tracker, car)),
    )


def _lately_silent(tracker: RaceTracker, car: TrackedCar) -> bool:
    if car.out or car.disqualified or not tracker.is_out(car):
        return False
    return sum(led_s > car.seen_s for led_s, _ in tracker.led.values()) <= GONE_LAPS


def _fields(own: TrackedCar, order: Mapping[int, Standing], sets: Mapping[int, FittedSet]) -> dict[str, str]:
    if own.number not in order or own.number not in sets:
        return {}
    fitted = sets[own.number]
    gap = order[own.number].source
    return {
        "gap_to_leader_s": MEASURED if gap in ("measured", "stated") else DERIVED,
        "last_lap_s": MEASURED if own.laps in own.lap_times else DERIVED,
        "compound": ASSUMED if fitted.compound_assumed else MEASURED,
        "tyre_age_laps": ASSUMED if fitted.age_assumed else MEASURED,
        "worn_laps": DERIVED,
        "form_s": DERIVED,
        "set_luck_s": DERIVED,
        "sets_left": MEASURED if own.sets_told is not None else DERIVED,
    }


def _missing(
    tracker: RaceTracker, record: RaceRecord, own: TrackedCar, order: Mapping[int, Standing], sets: Mapping[int, FittedSet]
) -> list[str]:
    notes = []
    guessed = sorted(tracker.cars[n].driver for n, fitted in sets.items() if fitted.compound_assumed)
    if guessed:
        notes.append(f"compound of {', '.join(guessed)}: the one fitted most often is assumed")
    if own.number in sets and sets[own.number].age_assumed:
        notes.append("laps on the set before it was fitted: those of the freshest set left are assumed")
    placed = sorted(tracker.cars[n].driver for n, standing in order.items() if standing.source == "stated")
    if placed:
        notes.append(f"crossings of {', '.join(placed)}: gap or place as stated")
    codes = {car.driver for car in record.cars}
    strangers = sorted(car.driver for car in tracker.running() if car.driver not in codes)
    if strangers:
        notes.append(f"not in the season file: {', '.join(strangers)}, left out of the state")
    if tracker.total_laps is None and not _is_of(record, tracker):
        notes.append(f"the distance: the season file's {record.laps} laps are assumed")
    elif tracker.total_laps not in (None, record.laps):
        notes.append(f"the race is over {tracker.total_laps} laps; the season file's {record.laps} are used")
    return notes


def _is_of(record: RaceRecord, tracker: RaceTracker) -> bool:
    """Whether the source says that it is of the season file's race, whose distance is known."""
    session = tracker.session
    return session is not None and bool(session.event) and f"{grand_prix_of(session.event)}-{session.season}" == record.name
