"""A simulated race told in each source's form and read back: the states and calls that its lap table gives, within the forms' rounding."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np
import pytest
from exported_forms import GameTold, openf1_tables, write_lines
from exported_race import export_race

from rsrl.explanation import load_any_policy
from rsrl.feeds import Event, LapCompleted, PitIn
from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.games import PacketWriter
from rsrl.feeds.lap_files import lap_events
from rsrl.feeds.openf1 import events_of_rows
from rsrl.feeds.recordings import recording_events
from rsrl.replay import StateCaller
from rsrl.season import RaceRecord
from rsrl.state import CarState, UnifiedRaceState
from rsrl.translators import RaceTracker, TrackedStates

RACES = (10,)
STOPS = (12, 30)
GAP_S = 0.02
"""Two crossings, each to the millisecond, in a game to a half of one; and what float32 makes of an hour's clock."""

BAHRAIN = 3


def live_timing(events: Sequence[Event], folder: Path) -> Iterable[Event]:
    return recording_events(str(write_lines(folder / "race.jsonl", events)), Anomalies())


def openf1(events: Sequence[Event], folder: Path) -> Iterable[Event]:
    return events_of_rows(*openf1_tables(events), Anomalies())


def game(events: Sequence[Event], folder: Path) -> Iterable[Event]:
    with PacketWriter(folder / "race.packets") as writer:
        for since_s, data in GameTold(2023, BAHRAIN).packets(events):
            writer.write(since_s, data)
    return recording_events(str(folder / "race.packets"), Anomalies())


FORMS: dict[str, Callable[[Sequence[Event], Path], Iterable[Event]]] = {"live timing": live_timing, "OpenF1": openf1, "game": game}


def states_of(events: Iterable[Event], record: RaceRecord) -> dict[int, UnifiedRaceState]:
    """HAM's last state on each lap, by laps completed."""
    tracker = RaceTracker()
    states = TrackedStates(record, tracker)
    found: dict[int, UnifiedRaceState] = {}
    for event in events:
        own = next((car for car in tracker.cars.values() if car.driver == "HAM"), None)
        ends = own is not None and isinstance(event, LapCompleted | PitIn) and event.car == own.number
        if own is not None and ends and own.laps not in found:
            state = states.state(own.number).state
            assert state is not None
            found[own.laps] = state
        states.note(tracker.take(event))
    return found


@pytest.fixture(scope="module")
def races(bahrain: RaceRecord) -> list[list[Event]]:
    """Events of simulated races by way of their lap tables; safety cars are among them."""
    return [lap_events(export_race(bahrain, bahrain.car_index("HAM"), 5, race, STOPS).table) for race in RACES]


Pairs = list[tuple[UnifiedRaceState, UnifiedRaceState]]


@pytest.fixture(scope="module", params=list(FORMS))
def pairs(request: pytest.FixtureRequest, races: list[list[Event]], bahrain: RaceRecord, tmp_path_factory: pytest.TempPathFactory) -> Pairs:
    """The states of the lap table and of the form, lap by lap."""
    found: Pairs = []
    for events in races:
        table = states_of(events, bahrain)
        told = states_of(FORMS[request.param](events, tmp_path_factory.mktemp("form")), bahrain)
        assert set(told) == set(table)
        found += [(table[lap], told[lap]) for lap in sorted(table)]
    return found


def test_the_race_is_the_same(pairs: Pairs) -> None:
    for a, b in pairs:
        assert (a.race, a.driver, a.laps_completed, a.total_laps, a.track_status) == (
            b.race,
            b.driver,
            b.laps_completed,
            b.total_laps,
            b.track_status,
        )
        assert (a.status_laps, a.compounds_used) == (b.status_laps, b.compounds_used)
    assert any(a.track_status for a, _ in pairs)


def test_every_car_is_the_same(pairs: Pairs) -> None:
    for a, b in pairs:
        others = {car.driver: car for car in b.cars}
        for car in (c for c in a.cars if c.running):
            same_car(car, others[car.driver])


def same_car(a: CarState, b: CarState) -> None:
    assert (a.compound, a.tyre_age_laps, a.stops, a.just_stopped, a.running) == (
        b.compound,
        b.tyre_age_laps,
        b.stops,
        b.just_stopped,
        b.running,
    )
    assert a.gap_to_leader_s == pytest.approx(b.gap_to_leader_s, abs=GAP_S)
    assert a.last_lap_s == pytest.approx(b.last_lap_s, abs=GAP_S)
    assert a.worn_laps == pytest.approx(b.worn_laps, abs=1e-3)
    assert a.form_s == pytest.approx(b.form_s, abs=0.02)


def test_calls_are_the_same(pairs: Pairs, bahrain: RaceRecord) -> None:
    caller = StateCaller(load_any_policy("all"), bahrain, bahrain.car_index("HAM"))
    calls = np.array([[caller.call(state).strategy.action for state in pair] for pair in pairs[::4]])
    assert (calls[:, 0] == calls[:, 1]).mean() >= 0.98
