"""OpenF1: its client against a server of ours, its rows to events, and the track status from race control's words."""

import json
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlparse

import pytest
from live_timing_lines import only

from rsrl.errors import RsrlError
from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.events import (
    Entry,
    Gap,
    LapCompleted,
    LapCount,
    OvertakeAid,
    PitIn,
    PitOut,
    Position,
    RaceControl,
    Session,
    SessionOver,
    StatusChanged,
    TyreFitted,
    Weather,
)
from rsrl.feeds.live_timing import live_timing_events
from rsrl.feeds.openf1 import ENDPOINTS, OpenF1, events_of_rows, openf1_events
from rsrl.feeds.openf1.track_status import status_after
from rsrl.season import GREEN, RED, SC, VSC
from rsrl.season.circuits import grand_prix_of

KEY = 7953
SESSION = {
    "session_key": KEY, "session_name": "Race", "session_type": "Race", "year": 2023, "country_name": "Bahrain", "meeting_key": 1141,
    "date_start": "2023-03-05T15:00:00+00:00", "date_end": "2023-03-05T17:00:00+00:00",
}  # fmt: skip


def at(time_s: float) -> str:
    return f"2023-03-05T15:{int(time_s // 60):02}:{time_s % 60:06.3f}+00:00"


def lap(car: int, number: int, begin_s: float | None, duration_s: float | None) -> dict[str, Any]:
    return {"driver_number": car, "lap_number": number, "date_start": None if begin_s is None else at(begin_s), "lap_duration": duration_s}


TABLES: dict[str, list[dict[str, Any]]] = {
    "drivers": [
        {"driver_number": 1, "name_acronym": "VER", "team_name": "Red Bull Racing"},
        {"driver_number": 11, "name_acronym": None, "team_name": None},
    ],
    "laps": [
        lap(1, 1, None, None), lap(1, 2, 300.0, 97.5), lap(1, 3, 397.5, 97.25),
        lap(11, 1, None, None), lap(11, 2, 301.2, 98.0), lap(11, 3, 399.2, None),
    ],
    "stints": [
        {"driver_number": 1, "stint_number": 1, "lap_start": 1, "lap_end": 2, "compound": "SOFT", "tyre_age_at_start": 3},
        {"driver_number": 1, "stint_number": 2, "lap_start": 3, "lap_end": 3, "compound": "HARD", "tyre_age_at_start": 0},
        {"driver_number": 11, "stint_number": 1, "lap_start": 1, "lap_end": 3, "compound": None, "tyre_age_at_start": None},
        {"driver_number": 11, "stint_number": 2, "lap_start": 9, "lap_end": 9, "compound": "SOFT", "tyre_age_at_start": 0},
    ],
    "pit": [{"driver_number": 1, "lap_number": 2, "date": at(410.0), "lane_duration": 22.5, "stop_duration": 2.4}],
    "position": [
        {"driver_number": 11, "date": at(0.0), "position": 1},
        {"driver_number": 1, "date": at(0.0), "position": 2},
        {"driver_number": 1, "date": at(250.0), "position": 1},
    ],
    "intervals": [
        {"driver_number": 1, "date": at(310.0), "gap_to_leader": 0.0, "interval": 0.0},
        {"driver_number": 11, "date": at(311.0), "gap_to_leader": 1.2, "interval": 1.2},
        {"driver_number": 11, "date": at(312.0), "gap_to_leader": "+1 LAP", "interval": None},
        {"driver_number": 11, "date": at(313.0), "gap_to_leader": None, "interval": None},
        {"driver_number": 99, "date": at(313.0), "gap_to_leader": None, "interval": None},
        {"driver_number": None, "date": at(313.0)},
    ],
    "race_control": [
        {"date": at(330.0), "category": "SafetyCar", "flag": None, "scope": None, "message": "SAFETY CAR DEPLOYED", "lap_number": 2},
        {"date": at(320.0), "category": "Drs", "flag": None, "scope": None, "message": "DRS ENABLED", "lap_number": 2},
        {"date": at(350.0), "category": "Flag", "flag": "CLEAR", "scope": "Track", "message": "TRACK CLEAR", "lap_number": 2},
        {"date": None, "message": "LOST"},
    ],
    "weather": [{"date": at(60.0), "air_temperature": 27.4, "track_temperature": 31.0, "rainfall": 0}],
}  # fmt: skip


