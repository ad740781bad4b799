"""A race state as a JSON file: written and read back. An impossible state is refused in one line that names the field.

The file is `UnifiedRaceState` field by field. Fields with a default there may be left out. Compounds are S, M and H; `track_status` is a
code or its name: 0 none, 1 virtual, 2 full, 3 red. `previous_gap_ahead_s` of a car that led, and `gap_to_leader_s` of one that has retired,
are null.
"""

import json
import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, asdict, fields
from pathlib import Path
from typing import Any, Final, NoReturn

from rsrl.errors import RsrlError
from rsrl.explanation.moment import Moment
from rsrl.season import COMPOUND_NAMES, COMPOUNDS, MAX_CARS, MAX_LAPS_BEFORE, TRACK_STATUS_NAMES, RaceRecord, find_car
from rsrl.state import CarState, UnifiedRaceState
from rsrl.text_files import decode_text, read_text
from rsrl.translators import simulated_state

Json = Mapping[str, Any]

STANDARD_INPUT: Final = Path("-")

WHOLE: Final = ("laps_completed", "total_laps", "status_laps", "position", "tyre_age_laps", "stops")
REAL: Final = ("gap_to_leader_s", "last_lap_s", "form_s", "worn_laps", "set_luck_s", "previous_gap_ahead_s")
MAY_BE_NULL: Final = ("worn_laps", "previous_gap_ahead_s", "gap_to_leader_s")
SIGNED: Final = ("form_s", "set_luck_s", "gap_to_leader_s")
"""Numbers that may be negative; the gap only for a car that retired."""

QUICKEST_SHARE: Final = 0.8
"""A lap below this share of the average car's lap on a fresh medium and an empty tank is refused."""

WORDS: Final = ("race", "driver", "compound")
FLAGS: Final = ("running", "just_stopped")


def state_document(state: UnifiedRaceState) -> dict[str, Any]:
    """A state in types that JSON has; `read_state` reads it back."""
    return asdict(state) | {
        "cars": [asdict(car) for car in state.cars],
        "compounds_used": sorted(state.compounds_used, key=COMPOUNDS.index),
        "sets_left": list(state.sets_left),
    }


def state_of(moment: Moment) -> UnifiedRaceState:
    """What the pit wall sees at a moment."""
    f, k, r = moment.arrays
    return simulated_state(moment.record, _OneRace(f[None], k[None], r[None]), 0, moment.car)


class _OneRace:
    """The arrays of one race, as a batch holds them."""

    def __init__(self, f: Any, k: Any, r: Any) -> None:
        self.f, self.k, self.r = f, k, r


def read_state(path: Path) -> UnifiedRaceState:
    """A state from a JSON file, or from standard input where the path is `-`.

    Raises:
        RsrlError: no such file, no JSON, or a field that is missing, unknown or impossible; the message names it.
    """
    where = state_source(path)
    try:
        document = json.loads(read_text(path) if path != STANDARD_INPUT else decode_text(sys.stdin.buffer.read()))
    except OSError as error:
        raise RsrlError(f"{where}: cannot be read ({error.strerror})") from None
    except ValueError as error:
        raise RsrlError(f"{where}: not JSON ({error})") from None
    return parse_state(document, where)


def state_source(path: Path) -> str:
    """What messages call the place of a state."""
    return "standard input" if path == STANDARD_INPUT else str(path)


def parse_state(document: Any, where: str) -> UnifiedRaceState:
    """A state from parsed JSON; `where` names it in complaints. Raises RsrlError as `read_state`."""
    values = _values(UnifiedRaceState, document, where)
    if not isinstance(values["cars"], list) or not values["cars"]:
        _refuse(where, "cars", values["cars"], "a list of cars")
    cars = tuple(CarState(**_values(CarState, car, f"{where}: cars[{i}]")) for i, car in enumerate(values["cars"]))
    values |= {"cars": cars, "compounds_used": _compounds(values["compounds_used"], where)}
    values |= {"track_status": _status(values["track_status"], where), "sets_left": _sets(values["sets_left"], where)}
    if values["laps_completed"] >= values["total_laps"]:
        raise RsrlError(f"{where}: laps_completed is {values['laps_completed']} of {values['total_laps']}: the race is over")
    for i, car in enumerate(cars):
        if car.compound not in COMPOUNDS:
            _refuse(f"{where}: cars[{i}] ({car.driver})", "compound", car.compound, f"one of {', '.join(COMPOUNDS)}")
    own = next((car for car in cars if car.driver == values["driver"]), None)
    if own is None:
        raise RsrlError(f"{where}: driver is {values['driver']}, who is not among the cars")
    if not own.running:
        raise RsrlError(f"{where}: the race of {own.driver} is over (running is false), there is nothing left to call")
    state = UnifiedRaceState(**values)
    check_state(state, where)
    return state


