"""What can be wrong with a race's state that comes from outside: each said in one line that names the field."""

import math
from collections.abc import Sequence

from rsrl.errors import RsrlError
from rsrl.season import FIELD_SIZE, RaceRecord
from rsrl.state import CarState, UnifiedRaceState


def check_state(record: RaceRecord, car: int, state: UnifiedRaceState) -> None:
    """Raise RsrlError where a state is not one of the record's race and car, or could not come about."""
    driver = record.cars[car].driver
    if state.race != record.name:
        raise RsrlError(f"state: race is {state.race}, not {record.name}")
    if state.total_laps != record.laps:
        raise RsrlError(f"state: total_laps is {state.total_laps}; {record.name} has {record.laps}")
    if state.driver != driver:
        raise RsrlError(f"state: driver is {state.driver}, not {driver}")
    drivers = [c.driver for c in state.cars]
    for name in drivers:
        if drivers.count(name) > 1:
            raise RsrlError(f"state: cars has {name} twice")
        if name not in {c.driver for c in record.cars}:
            raise RsrlError(f"state: {name} did not start at {record.name}")
    if state.status_laps < 0:
        raise RsrlError(f"state: status_laps is {state.status_laps}; it counts from 0")
    for entry in state.cars:
        _check_car(state, entry)
    _check_order(state)
    _check_sets(record, state)


def _check_car(state: UnifiedRaceState, entry: CarState) -> None:
    done = state.laps_completed
    whole = {
        "position": (entry.position, 1, FIELD_SIZE),
        "tyre_age_laps": (entry.tyre_age_laps, 0, done if entry.running else state.total_laps),
        "stops": (entry.stops, 0, done),
    }
    for name, (value, low, high) in whole.items():
        if not low <= value <= high:
            raise RsrlError(f"state: {name} of {entry.driver} is {value}; after {done} laps it is {low} to {high}")
    numbers = {"form_s": entry.form_s, "set_luck_s": entry.set_luck_s, "worn_laps": entry.worn_laps or 0.0}
    if entry.running:
        numbers |= {"gap_to_leader_s": entry.gap_to_leader_s, "last_lap_s": entry.last_lap_s}
    for name, number in numbers.items():
        if not math.isfinite(number):
            raise RsrlError(f"state: {name} of {entry.driver} is {number}; it must be a number")
    if entry.worn_laps is not None and entry.worn_laps < 0:
        raise RsrlError(f"state: worn_laps of {entry.driver} is {entry.worn_laps:g}; it must not be negative")
    if entry.just_stopped and (entry.tyre_age_laps > 0 or entry.stops < 1):
        raise RsrlError(f"state: {entry.driver} just stopped, so its tyre_age_laps is 0 and its stops 1 or more")


def _check_order(state: UnifiedRaceState) -> None:
    running = sorted((c for c in state.cars if c.running), key=lambda c: c.position)
    for place, entry in enumerate(running, 1):
        if entry.position != place:
            raise RsrlError(f"state: position of {entry.driver} is {entry.position}; the running cars stand 1 to {len(running)}, each once")
    if running[0].gap_to_leader_s != 0.0:
        raise RsrlError(f"state: gap_to_leader_s of {running[0].driver}, who leads, is {running[0].gap_to_leader_s:g}; it must be 0")
    for ahead, behind in zip(running, running[1:], strict=False):
        if behind.gap_to_leader_s < ahead.gap_to_leader_s:
            raise RsrlError(
                f"state: gap_to_leader_s of {behind.driver} is {behind.gap_to_leader_s:g}, less than that of {ahead.driver} a place ahead"
            )


def _check_sets(record: RaceRecord, state: UnifiedRaceState) -> None:
    own = next(c for c in state.cars if c.driver == state.driver)
    if own.compound not in state.compounds_used:
        raise RsrlError(f"state: compounds_used lacks {own.compound}, which {own.driver} is on")
    if math.isnan(state.previous_gap_ahead_s):
        raise RsrlError("state: previous_gap_ahead_s is not a number")
    for name, left, sets in zip(("soft", "medium", "hard"), state.sets_left, record.sets, strict=True):
        if not 0 <= left <= sets:
            raise RsrlError(f"state: sets_left has {left} sets of {name}; a car has 0 to {sets} at {record.name}")


def check_history(state: UnifiedRaceState, history: Sequence[UnifiedRaceState]) -> None:
    """Raise RsrlError where states before are not of the same race and car, one a lap up to this one."""
    seen = [*history, state]
    for before, after in zip(seen, seen[1:], strict=False):
        if (before.race, before.driver) != (after.race, after.driver):
            raise RsrlError(f"state: history is of {before.driver} at {before.race}, not of {after.driver} at {after.race}")
        if after.laps_completed != before.laps_completed + 1:
            raise RsrlError(f"state: history goes from lap {before.laps_completed} to lap {after.laps_completed}; it must hold every lap")
