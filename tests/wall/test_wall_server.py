"""The server: viewers with their own car and clock, late ones, restarts, and refusals that disturb nobody else."""

import json
import socket
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from wall_races import RACE, SEED
from wall_server import Page, connected, running
from websockets.exceptions import ConnectionClosedError
from websockets.frames import CloseCode

from rsrl.wall import Settings, View
from rsrl.wall.server import resumed
from rsrl.wall.session_log import last_view
from rsrl.wall.settings import MESSAGE_BYTES

WATCH = {"type": "watch simulated", "race": RACE, "seed": SEED}


@pytest.fixture(scope="module")
def log_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("wall") / "log.jsonl"


@pytest.fixture(scope="module")
def port(log_path: Path) -> Iterator[int]:
    with running(Settings(log=log_path, viewers=4, sessions=2)) as port:
        yield port


@pytest.fixture
def page(port: int) -> Iterator[Page]:
    with connected(port) as socket:
        yield Page(socket)


@pytest.fixture
def other(port: int) -> Iterator[Page]:
    with connected(port) as socket:
        yield Page(socket)


def test_the_welcome_lists_what_there_is(page: Page) -> None:
    assert RACE in {race["name"] for race in page.welcome["races"]}
    assert page.welcome["recordings"] == []
    assert page.welcome["limits"] == {
        "message_bytes": MESSAGE_BYTES, "viewers": 4, "sessions": 2, "delay_s": 300.0, "slowest": 1.0, "fastest": 200.0,
    }  # fmt: skip


def test_a_race_runs_to_the_flag(page: Page) -> None:
    page.say(**WATCH, driver="HAM", lap=56, speed=200.0)
    session = page.hear("session")
    assert (session["race"], session["driver"], session["driven"], session["kind"]) == (RACE, "HAM", "HAM", "simulated")
    assert len(session["cars"]) == 20
    first = page.hear("race")
    assert first["lap"] in (56, 57)
    last = page.hear("race", lambda race: race["finished"])
    assert last["lap"] == 57
    assert page.hear("clock", lambda clock: not clock["playing"])["known_lap"] == 57


def test_two_viewers_have_their_own_car_and_clock(page: Page, other: Page) -> None:
    page.say(**WATCH, driver="HAM", lap=20, playing=False)
    other.say(**WATCH, driver="HAM", lap=40, playing=False)
    mine, theirs = page.hear("session"), other.hear("session")
    assert mine["session"] == theirs["session"], "one race, followed once"
    other.say(type="driver", driver="VER")
    assert other.hear("session", lambda s: s["driver"] == "VER")["session"] == mine["session"]
    calls = page.hear("call"), other.hear("call", lambda call: call["driver"] == "VER")
    assert [(call["driver"], call["lap"]) for call in calls] in ([("HAM", 20), ("VER", 40)], [("HAM", 20), ("VER", 39)])
    page.say(type="clock", command="step")
    assert page.hear("call", lambda call: call["lap"] == 21)["driver"] == "HAM"
    page.say(type="clock", command="back")
    assert page.hear("call", lambda call: call["lap"] == 20)["driver"] == "HAM"
    assert other.hear("clock")["lap"] == 40


def test_a_late_viewer_gets_the_whole_picture(page: Page) -> None:
    page.say(**WATCH, driver="HAM", lap=30, playing=False)
    race, history = page.hear("race"), page.hear("history")
    assert history["whole"]
    assert [lap["lap"] for lap in history["laps"]] == list(range(1, 30))
    assert len(race["tower"]) == 20
    full = page.hear("call", lambda call: call["stage"] == "full")
    assert full["lap"] == 30
    assert full["odds"]
    assert full["finish"]