def test_rows_become_events_in_the_order_of_their_dates() -> None:
    faults = Anomalies()
    events = events_of_rows(SESSION, TABLES, faults)
    assert [event.time_s for event in events] == sorted(event.time_s for event in events)
    assert events[:3] == [
        Session(0.0, "race", "Bahrain Grand Prix", 2023),
        Entry(0.0, 1, "VER", "Red Bull Racing", 2),
        Entry(0.0, 11, "11", None, 1),
    ]
    assert [(one.car, one.lap, one.time_s, one.lap_time_s) for one in only(LapCompleted, events)] == [
        (1, 1, 300.0, None), (11, 1, 301.2, None), (1, 2, 397.5, 97.5), (11, 2, 399.2, 98.0), (1, 3, 494.75, 97.25),
    ]  # fmt: skip
    assert [(one.time_s, one.lap) for one in only(LapCount, events)] == [(0.0, 1), (300.0, 2), (397.5, 3)]
    assert only(PitIn, events) == [PitIn(387.5, 1, 2)]
    assert only(PitOut, events) == [PitOut(410.0, 1, 3)]
    assert only(TyreFitted, events) == [
        TyreFitted(0.0, 1, 1, "S", False, 3, 0),
        TyreFitted(0.0, 11, 1, None, None, None, 0),
        TyreFitted(410.0, 1, 2, "H", True, 0, 2),
    ]
    assert [(one.car, one.position) for one in only(Position, events)] == [(11, 1), (1, 2), (1, 1)]
    assert only(Gap, events) == [Gap(310.0, 1, 0.0, 0), Gap(311.0, 11, 1.2, 0, 1.2), Gap(312.0, 11, None, 1), Gap(313.0, 11)]
    assert [(one.time_s, one.status) for one in only(StatusChanged, events)] == [(330.0, SC), (350.0, GREEN)]
    assert only(OvertakeAid, events) == [OvertakeAid(320.0, True)]
    assert len(only(RaceControl, events)) == 3
    assert only(Weather, events) == [Weather(60.0, 27.4, 31.0, False)]
    assert isinstance(events[-1], SessionOver)
    assert faults.counts == {
        "car that is not in the list of drivers": 1,
        "row of intervals without a car": 1,
        "stint without a beginning": 1,
    }


@pytest.mark.parametrize("garbage", [None, "x", 5, -1, [], {}, True, 1e300])
def test_rows_with_other_values_end_in_no_crash(garbage: Any) -> None:
    for endpoint, rows in TABLES.items():
        for key in rows[0]:
            spoilt = TABLES | {endpoint: [rows[0] | {key: garbage}, *rows[1:]]}
            assert isinstance(events_of_rows(SESSION, spoilt, Anomalies())[0], Session)
    for key in SESSION:
        assert isinstance(events_of_rows(SESSION | {key: garbage}, {}, Anomalies())[0], Session)


@pytest.mark.parametrize(
    ("kind", "name", "expected"),
    [("Race", "Sprint", "sprint"), ("Qualifying", "Sprint Shootout", "qualifying"), ("Practice", "Practice 2", "practice")],
)
def test_the_kind_of_session(kind: str, name: str, expected: str) -> None:
    (session,) = events_of_rows(SESSION | {"session_type": kind, "session_name": name}, {}, Anomalies())
    assert isinstance(session, Session)
    assert session.kind == expected


