"""A simulated race told as events of a feed, so that it reaches the page the way a recorded or a live one does.

Crossings of the line are the simulator's to the bit. What it does not have is placed: a car enters the pit lane at the line less the part
of the stop's loss that its in-lap shows, and leaves it with the rest; a retirement is told half a lap after the car's last crossing.
"""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from rsrl.explanation.moment import Arrays
from rsrl.feeds import (
    Entry,
    Event,
    LapCompleted,
    LapCount,
    PitIn,
    PitOut,
    Retired,
    Session,
    SessionOver,
    SetsLeft,
    StatusChanged,
    TyreFitted,
)
from rsrl.season import COMPOUNDS, GREEN, RaceRecord
from rsrl.simulator import layout as at

START_S: Final = 0.0
"""Session time of the start."""

GRID_S: Final = 10.0
"""Entries and starting tyres are told so long before the start."""


def simulated_events(record: RaceRecord, states: Sequence[Arrays], in_share: float) -> list[Event]:
    """The events of a race in order of time.

    Args:
        states: the simulator's f, k, r before the first lap, and after every lap.
        in_share: part of a stop's loss that the in-lap shows.
    """
    events: list[Event] = [Session(START_S - GRID_S, "race", record.event, record.season, record.laps)]
    for car, entry in enumerate(record.cars):
        events.append(Entry(START_S - GRID_S, car + 1, entry.driver, entry.team, entry.grid))
        events += _fitted(START_S - GRID_S, car, states[0], 0)
    events.append(LapCount(START_S, 1, record.laps))
    status, leader_s, last_s = GREEN, START_S, START_S
    for lap, (before, after) in enumerate(zip(states, states[1:], strict=False), 1):
        told = int(before[2][at.R_STATUS])
        if told != status:
            # as the leader begins the lap, the first of the new status
            events.append(StatusChanged(leader_s + 0.001, told))
            status = told
        of_lap = list(_lap_events(record, lap, before, after, in_share))
        events += of_lap
        crossings = [e.time_s for e in of_lap if isinstance(e, LapCompleted)]
        if crossings:
            leader_s, last_s = min(crossings), max(last_s, *crossings)
        if lap < record.laps:
            events.append(LapCount(leader_s, lap + 1, record.laps))
    events.append(SessionOver(last_s + 1.0))
    return sorted(events, key=lambda event: event.time_s)


def crossing_s(state: Arrays, car: int) -> float:
    """Session time at which a running car crossed the line at the end of the last lap, s: the rest of a stop is still to come then."""
    f, _, r = state
    return START_S + float(r[at.R_CLOCK_MS]) / 1000 + float(f[at.F_TIME, car]) - float(f[at.F_DUE, car])


def is_running(state: Arrays, car: int) -> bool:
    """Whether a car is still in the race."""
    return bool(state[1][at.K_PLACE, car] < state[2][at.R_RUNNING])


def _lap_events(record: RaceRecord, lap: int, before: Arrays, after: Arrays, in_share: float) -> Iterator[Event]:
    f, k, _ = after
    for car in range(len(record.cars)):
        if not is_running(before, car):
            continue
        if not is_running(after, car):
            begun_s = crossing_s(before, car) if lap > 1 else START_S
            yield Retired(begun_s + 0.5 * record.track.base_lap_s.value, car + 1)
            continue
        time_s, due_s = crossing_s(after, car), float(f[at.F_DUE, car])
        stopped = bool(k[at.K_STOPPED, car])
        if stopped:
            yield PitIn(time_s - due_s * in_share / max(1.0 - in_share, 0.1), car + 1, lap)
        yield LapCompleted(time_s, car + 1, lap, float(f[at.F_LAP, car]))
        if stopped:
            yield PitOut(time_s + due_s, car + 1, lap + 1)
            yield from _fitted(time_s + due_s, car, after, lap)


def _fitted(time_s: float, car: int, state: Arrays, lap: int) -> Iterator[Event]:
    """The set now on a car, and the sets left."""
    k = state[1]
    before = int(k[at.K_BEFORE, car])
    yield TyreFitted(time_s, car + 1, int(k[at.K_STOPS, car]) + 1, COMPOUNDS[k[at.K_COMPOUND, car]], before == 0, before, lap)
    soft, medium, hard = (int(n) for n in np.asarray(k[at.K_SOFT_SETS : at.K_SOFT_SETS + 3, car]))
    yield SetsLeft(time_s, car + 1, soft, medium, hard)