def test_the_clock_obeys(page: Page) -> None:
    page.say(**WATCH, driver="HAM", lap=10, playing=False)
    at_ten = page.hear("clock", lambda clock: clock["lap"] >= 10)["time_s"]
    page.say(type="clock", command="seek", lap=12)
    assert page.hear("race", lambda race: race["lap"] >= 12)["time_s"] > at_ten
    page.say(type="clock", command="speed", speed=150.0)
    page.say(type="clock", command="play")
    assert page.hear("clock", lambda clock: clock["playing"])["speed"] == 150.0
    page.hear("race", lambda race: race["lap"] >= 13)
    page.say(type="clock", command="pause")
    page.hear("clock", lambda clock: not clock["playing"])
    page.say(type="clock", command="seek", time_s=0.0)
    assert page.hear("history", lambda history: history["whole"])["laps"] == []
    assert page.hear("clock", lambda clock: clock["time_s"] < 1.0)["lap"] == 1


def test_the_delay_holds_everything_back(page: Page) -> None:
    page.say(**WATCH, driver="HAM", lap=20, playing=False)
    now = page.hear("race")["time_s"]
    page.say(type="delay", delay_s=250.0)
    late = page.hear("race", lambda race: race["time_s"] < now - 200)
    assert late["time_s"] <= now - 250 + 1
    assert max(lap["lap"] for lap in page.hear("history", lambda h: h["whole"])["laps"]) < 19
    assert page.hear("clock", lambda clock: clock["delay_s"] == 250.0)["time_s"] == pytest.approx(now - 250, abs=3)
    page.say(type="ask call", lap=19)
    assert page.hear("error")["code"] == "not now"


def test_an_earlier_call_can_be_asked_for(page: Page) -> None:
    page.say(**WATCH, driver="HAM", lap=31, playing=False)
    page.hear("race")
    page.say(type="ask call", lap=29)
    asked = page.hear("call", lambda call: call["lap"] == 29)
    assert (asked["call"], asked["done"], asked["stage"]) == ("hard", "box", "full")


def test_an_explanation_comes_with_its_number(page: Page) -> None:
    page.say(**WATCH, driver="HAM", lap=16, playing=False)
    page.hear("race")
    page.say(type="explain", request=5, method="attribution", lap=16)
    assert page.hear("progress")["request"] == 5
    told = page.hear("explanation")
    assert (told["request"], told["method"], told["lap"], told["driver"]) == (5, "attribution", 16, "HAM")
    page.say(type="explain", request=6, method="attribution", lap=40)
    refused = page.hear("error")
    assert (refused["code"], refused["request"]) == ("not now", 6)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "malformed"),
        ("not json", "malformed"),
        ("[" * 2000, "malformed"),
        ('{"version": 1, "type": "nothing"}', "malformed"),
        ('{"version": 2, "type": "clock", "command": "play"}', "version"),
        ('{"version": 1, "type": "clock", "command": "play"}', "not now"),
        ('{"version": 1, "type": "explain", "request": 1, "method": "what-if", "lap": 3}', "not now"),
        ('{"version": 1, "type": "driver", "driver": "HAM"}', "not now"),
        ('{"version": 1, "type": "watch simulated", "race": "../../etc/passwd"}', "unknown"),
        ('{"version": 1, "type": "watch simulated", "race": "bahrain-2023", "driver": "NOBODY"}', "unknown"),
        ('{"version": 1, "type": "watch recorded", "name": "/etc/passwd", "race": "bahrain-2023"}', "unknown"),
        ('{"version": 1, "type": "watch recorded", "name": "laps_2023", "race": "bahrain-2023", "driver": "HAM"}', "unknown"),
    ],
)
def test_a_hostile_message_is_refused_in_one_line(page: Page, text: str, code: str) -> None:
    page.socket.send(text)
    error = page.hear("error")
    assert error["code"] == code
    assert not error["fatal"]
    assert "\n" not in error["text"]
    assert len(error["text"]) < 400


def test_bytes_are_refused(page: Page) -> None:
    page.socket.send(b"\x00\xff")
    assert page.hear("error")["code"] == "malformed"


