"""Recordings of real sessions: what the reader makes of them, against the lap files of the same races."""

import ast
import gzip
import statistics
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from live_timing_lines import only, read

from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.events import (
    Entry,
    Event,
    Heartbeat,
    LapCompleted,
    LapCount,
    OvertakeAid,
    PitIn,
    PitOut,
    Retired,
    Session,
    SessionOver,
    TyreFitted,
)
from rsrl.feeds.live_timing.messages import parse_line
from rsrl.laps.schema import COMPOUND_LETTERS

pytestmark = pytest.mark.real_data

AZERBAIJAN = "azerbaijan_2018_race"
QATAR = "australia_2023_race_timing"
"""The folder says Australia; its grid, its drivers (40 is Lawson) and every stop are those of Qatar 2023."""

STOPPED_ON_LAP_1 = {7, 9, 14, 20, 28}
"""Of Azerbaijan: the lap file has all their laps some seconds early, so that one who came seventh leads it on the last lap."""

CarLap = tuple[int, int]


def laps_of(real_data: Path, season: int, number: int) -> dict[CarLap, dict[str, Any]]:
    """Rows of the lap file of a race by car and lap."""
    table = pl.read_csv(real_data / "laps" / f"laps_{season}.csv.gz", infer_schema_length=None).filter(pl.col("round") == number)
    return {(row["driver_number"], row["lap"]): row for row in table.iter_rows(named=True)}


def recording(real_data: Path, name: str) -> list[Event]:
    faults = Anomalies()
    events = read(real_data / "livetiming" / name, faults)
    assert not faults.counts, faults.summary()
    return events


def places(times: Mapping[CarLap, float]) -> dict[CarLap, int]:
    """Place of each car at the end of each lap, by when it crossed the line."""
    laps: dict[int, list[tuple[float, int]]] = defaultdict(list)
    for (car, lap), time_s in times.items():
        laps[lap].append((time_s, car))
    return {(car, lap): place for lap, cars in laps.items() for place, (_, car) in enumerate(sorted(cars), 1)}


def gaps(times: Mapping[CarLap, float]) -> dict[CarLap, float]:
    """Gap to the first across the line, s."""
    first: dict[int, float] = {}
    for (_, lap), time_s in times.items():
        first[lap] = min(first.get(lap, time_s), time_s)
    return {key: time_s - first[key[1]] for key, time_s in times.items()}


def crossings(events: Iterable[Event], without: Iterable[int] = ()) -> dict[CarLap, float]:
    return {(event.car, event.lap): event.time_s for event in events if isinstance(event, LapCompleted) and event.car not in without}


@pytest.mark.parametrize(
    ("name", "season", "number", "without", "share"), [(AZERBAIJAN, 2018, 4, STOPPED_ON_LAP_1, 0.97), (QATAR, 2023, 17, set(), 0.99)]
)
def test_laps_order_and_gaps_are_those_of_the_race(
    real_data: Path, name: str, season: int, number: int, without: set[int], share: float
) -> None:
    rows, events = laps_of(real_data, season, number), recording(real_data, name)
    every = crossings(events)
    assert set(every) == set(rows) - {(44, 1)} if name == QATAR else set(every) == set(rows)  # one who crashed in the first turn
    told = crossings(events, without)
    filed = {key: rows[key]["session_time_s"] for key in told}
    ours, theirs, our_gaps, their_gaps = places(told), places(filed), gaps(told), gaps(filed)
    assert sum(ours[key] == theirs[key] for key in told) >= share * len(told)
    assert statistics.median(abs(our_gaps[key] - their_gaps[key]) for key in told) < 0.1
    apart = [abs(our_gaps[key] - their_gaps[key]) for key in told if ours[key] != theirs[key]]
    assert max(apart) < 0.2, "cars side by side at most change places"


@pytest.mark.parametrize(("name", "season", "number"), [(AZERBAIJAN, 2018, 4), (QATAR, 2023, 17)])
def test_lap_times_and_stops_are_those_of_the_race(real_data: Path, name: str, season: int, number: int) -> None:
    rows, events = laps_of(real_data, season, number), recording(real_data, name)
    told = {(lap.car, lap.lap): lap.lap_time_s for lap in only(LapCompleted, events) if lap.lap_time_s is not None}
    assert len(told) == len({(lap.car, lap.lap) for lap in only(LapCompleted, events) if lap.lap > 1}), "the feed has no time of first laps"
    timed = [key for key in told if rows[key]["lap_time_source"] == "timing"]
    assert all(abs(told[key] - rows[key]["lap_time_s"]) < 0.0015 for key in timed)
    assert {(stop.car, stop.lap) for stop in only(PitIn, events)} == {key for key, row in rows.items() if row["pit_in"] is not None}
    left = {(stop.car, stop.lap) for stop in only(PitOut, events)}
    assert left == {key for key, row in rows.items() if row["pit_out"] is not None and key[1] > 1}


