"""A simulated race, told as a lap table and read back, gives the states and calls of the simulator's own translator.

Compared at the moment that the simulator's state means: all cars have completed the lap, nobody the next one. What a lap table cannot
say as exactly as the simulator knows it is left out or given a tolerance, each with its reason.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pytest
from exported_race import Exported, export_race

from rsrl.explanation import load_any_policy
from rsrl.feeds import LapCompleted, PitIn
from rsrl.feeds.lap_files import lap_events
from rsrl.replay import StateCaller
from rsrl.season import GREEN, VSC, RaceRecord
from rsrl.state import CarState, UnifiedRaceState
from rsrl.translators import RaceTracker, TrackedStates

RACES = range(6)
STOPS = (14, 33)

ON_THE_LAP_S = 60.0
"""Cars further behind the leader may still be in the pit lane, or on the lap before, when the leader completes the next one."""

ROUNDING_S = 0.01
"""Times are float32 in the simulator, and sums of lap times in the table."""


class Pair(NamedTuple):
    """A state by the simulator's translator, and by way of the lap table."""

    race: int
    simulated: UnifiedRaceState
    tracked: UnifiedRaceState
    settled: bool  # no change of track status at the end of the last lap


def read_back(exported: Exported, record: RaceRecord, driver: str) -> dict[int, UnifiedRaceState]:
    """States by laps completed from the lap table."""
    tracker = RaceTracker()
    states = TrackedStates(record, tracker)
    found: dict[int, UnifiedRaceState] = {}
    for event in lap_events(exported.table):
        own = next((car for car in tracker.cars.values() if car.driver == driver), None)
        ends = own is not None and isinstance(event, LapCompleted | PitIn) and event.lap == own.laps + 1
        if own is not None and ends and own.laps not in found:
            state = states.state(own.number, under_way=False).state
            assert state is not None
            found[own.laps] = state
        states.note(tracker.take(event))
    return found


@pytest.fixture(scope="module")
def pairs(bahrain: RaceRecord) -> list[Pair]:
    car = bahrain.car_index("HAM")
    found = []
    slow = 0
    for race in RACES:
        exported = export_race(bahrain, car, 5, race, STOPS)
        slow += exported.slow_laps
        tracked = read_back(exported, bahrain, "HAM")
        assert set(exported.states) - {max(exported.states)} <= set(tracked) <= set(exported.states)
        for lap, state in tracked.items():
            before = exported.states[max(lap - 1, 0)].track_status
            found.append(Pair(race, exported.states[lap], state, before == exported.states[lap].track_status))
    assert slow > 5  # laps under a safety car are among them
    return found


def cars_of(pairs: list[Pair]) -> Iterator[tuple[Pair, CarState, CarState]]:
    """The cars of both states that are on the leader's lap."""
    for pair in pairs:
        other = {c.driver: c for c in pair.tracked.cars if c.running}
        for car in pair.simulated.cars:
            if car.driver in other and car.gap_to_leader_s is not None and car.gap_to_leader_s < ON_THE_LAP_S:
                yield pair, car, other[car.driver]


def test_the_race_and_the_own_car_are_the_same(pairs: list[Pair]) -> None:
    """But for the last lap of a virtual safety car: its end, which no lap tells, is placed before the leader's crossing."""
    following = {(pair.race, pair.simulated.laps_completed - 1): pair.simulated.track_status for pair in pairs}
    for pair in pairs:
        a, b = pair.simulated, pair.tracked
        assert (a.race, a.driver, a.laps_completed, a.total_laps) == (b.race, b.driver, b.laps_completed, b.total_laps)
        assert (a.compounds_used, a.sets_left) == (b.compounds_used, b.sets_left)
        if a.track_status == VSC and following.get((pair.race, a.laps_completed)) == GREEN:
            continue
        assert a.track_status == b.track_status
        if a.track_status:
            assert a.status_laps == b.status_laps


def test_cars_are_the_same_but_for_what_the_table_cannot_tell(pairs: list[Pair]) -> None:
    met = 0
    running = {(p.race, p.simulated.laps_completed, c.driver) for p in pairs for c in p.simulated.cars if c.running}
    for pair, a, b in cars_of(pairs):
        if a.just_stopped and (pair.race, pair.simulated.laps_completed + 1, a.driver) not in running:
            continue  # retired on its out-lap: no row of the table has its new set
        assert (a.compound, a.tyre_age_laps, a.stops, a.just_stopped) == (b.compound, b.tyre_age_laps, b.stops, b.just_stopped)
        assert a.last_lap_s == pytest.approx(b.last_lap_s, abs=ROUNDING_S)
        assert a.worn_laps == pytest.approx(b.worn_laps, abs=1e-3)
        met += a.just_stopped
    assert met > 20


def test_gaps(pairs: list[Pair]) -> None:
    """Exact to the rounding, but for cars of which the crossing does not show the whole stop yet, the leader among them."""
    stopped: list[float] = []
    for pair, a, b in cars_of(pairs):
        assert a.gap_to_leader_s is not None
        assert b.gap_to_leader_s is not None
        leads = any(c.just_stopped for c in (pair.simulated.cars[0], pair.tracked.cars[0]))
        error = abs(a.gap_to_leader_s - b.gap_to_leader_s)
        if pair.simulated.laps_completed == 0:
            assert error < 1.0  # the launch by compound can put a car ahead of one on a better place
        elif a.just_stopped or b.just_stopped:
            stopped += [error] * pair.settled
        elif not leads:
            assert error < ROUNDING_S
    assert np.median(stopped) < 0.5
    assert np.quantile(stopped, 0.9) < 1.5


def test_form_and_set_luck(pairs: list[Pair]) -> None:
    """By the same posterior; laps differ on which the status changed as cars were at different places of the track."""
    forms = [abs(a.form_s - b.form_s) for _, a, b in cars_of(pairs)]
    lucks = [abs(a.set_luck_s - b.set_luck_s) for _, a, b in cars_of(pairs)]
    assert np.mean(np.array(forms) < ROUNDING_S) > 0.9
    assert np.mean(np.array(lucks) < ROUNDING_S) > 0.8
    assert np.quantile(forms, 0.99) < 0.1
    learned = [abs(a.form_s) for _, a, _ in cars_of(pairs)]
    assert np.median(learned) > 5 * np.median(forms)


def test_calls_are_the_same(pairs: list[Pair], bahrain: RaceRecord) -> None:
    """Where they are not, the values of the two calls are close together."""
    caller = StateCaller(load_any_policy("all"), bahrain, bahrain.car_index("HAM"))
    same = 0
    for pair in pairs[::3]:
        ours, theirs = (
            caller.call(pair.tracked),
            caller.call(pair.simulated) if pair.simulated.laps_completed else caller.call(pair.tracked),
        )
        assert ours.legal == theirs.legal
        if ours.strategy.action == theirs.strategy.action:
            same += 1
            continue
        values = list((theirs.strategy.q_values or {}).values())
        assert values[theirs.strategy.action] - values[ours.strategy.action] < 0.2
    assert same >= 0.98 * len(pairs[::3])