def test_an_oversized_message_ends_the_connection_and_nobody_elses(page: Page, other: Page) -> None:
    page.socket.send("x" * (MESSAGE_BYTES + 1))
    with pytest.raises(ConnectionClosedError) as closed:
        page.hear("race")
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == CloseCode.MESSAGE_TOO_BIG
    other.say(type="clock", command="play")
    assert other.hear("error")["code"] == "not now"


def test_a_slow_viewer_holds_nobody_up(port: int, page: Page) -> None:
    """A viewer that asks for much and reads nothing; the other sees the race go on, and the slow one the newest when it reads again."""
    narrow = socket.create_connection(("127.0.0.1", port))
    narrow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
    with connected(port, narrow, max_queue=1) as slow_socket:
        slow = Page(slow_socket)
        slow.say(**WATCH, driver="HAM", lap=50, playing=False)
        slow.hear("race")
        for lap in (57, 50) * 15:
            slow.say(type="clock", command="seek", lap=lap)
        page.say(**WATCH, driver="HAM", lap=40, speed=20.0)
        times = [page.hear("race")["time_s"] for _ in range(10)]
        assert times == sorted(set(times))
        slow.say(type="clock", command="seek", lap=30)
        assert slow.hear("race", lambda race: race["lap"] in (29, 30))


def test_too_many_messages_end_the_connection_and_nobody_elses(page: Page, other: Page) -> None:
    other.say(**WATCH, driver="HAM", lap=5, playing=True, speed=5.0)
    other.hear("race")
    for _ in range(80):
        page.socket.send("{}")
    codes = set()
    while not (error := page.hear("error"))["fatal"]:
        codes.add(error["code"])
    assert codes <= {"malformed", "too many"}
    other.hear("race")


def test_the_number_of_viewers_is_bounded(port: int) -> None:
    with ExitStack() as stack:
        for _ in range(4):
            Page(stack.enter_context(connected(port)))
        fifth = stack.enter_context(connected(port))
        refused = json.loads(fifth.recv(10))
        assert (refused["type"], refused["code"], refused["fatal"]) == ("error", "too many", True)


def test_the_number_of_races_is_bounded(port: int, page: Page, other: Page) -> None:
    page.say(**WATCH, driver="HAM")
    page.hear("session")
    other.say(**WATCH | {"seed": 2}, driver="HAM")
    other.hear("session")
    with connected(port) as socket:
        third = Page(socket)
        third.say(**WATCH | {"seed": 3}, driver="HAM")
        assert "is the most" in third.hear("error")["text"]
        third.say(**WATCH, driver="HAM")
        assert third.hear("session")["seed"] == SEED


def test_the_log_keeps_what_is_watched(page: Page, log_path: Path) -> None:
    page.say(**WATCH, driver="HAM", lap=25, playing=False)
    begun = page.hear("race")["time_s"]
    page.say(type="clock", command="speed", speed=50.0)
    page.hear("clock", lambda clock: clock["speed"] == 50.0)
    kept = last_view(log_path)
    assert (kept.source, kept.race, kept.driver, kept.seed, kept.speed) == ("simulated", RACE, "HAM", SEED, 50.0)
    assert kept.time_s == pytest.approx(begun, abs=2.0)


def test_a_server_that_was_killed_goes_on(tmp_path: Path) -> None:
    """The log of a server that ended in the middle of a line is enough for the next one to show the same race at the same moment."""
    log = tmp_path / "log.jsonl"
    line = json.dumps({"format": 1, **View("simulated", RACE, "HAM", SEED, 2000.0, 20.0, True, 0.0)._asdict()})
    log.write_text(line + "\n" + line[:40], encoding="utf-8")
    with running(Settings(first=resumed(last_view(log)), log=log)) as port, connected(port) as socket:
        page = Page(socket)
        assert page.hear("session")["driver"] == "HAM"
        race, clock = page.hear("race"), page.hear("clock")
        assert race["lap"] == clock["lap"]
        assert (clock["time_s"], clock["speed"], clock["playing"]) == (2000.0, 20.0, False)