def check_state(state: UnifiedRaceState, where: str) -> None:
    """Raise RsrlError for a state whose fields contradict one another; `where` begins the message."""
    lap = state.laps_completed
    if not 0 <= state.status_laps <= lap:
        _refuse(where, "status_laps", state.status_laps, f"at most laps_completed, {lap}")
    if len(state.cars) > MAX_CARS:
        raise RsrlError(f"{where}: cars is a list of {len(state.cars)}; it must be one of at most {MAX_CARS}")
    drivers = [car.driver for car in state.cars]
    for i, car in enumerate(state.cars):
        if car.driver in drivers[:i]:
            raise RsrlError(f"{where}: cars[{i}].driver is {car.driver}, who is there twice")
        _check_car(state, car, f"{where}: cars[{i}] ({car.driver})")
    _check_order(state, where)
    own = state.cars[drivers.index(state.driver)]
    if own.compound not in state.compounds_used:
        _refuse(where, "compounds_used", sorted(state.compounds_used), f"a list that holds the compound fitted, {own.compound}")
    if state.previous_gap_ahead_s is not None and math.isnan(state.previous_gap_ahead_s):
        _refuse(where, "previous_gap_ahead_s", state.previous_gap_ahead_s, "a number")


def _check_car(state: UnifiedRaceState, car: CarState, where: str) -> None:
    lap = state.laps_completed
    if car.running and car.gap_to_leader_s is None:
        _refuse(where, "gap_to_leader_s", None, "a number, since the car is running")
    for name in ("form_s", "set_luck_s", *(("gap_to_leader_s", "last_lap_s") if car.running else ())):
        if not math.isfinite(getattr(car, name)):
            _refuse(where, name, getattr(car, name), "a number")
    oldest = MAX_LAPS_BEFORE + (lap if car.running else state.total_laps)
    if not 0 <= car.tyre_age_laps <= oldest:
        _refuse(where, "tyre_age_laps", car.tyre_age_laps, f"at most laps_completed, {lap}, and {MAX_LAPS_BEFORE} before the race")
    if not 0 <= car.stops <= lap:
        _refuse(where, "stops", car.stops, f"at most laps_completed, {lap}")
    if car.running and _gap_s(car) < 0:
        _refuse(where, "gap_to_leader_s", car.gap_to_leader_s, "a number from 0 up")
    if car.running and lap and not car.last_lap_s > 0:
        _refuse(where, "last_lap_s", car.last_lap_s, "above 0 after the first lap")
    if car.worn_laps is not None and not 0 <= car.worn_laps <= car.tyre_age_laps + 1:
        _refuse(where, "worn_laps", car.worn_laps, f"from 0 to tyre_age_laps, {car.tyre_age_laps}")
    if car.just_stopped and (car.tyre_age_laps > MAX_LAPS_BEFORE or car.stops < 1):
        raise RsrlError(
            f"{where}: just_stopped is true, so tyre_age_laps must be 0, or up to {MAX_LAPS_BEFORE} for a used set, and stops at least 1"
        )


def _gap_s(car: CarState) -> float:
    """Gap of a running car to the leader."""
    assert car.gap_to_leader_s is not None
    return car.gap_to_leader_s


def _check_order(state: UnifiedRaceState, where: str) -> None:
    """Raise unless the running cars stand 1 to n, their gaps grow from 0, and every position is one of a field."""
    for car in state.cars:
        if not 1 <= car.position <= MAX_CARS:
            raise RsrlError(f"{where}: position of {car.driver} is {car.position}; it must be 1 to {MAX_CARS}")
    running = sorted((car for car in state.cars if car.running), key=lambda car: car.position)
    ahead = None
    for place, car in enumerate(running, 1):
        if car.position != place:
            raise RsrlError(f"{where}: position of {car.driver} is {car.position}, but {place - 1} running cars are ahead")
        if ahead is None and _gap_s(car) != 0.0:
            raise RsrlError(f"{where}: gap_to_leader_s of {car.driver}, who leads, is {_gap_s(car):g}; it must be 0")
        if ahead is not None and _gap_s(car) < _gap_s(ahead):
            raise RsrlError(f"{where}: gap_to_leader_s of {car.driver} is less than that of {ahead.driver}, who is ahead")
        ahead = car