class Server:
    """A server of rows, which can be told to answer otherwise first.

    Attributes:
        first: answers before the right ones: status and headers.
        asked: endpoints in order, with their queries.
    """

    def __init__(self) -> None:
        self.first: list[tuple[int, dict[str, str]]] = []
        self.asked: list[tuple[str, dict[str, str]]] = []
        self.body: bytes | None = None
        outer = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:  # the name that the server calls
                parts = urlparse(self.path)
                endpoint, query = parts.path.removeprefix("/v1/"), {key: value[0] for key, value in parse_qs(parts.query).items()}
                outer.asked.append((endpoint, query))
                status, headers = outer.first.pop(0) if outer.first else (200, {})
                rows = outer.rows(endpoint)
                if status == 200 and not rows:
                    status = 404
                body = outer.body or (json.dumps(rows) if status == 200 else '{"detail":"No results found."}').encode()
                self.send_response(status)
                for name, value in (headers | {"Content-Length": str(len(body))}).items():
                    self.send_header(name, value)
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, format: str, *args: Any) -> None:
                pass

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.server.server_address[1]}/v1"
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def rows(self, endpoint: str) -> list[dict[str, Any]]:
        meetings = [
            {"meeting_key": 1141, "meeting_name": "Bahrain Grand Prix"},
            {"meeting_key": 1142, "meeting_name": "Saudi Arabian Grand Prix"},
        ]
        return {"sessions": [SESSION], "meetings": meetings}.get(endpoint) or TABLES.get(endpoint, [])


@pytest.fixture
def server() -> Iterator[Server]:
    running = Server()
    yield running
    running.server.shutdown()
    running.server.server_close()


class Waits(list[float]):
    def __call__(self, seconds: float) -> None:
        self.append(seconds)


def test_a_session_is_fetched_once_and_kept_for_good(server: Server, tmp_path: Path) -> None:
    events = openf1_events(KEY, OpenF1(server.url, tmp_path))
    assert events == events_of_rows(SESSION, TABLES, Anomalies())
    assert [endpoint for endpoint, _ in server.asked] == ["sessions", *ENDPOINTS]
    assert all(query == {"session_key": str(KEY)} for _, query in server.asked)
    asked = len(server.asked)
    assert openf1_events(KEY, OpenF1(server.url, tmp_path)) == events
    assert len(server.asked) == asked, "all of it was kept, the empty grid too"
    (tmp_path / f"{KEY}-laps.json").write_text("[{")
    assert openf1_events(KEY, OpenF1(server.url, tmp_path)) == events
    assert server.asked[asked:] == [("laps", {"session_key": str(KEY)})], "a file that is cut short is fetched again"