def tyres_by_lap(events: Iterable[Event]) -> dict[CarLap, TyreFitted]:
    """The set on which each lap was driven, as the feed has it at last."""
    stints: dict[int, int] = {}
    last: dict[tuple[int, int], TyreFitted] = {}
    laps: dict[CarLap, tuple[int, int]] = {}
    for event in events:
        if isinstance(event, TyreFitted):
            stints[event.car] = max(event.stint, stints.get(event.car, 0))
            last[event.car, event.stint] = event
        elif isinstance(event, LapCompleted) and event.car in stints:
            laps[event.car, event.lap] = event.car, stints[event.car]
    return {key: last[stint] for key, stint in laps.items()}


@pytest.mark.parametrize(("name", "season", "number", "without"), [(AZERBAIJAN, 2018, 4, {7}), (QATAR, 2023, 17, set())])
def test_tyres_are_those_of_the_race(real_data: Path, name: str, season: int, number: int, without: set[int]) -> None:
    """The feed called the third stint of car 7 in Azerbaijan one without a change until its second stop: the lap file believed it."""
    rows, fitted = laps_of(real_data, season, number), tyres_by_lap(recording(real_data, name))
    known = [key for key, row in rows.items() if row["compound"] and key in fitted and key[0] not in without]
    assert len(known) > 750
    assert [key for key in known if fitted[key].compound != COMPOUND_LETTERS[rows[key]["compound"]]] == []


def test_azerbaijan_ended_as_it_was_classified(real_data: Path) -> None:
    events = recording(real_data, AZERBAIJAN)
    last = {lap.car: lap.time_s for lap in only(LapCompleted, events) if lap.lap == 51}
    assert sorted(last, key=last.__getitem__) == [44, 7, 11, 5, 55, 16, 14, 18, 2, 28, 9, 10, 20]
    assert {event.car for event in only(Retired, events)} == {31, 35, 27, 3, 33, 8, 77}
    assert isinstance(events[0], Session)
    assert isinstance(events[-1], SessionOver)
    assert only(LapCount, events)[-1] == LapCount(only(LapCount, events)[-1].time_s, 51, 51)


def test_a_qualifying_session_is_recognised(real_data: Path) -> None:
    assert only(Session, recording(real_data, "spain_2024_qualifying")) == [Session(0.0, "qualifying", "Spanish Grand Prix", 2024)]


@pytest.mark.parametrize("name", ["bahrain_2023_race_no_timing", "bahrain_2025_race_no_timing", "china_2026_race_no_timing"])
def test_races_of_2023_to_2026_without_timing(real_data: Path, name: str) -> None:
    events = recording(real_data, name)
    drivers = {entry.car: entry.driver for entry in only(Entry, events)}
    assert len(drivers) == (22 if "2026" in name else 20)
    assert drivers[1] == ("NOR" if "2026" in name else "VER")
    assert [aid.enabled for aid in only(OvertakeAid, events)].count(True) >= 1
    assert only(LapCount, events)[-1].lap == only(LapCount, events)[-1].total_laps
    assert {event.car for event in only(TyreFitted, events)} <= set(drivers)
    assert len(only(SessionOver, events)) == 1


def test_five_minutes_of_a_sprint_with_one_broken_line(real_data: Path) -> None:
    faults = Anomalies()
    events = read(real_data / "livetiming" / "qatar2023_sprint_5min_signalr.txt", faults)
    assert faults.counts == {"bad line": 1}
    assert Counter(lap.lap for lap in only(LapCompleted, events))
    assert only(Session, events) == [Session(0.0, "race", "", 0)], "nothing in it says what session it is"


def test_a_sprint_joined_late_under_a_red_flag(real_data: Path) -> None:
    events = recording(real_data, "sao_paulo_2025_sprint_signalr.txt.gz")
    assert only(Session, events)[0].kind == "race", "the session is named only after its end"
    assert {entry.driver for entry in only(Entry, events)} >= {"NOR", "ANT", "RUS", "VER"}
    laps = defaultdict(set)
    for lap in only(LapCompleted, events):
        laps[lap.car].add(lap.lap)
    assert laps[4] == set(range(8, 25)), "from the restart to the flag"
    assert len(only(Heartbeat, events)) > 200
    assert len([event for event in only(PitOut, events) if event.time_s < 16 * 60]) >= 18, "the field leaves the pit lane for the restart"
    stamps = [event.time_s for event in only(LapCompleted, events)]
    assert max(stamps) < 3600


def test_every_line_of_the_late_join_is_read_as_python_reads_it(real_data: Path) -> None:
    with gzip.open(real_data / "livetiming" / "sao_paulo_2025_sprint_signalr.txt.gz") as lines:
        for line in lines:
            topic, payload, _ = ast.literal_eval(line.decode())
            assert [(m.topic, m.payload) for m in parse_line(line)] in ([(topic, payload)], [])
