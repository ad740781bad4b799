"""What the wall shows of a race is the race: the tower, the history, the stints, and nothing before it was known."""

from itertools import pairwise
from pathlib import Path

import pytest
from wall_races import Followed, follow, policy, simulated

from rsrl.explanation import record_episode
from rsrl.explanation.state_file import state_of
from rsrl.feeds import Entry, Event, LapCompleted, LapCount, Session, TyreFitted
from rsrl.season import RaceRecord
from rsrl.wall.messages import LapOfRace, Race
from rsrl.wall.race_log import RaceLog
from rsrl.wall.sources import Head, TrackedSource, recorded_source


def frames(followed: Followed) -> list[Race]:
    return [Race.model_validate_json(text) for text in followed.log.frames]


@pytest.fixture(scope="module")
def shown() -> list[Race]:
    return frames(simulated())


@pytest.fixture(scope="module")
def log() -> RaceLog:
    return simulated().log


def test_the_race_ends_as_the_simulator_has_it(shown: list[Race], bahrain: RaceRecord) -> None:
    number = simulated().source.head.race_number or 0
    episode = record_episode(policy(), bahrain, bahrain.car_index("HAM"), seed=1, race=number)
    outcome, last = episode.whole.outcome, shown[-1]
    assert last.finished
    assert last.lap == last.total_laps == bahrain.laps
    places = {row.driver: row.position for row in last.tower}
    assert places["HAM"] == int(outcome.position[0])
    stops = {row.driver: row.stops for row in last.tower}
    assert stops["HAM"] == int((episode.calls > 0).sum())


def test_sequence_and_time_never_go_back(shown: list[Race]) -> None:
    assert [race.sequence for race in shown] == list(range(len(shown)))
    assert all(a.time_s <= b.time_s and a.lap <= b.lap for a, b in pairwise(shown))
    assert shown[0].time_s == 0.0