def check_race(state: UnifiedRaceState, record: RaceRecord, where: str) -> int:
    """The car that a state is about, in the race of a record.

    Raises:
        RsrlError: the state is of another race, of a driver who did not start in it, or of another number of laps; it has more sets than a
            car may have; or a time in it is one that no car drives there.
    """
    if state.race != record.name:
        raise RsrlError(f"{where}: race is {state.race}, not {record.name}")
    if state.total_laps != record.laps:
        raise RsrlError(f"{where}: total_laps is {state.total_laps}; {record.name} has {record.laps}")
    started = {car.driver for car in record.cars}
    for i, car in enumerate(state.cars):
        if car.driver not in started:
            raise RsrlError(f"{where}: cars[{i}].driver is {car.driver}, who did not start at {record.name}")
        if car.running and state.laps_completed:
            _check_times(car, state.laps_completed, record, f"{where}: cars[{i}] ({car.driver})")
    own = find_car(record, state.driver)
    for name, left, sets in zip(COMPOUND_NAMES, state.sets_left, record.sets_of(own), strict=True):
        if not 0 <= left <= len(sets):
            raise RsrlError(f"{where}: sets_left has {left} sets of {name}; {state.driver} has 0 to {len(sets)} at {record.name}")
    return own


def _check_times(car: CarState, laps: int, record: RaceRecord, where: str) -> None:
    """Raise for a lap quicker than any car's, and for a gap of more than a whole lap on every lap, and one at the start or for repairs."""
    usual_s = record.track.base_lap_s.value
    least_s = QUICKEST_SHARE * usual_s
    if car.last_lap_s < least_s:
        _refuse(where, "last_lap_s", car.last_lap_s, f"at least {least_s:.0f} s; a lap of {record.name} takes about {usual_s:.0f} s")
    most_s = (laps + 1) * usual_s
    if _gap_s(car) > most_s:
        _refuse(where, "gap_to_leader_s", car.gap_to_leader_s, f"at most {most_s:.0f} s after {laps} laps")


def check_history(state: UnifiedRaceState, history: Sequence[UnifiedRaceState], where: str) -> None:
    """Raise RsrlError unless the states before are of the same race and car, one a lap up to this one."""
    states = [*history, state]
    for before, after in zip(states, states[1:], strict=False):
        if (before.race, before.driver) != (after.race, after.driver):
            raise RsrlError(f"{where}: history is of {before.driver} at {before.race}, not of {after.driver} at {after.race}")
        if after.laps_completed != before.laps_completed + 1:
            raise RsrlError(f"{where}: history goes from lap {before.laps_completed} to lap {after.laps_completed}; it must hold every lap")


def _values(kind: type, document: Any, where: str) -> dict[str, Any]:
    """The fields of a dataclass from an object of JSON, each of its type."""
    if not isinstance(document, Mapping):
        raise RsrlError(f"{where}: not an object with the fields of a {'car' if kind is CarState else 'race state'}")
    known = {f.name: f for f in fields(kind)}
    for name in document:
        if name not in known:
            raise RsrlError(f"{where}: unknown field {name}; there are {', '.join(known)}")
    for name, f in known.items():
        if name not in document and f.default is MISSING and f.default_factory is MISSING:
            raise RsrlError(f"{where}: field {name} is missing")
    return {name: _of_type(name, value, where) for name, value in document.items()}


def _of_type(name: str, value: Any, where: str) -> Any:
    number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    if name in WHOLE and not (number and value == int(value) and value >= 0):
        _refuse(where, name, value, "a whole number from 0 up")
    if name in REAL and not (name in MAY_BE_NULL and value is None):
        if not number:
            _refuse(where, name, value, "a number")
        if value < 0 and name not in SIGNED:
            _refuse(where, name, value, "a number from 0 up")
    if name in WORDS and not (isinstance(value, str) and value):
        _refuse(where, name, value, "a word")
    if name in FLAGS and not isinstance(value, bool):
        _refuse(where, name, value, "true or false")
    return int(value) if name in WHOLE else value


def _compounds(value: Any, where: str) -> frozenset[str]:
    if not isinstance(value, list) or not value or any(c not in COMPOUNDS for c in value):
        _refuse(where, "compounds_used", value, f"a list of {', '.join(COMPOUNDS)}, the fitted one among them")
    return frozenset(value)


def _status(value: Any, where: str) -> int:
    if isinstance(value, str) and value in TRACK_STATUS_NAMES:
        return TRACK_STATUS_NAMES.index(value)
    if isinstance(value, bool) or value not in range(len(TRACK_STATUS_NAMES)):
        _refuse(where, "track_status", value, "one of " + ", ".join(f"{i} {name}" for i, name in enumerate(TRACK_STATUS_NAMES)))
    return int(value)


def _sets(value: Any, where: str) -> tuple[int, int, int]:
    if not isinstance(value, list) or len(value) != len(COMPOUNDS) or any(type(n) is not int or n < 0 for n in value):
        _refuse(where, "sets_left", value, "three whole numbers from 0 up: softs, mediums, hards")
    return value[0], value[1], value[2]


def _refuse(where: str, name: str, value: Any, wanted: str) -> NoReturn:
    raise RsrlError(f"{where}: {name} is {json.dumps(value, default=str)}; it must be {wanted}")
