"""Clocks of recordings, silences, logs of events, and folders of OpenF1."""

import json
import time
from pathlib import Path

import pytest

from rsrl.errors import RsrlError
from rsrl.feeds import Entry, Event, Heartbeat, LapCompleted, LapCount, Session, TyreFitted
from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.event_log import EventLog, log_events, log_head
from rsrl.feeds.openf1 import events_of_rows
from rsrl.feeds.pacing import paced, parse_speed, with_silences
from rsrl.feeds.recordings import STALE_AFTER_S, open_source
from rsrl.translators import RaceTracker

EVENTS: list[Event] = [
    Session(0.0, "race", "Bahrain Grand Prix", 2023, 57),
    Entry(0.0, 44, "HAM", "Mercedes", 7),
    TyreFitted(0.0, 44, 1, "S", True, 0),
    LapCount(100.0, 1, 57),
    LapCompleted(200.0, 44, 1, None),
    LapCompleted(295.5, 44, 2, 95.5),
]


def test_a_clock_begins_with_the_first_lap() -> None:
    begun = time.monotonic()
    assert list(paced(EVENTS, 1000.0)) == EVENTS
    took_s = time.monotonic() - begun
    assert took_s >= 0.195, "195.5 s of racing"
    assert took_s < 100.0, "the formation lap is not waited for"


def test_speeds() -> None:
    assert [parse_speed(text) for text in ("max", "1", "10x", "1000")] == [None, 1.0, 10.0, 1000.0]
    for text in ("0.5", "1001", "fast", "nan", "-1", ""):
        with pytest.raises(RsrlError, match="write max, or a number from 1 to 1000"):
            parse_speed(text)


def test_a_silence_is_told_when_it_has_lasted() -> None:
    told = list(with_silences(EVENTS, 8.0))
    assert [event for event in told if not isinstance(event, Heartbeat)] == EVENTS
    assert [(beat.time_s, beat.silent_s) for beat in told if isinstance(beat, Heartbeat)] == [(0.0, 8.0), (100.0, 8.0), (200.0, 8.0)]


def test_the_tracker_is_silent_while_cars_race_and_nothing_comes() -> None:
    tracker = RaceTracker()
    for event in EVENTS[:4]:
        tracker.take(event)
    tracker.take(Heartbeat(100.0, silent_s=30.0))
    assert tracker.silent_s == 0, "no lap has been completed: cars may stand on the grid"
    tracker.take(EVENTS[4])
    tracker.take(Heartbeat(200.0, silent_s=12.5))
    assert tracker.silent_s == 12.5
    tracker.take(Heartbeat(209.0))
    assert tracker.silent_s == 12.5, "that a source is there says nothing of the cars"
    tracker.take(Heartbeat(210.0, on_track=True))
    assert tracker.silent_s == 0
    tracker.take(Heartbeat(225.0))
    assert tracker.silent_s == 15.0, "by the source's own clock"


def test_a_log_gives_its_events_back(tmp_path: Path) -> None:
    path = tmp_path / "race.log"
    with EventLog(path, {"driver": "HAM"}) as log:
        for event in EVENTS:
            log.event(event)
            log.add("look", {"call": "no pit"})
    assert log_head(path)["driver"] == "HAM"
    assert list(log_events(path, Anomalies())) == EVENTS
    source = open_source(str(path), Anomalies())
    assert (source.kind, source.stale_after_s) == ("log", STALE_AFTER_S)
    path.write_bytes(path.read_bytes().replace(b'{"event":{"type":"LapCount"', b'{"event":{"type":"Nothing"')[:-9])
    faults = Anomalies()
    assert list(log_events(path, faults)) == [event for event in EVENTS if not isinstance(event, LapCount)]
    assert faults.counts == {"bad line": 1, "half-written last line": 1}
    with pytest.raises(RsrlError, match="is no log of rsrl live"):
        log_head(Path(__file__))


ROW = {
    "session_key": 7,
    "session_name": "Race",
    "session_type": "Race",
    "year": 2023,
    "date_start": "2023-03-05T15:00:00+00:00",
    "meeting_name": "Bahrain Grand Prix",
}
TABLES = {
    "drivers": [{"driver_number": 44, "name_acronym": "HAM", "team_name": "Mercedes"}],
    "laps": [{"driver_number": 44, "lap_number": 1, "date_start": "2023-03-05T15:03:00+00:00", "lap_duration": 99.5}],
}


@pytest.mark.parametrize(("session", "table"), [("sessions", "{}"), ("session-7", "7-{}")], ids=["as downloaded", "as kept"])
def test_a_folder_of_openf1_is_read_without_the_network(tmp_path: Path, session: str, table: str) -> None:
    (tmp_path / f"{session}.json").write_text(json.dumps([ROW]))
    for name, rows in TABLES.items():
        (tmp_path / f"{table.format(name)}.json").write_text(json.dumps(rows))
    source = open_source(str(tmp_path), Anomalies())
    assert source.kind == "OpenF1"
    assert list(source.events) == events_of_rows(ROW, TABLES, Anomalies())


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({"sessions.json": [ROW, ROW | {"session_key": 8}]}, "holds 2 sessions"),
        ({"sessions.json": [ROW]}, "holds no laps of session 7"),
        ({"sessions.json": {"detail": "no"}}, "is no answer of OpenF1"),
    ],
)
def test_a_folder_that_is_no_session_is_refused(tmp_path: Path, files: dict[str, object], message: str) -> None:
    for name, content in files.items():
        (tmp_path / name).write_text(json.dumps(content))
    with pytest.raises(RsrlError, match=message):
        open_source(str(tmp_path), Anomalies())