def test_a_session_that_is_not_long_over_is_not_kept(server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(SESSION, "date_end", "2999-03-05T17:00:00+00:00")
    openf1_events(KEY, OpenF1(server.url, tmp_path))
    assert not list(tmp_path.iterdir())


def test_a_server_that_is_busy_is_asked_again_when_it_says(server: Server, tmp_path: Path) -> None:
    waits = Waits()
    server.first = [
        (429, {"Retry-After": "7"}),
        (503, {}),
        (429, {"Retry-After": "Wed, 21 Oct 2015 07:28:00 GMT"}),
        (502, {"Retry-After": "9999"}),
    ]
    client = OpenF1(server.url, tmp_path, waits)
    assert client.session(KEY) == SESSION
    assert waits == [7.0, 2.0, 4.0, 120.0]


def test_a_server_that_stays_busy_or_away_is_given_up_in_one_line(server: Server, tmp_path: Path) -> None:
    waits = Waits()
    server.first = [(500, {})] * 6
    with pytest.raises(RsrlError, match="cannot be reached after 6 tries: it answers 500; what was fetched is kept"):
        OpenF1(server.url, tmp_path, waits).session(KEY)
    assert waits == [1, 2, 4, 8, 16, 32]
    with pytest.raises(RsrlError, match="cannot be reached after 6 tries"):
        OpenF1("http://127.0.0.1:9/v1", tmp_path, waits).session(KEY)


def test_history_is_closed_while_a_session_is_on(server: Server, tmp_path: Path) -> None:
    server.first = [(401, {})]
    with pytest.raises(RsrlError, match="a Formula One session is on, and until it is over even history needs a paid account"):
        OpenF1(server.url, tmp_path, Waits()).session(KEY)


@pytest.mark.parametrize(("status", "body"), [(200, b"<html>"), (200, b'{"a": 1}'), (200, b"[1]"), (403, b"[]")])
def test_answers_of_another_kind_are_told_in_one_line(server: Server, tmp_path: Path, status: int, body: bytes) -> None:
    server.first, server.body = [(status, {})], body
    with pytest.raises(RsrlError, match="sessions is not answered as expected") as caught:
        OpenF1(server.url, tmp_path, Waits()).session(KEY)
    assert "\n" not in str(caught.value)


def test_a_race_is_found_by_its_grand_prix(server: Server, tmp_path: Path) -> None:
    client = OpenF1(server.url, tmp_path)

    def same(meeting: str, wanted: str) -> bool:
        return grand_prix_of(meeting) == wanted

    assert client.race_key(2023, "bahrain", same) == KEY
    assert server.asked[-1] == ("sessions", {"meeting_key": "1141", "session_name": "Race"})
    with pytest.raises(RsrlError, match="no race of monaco 2023"):
        client.race_key(2023, "monaco", same)
    with pytest.raises(RsrlError, match="OpenF1 has no 2022; its history begins with 2023"):
        client.race_key(2022, "bahrain", same)


def test_a_session_that_does_not_exist_is_told_in_one_line(server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Server, "rows", lambda self, endpoint: [])
    with pytest.raises(RsrlError, match="OpenF1 has no session 5"):
        OpenF1(server.url, tmp_path).session(5)


@pytest.mark.parametrize(
    ("message", "flag", "scope", "before", "after"),
    [
        ("VIRTUAL SAFETY CAR DEPLOYED", None, None, GREEN, VSC),
        ("VIRTUAL SAFETY CAR ENDING", None, None, VSC, VSC),
        ("SAFETY CAR IN THIS LAP", None, None, SC, SC),
        ("RED FLAG", "RED", "Track", SC, RED),
        ("STANDING START PROCEDURE", None, None, RED, GREEN),
        ("GREEN LIGHT - PIT EXIT OPEN", "GREEN", "Track", RED, GREEN),
        ("CLEAR IN TRACK SECTOR 5", "CLEAR", "Sector", SC, SC),
        ("DOUBLE YELLOW IN TRACK SECTOR 5", "DOUBLE YELLOW", "Sector", GREEN, GREEN),
    ],
)
def test_the_track_status_after_a_message(message: str, flag: str | None, scope: str | None, before: int, after: int) -> None:
    assert status_after({"message": message, "flag": flag, "scope": scope}, before) == after


@pytest.mark.real_data
@pytest.mark.parametrize(
    "name", ["azerbaijan_2018_race", "bahrain_2023_race_no_timing", "bahrain_2025_race_no_timing", "china_2026_race_no_timing"]
)
def test_the_status_from_words_is_that_of_the_feed(real_data: Path, name: str) -> None:
    folder = real_data / "livetiming" / name
    feed = [event for event in live_timing_events(folder) if isinstance(event, StatusChanged)]
    status, told = GREEN, []
    for line in (folder / "RaceControlMessages.jsonStream").read_text("utf-8-sig").splitlines():
        messages = json.loads(line[12:])["Messages"]
        for row in messages if isinstance(messages, list) else messages.values():
            after = status_after({key.lower(): value for key, value in row.items()}, status)
            if after != status:
                hours, minutes, seconds = line[:12].split(":")
                status = after
                told.append((3600 * int(hours) + 60 * int(minutes) + float(seconds), after))
    expected = [event for event in feed if event is not feed[0] or event.status != GREEN]
    assert [after for _, after in told] == [event.status for event in expected]
    assert all(abs(time_s - event.time_s) < 5 for (time_s, _), event in zip(told, expected, strict=True))


def test_a_session_without_rows_is_a_session() -> None:
    assert events_of_rows(SESSION, {}, Anomalies()) == [Session(0.0, "race", "Bahrain Grand Prix", 2023)]