def test_the_tower_has_every_car_once_in_order(shown: list[Race], bahrain: RaceRecord) -> None:
    started = {car.driver for car in bahrain.cars}
    for race in shown[:: len(shown) // 40]:
        assert [row.position for row in race.tower] == list(range(1, len(started) + 1))
        assert {row.driver for row in race.tower} == started
        running = [row for row in race.tower if not row.out]
        assert race.tower[: len(running)] == tuple(running)
        assert all(a.laps >= b.laps for a, b in pairwise(running))
        assert all(row.interval_s is None or row.interval_s >= 0 for row in race.tower)


def test_stints_cover_every_lap_of_a_car(shown: list[Race]) -> None:
    for row in shown[-1].tower:
        if not row.out:
            assert [bar.first_lap for bar in row.stints] == [1, *(bar.last_lap + 1 for bar in row.stints[:-1])]
            assert row.stints[-1].last_lap == row.laps
            assert len(row.stints) == row.stops + 1
            assert row.tyre.compound == row.stints[-1].compound
            assert row.sets_left is not None


def test_gaps_are_those_of_the_states(log: RaceLog, shown: list[Race]) -> None:
    """The gap on the tower after a lap without a stop is the simulator's own."""
    look = log.look_for("VER", 20, 1e9)
    assert look is not None
    assert look.moment is not None
    moment = look.moment()
    state = state_of(moment)
    own = next(car for car in state.cars if car.driver == "VER")
    at = log.frame_at(look.time_s)
    after = next(row for race in shown[at : at + 2] for row in race.tower if row.driver == "VER" and row.laps == 19)
    assert own.gap_to_leader_s is not None
    if not own.just_stopped:
        assert after.gap_to_leader_s == pytest.approx(own.gap_to_leader_s, abs=0.002)
    assert (after.tyre.compound, after.tyre.age_laps, after.stops) == (own.compound, own.tyre_age_laps, own.stops)


def test_the_history_grows_to_the_whole(log: RaceLog, bahrain: RaceRecord) -> None:
    whole = log.history(log.known_s, None)
    assert whole is not None
    assert whole.whole
    assert [lap.lap for lap in whole.laps] == list(range(1, bahrain.laps + 1))
    seen: dict[int, LapOfRace] = {}
    since: float | None = None
    for until in [*log.times_s[::50], log.known_s]:
        part = log.history(until, since)
        assert part is None or since is None or not part.whole
        seen |= {lap.lap: lap for lap in part.laps} if part else {}
        since = until
    assert tuple(seen.values()) == whole.laps
    assert log.history(log.known_s, log.known_s) is None


def test_nothing_is_told_before_it_was_known(log: RaceLog) -> None:
    half = log.known_s / 2
    history = log.history(half, None)
    assert history is not None
    assert max(lap.lap for lap in history.laps) <= log.lap_at(half)
    look = log.look_at("HAM", half)
    assert look is not None
    assert look.time_s <= half
    assert log.look_for("HAM", log.lap_at(half) + 3, half) is None
    assert log.done("HAM", look.lap, half) is None


def test_a_safety_car_is_shown(log: RaceLog, shown: list[Race]) -> None:
    whole = log.history(log.known_s, None)
    assert whole is not None
    slow = {lap.lap for lap in whole.laps if lap.status != "green"}
    assert slow
    assert {race.lap for race in shown if race.status != "green"} >= slow
    assert any(message.topic == "status" for message in shown[-1].messages)
    first = next(race for race in shown if race.status != "green")
    assert (first.lap, first.status_laps) == (min(slow), 0)
    assert all(look.status == next(lap.status for lap in whole.laps if lap.lap == look.lap) for look in log.looks["HAM"][:57])


def test_a_car_that_is_out_has_no_call(log: RaceLog, shown: list[Race]) -> None:
    assert next(row for row in shown[-1].tower if row.driver == "ZHO").out
    last = log.looks["ZHO"][-1]
    assert last.moment is None
    assert "out of the race" in last.reason


def test_a_feed_without_a_season_file_is_shown_without_calls() -> None:
    events: list[Event] = [Session(0.0, "race", "Nowhere Grand Prix", 2026, 2), Entry(0.0, 1, "AAA", "One"), Entry(0.0, 2, "BBB", "Two")]
    events += [TyreFitted(0.0, car, 1, "I") for car in (1, 2)]
    events += [LapCount(10.0, 1, 2), LapCompleted(100.0, 1, 1, 90.0), LapCompleted(101.5, 2, 1), LapCount(100.0, 2, 2)]
    head = Head("live", "nowhere-2026", "Nowhere Grand Prix", 2026, 2, None, "no season file", cars=(("AAA", "One"), ("BBB", "Two")))
    followed = follow(TrackedSource(policy(), head, sorted(events, key=lambda e: e.time_s)), ("AAA",))
    last = frames(followed)[-1]
    assert [(row.driver, row.gap_to_leader_s, row.tyre.compound) for row in last.tower] == [("AAA", None, "I"), ("BBB", 1.5, "I")]
    assert {look.reason for look in followed.log.looks["AAA"]} == {"no season file"}


@pytest.mark.real_data
def test_a_recorded_race_is_shown_as_it_was(real_data: Path) -> None:
    followed = follow(recorded_source(policy(), real_data / "laps" / "laps_2023.csv.gz", "bahrain-2023"), ("HAM",))
    last = frames(followed)[-1]
    assert [row.driver for row in last.tower[:5]] == ["VER", "PER", "ALO", "SAI", "HAM"]
    assert [(bar.compound, bar.last_lap) for bar in last.tower[4].stints] == [("S", 12), ("H", 30), ("H", 57)]
    assert last.tower[1].gap_to_leader_s == pytest.approx(11.987, abs=0.001)
    assert all(row.sets_left is None or "sets_left" in row.marks for row in last.tower), "no timing feed tells the sets left"
    look = followed.log.look_for("HAM", 20, 1e9)
    assert look is not None
    assert look.marks["sets_left"] == "derived"
    assert look.moment is not None
    assert look.moment().lap == 20
