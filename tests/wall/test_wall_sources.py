"""Recorded and live races are watched like simulated ones."""

import threading
from collections.abc import Iterator
from pathlib import Path

import polars as pl
import pytest
from exported_race import export_race
from wall_races import policy, simulated_source
from wall_server import Page, connected, running

from rsrl.explanation import AnyPolicy
from rsrl.feeds import Event, LapCompleted, RaceControl, Weather
from rsrl.feeds.event_log import EventLog
from rsrl.replay import Asked
from rsrl.season import RaceRecord
from rsrl.state import UnifiedRaceState
from rsrl.translators import Health, Tracked, TrackedCar
from rsrl.wall import Settings
from rsrl.wall.catalogue import Catalogue, LiveSource
from rsrl.wall.feeds import feed_source
from rsrl.wall.messages import RecordingChoice
from rsrl.wall.sources import Head, Known, Source, StateLooker, TrackedSource

CHOICE = RecordingChoice(name="live", race="bahrain-2023", event="Bahrain Grand Prix", season=2023, kind="live")


@pytest.fixture(scope="module")
def laps(bahrain: RaceRecord, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a simulated Bahrain as a lap file, and a file that is none."""
    folder = tmp_path_factory.mktemp("laps")
    table = export_race(bahrain, bahrain.car_index("HAM"), 5, 10, (12, 30)).table
    words = {"S": "SOFT", "M": "MEDIUM", "H": "HARD"}
    names = {"tyre_life_laps": "tyre_life", "pit_in_s": "pit_in", "pit_out_s": "pit_out"}
    table.with_columns(pl.col("compound").replace(words)).rename(names).write_csv(folder / "laps_2023.csv")
    (folder / "other.csv").write_text("a,b\n1,2\n", encoding="utf-8")
    return folder


def test_lap_files_of_the_folder_are_listed(laps: Path) -> None:
    catalogue = Catalogue(Settings(laps=laps))
    assert not catalogue.recordings
    catalogue.read()
    assert [(c.name, c.race, c.kind) for c in catalogue.recordings] == [("laps_2023", "bahrain-2023", "recorded")]


def test_a_recorded_race_is_watched(laps: Path) -> None:
    with running(Settings(laps=laps)) as port, connected(port) as socket:
        page = Page(socket)
        if not page.welcome["recordings"]:
            page.welcome = page.hear("welcome")
        assert page.welcome["recordings"][0]["name"] == "laps_2023"
        page.say(type="watch recorded", name="laps_2023", race="bahrain-2023", driver="HAM", lap=12, playing=False)
        session = page.hear("session")
        assert (session["kind"], session["driver"], session["driven"], session["seed"]) == ("recorded", "HAM", None, None)
        assert "summary" not in session["methods"]
        call = page.hear("call")
        assert (call["driver"], call["lap"]) == ("HAM", 12)
        assert call["call"] is not None
        assert call["marks"]["state.sets_left"] == "derived"
        page.say(type="clock", command="seek", lap=14)
        page.hear("race", lambda race: race["lap"] >= 14)
        page.say(type="ask call", lap=12)
        assert page.hear("call", lambda one: one["lap"] == 12)["done"] == "box", "the car drove the race that it drove"


class Feed:
    """A live feed that waits until it is let go on, lap by lap of the leader."""

    def __init__(self) -> None:
        self.go = threading.Event()
        source = simulated_source()
        record = source.head.record
        assert record is not None
        self.head = Head("live", record.name, record.event, record.season, record.laps, record)

    def events(self) -> Iterator[Event]:
        """Twenty laps, a message of race control and the weather; the rest when it is let go on."""
        for event in simulated_source().events():
            if isinstance(event, LapCompleted) and event.lap == 20:
                yield Weather(event.time_s, 24.0, 31.5, False)
                yield RaceControl(event.time_s, "CAR 7 (HAM) TIME NOTED", "note", 7)
                self.go.wait(60)
            yield event

    def open(self, policy: AnyPolicy) -> Source:
        return TrackedSource(policy, self.head, self.events())


def test_a_live_race_is_watched_as_it_happens() -> None:
    feed = Feed()
    policy()
    with running(Settings(live=(LiveSource(CHOICE, feed.open),))) as port, connected(port) as socket:
        page = Page(socket)
        assert [(r["name"], r["kind"]) for r in page.welcome["recordings"]] == [("live", "live")]
        page.say(type="watch recorded", name="live", race="bahrain-2023", driver="HAM")
        assert page.hear("session")["kind"] == "live"
        page.hear("race", lambda race: race["lap"] == 20)
        clock = page.hear("clock")
        assert clock["live"]
        assert clock["known_s"] == clock["time_s"]
        page.say(type="clock", command="seek", lap=3)
        assert page.hear("error")["code"] == "not now"
        page.say(type="delay", delay_s=300.0)
        held = page.hear("clock", lambda one: one["delay_s"] == 300.0)
        assert held["known_s"] < clock["known_s"], "what is held back is not told by the clock either"
        assert held["lap"] < 20
        page.say(type="delay", delay_s=0.0)
        page.hear("race", lambda race: race["lap"] == 20)
        assert page.hear("race", lambda race: race["age_s"] > 2.0)["lap"] == 20, "a silent feed is told"
        feed.go.set()
        last = page.hear("race", lambda race: race["finished"])
        assert last["weather"] == {"air_c": 24.0, "track_c": 31.5, "rain": False}
        assert "CAR 7 (HAM) TIME NOTED" in [message["text"] for message in last["messages"]]
        with connected(port) as late_socket:
            late = Page(late_socket)
            late.say(type="watch recorded", name="live", race="bahrain-2023", driver="VER")
            assert late.hear("race")["finished"]
            assert len(late.hear("history")["laps"]) == 57


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first twenty laps of the simulated race, as a log of `rsrl live`."""
    path = tmp_path_factory.mktemp("recording") / "bahrain.log"
    with EventLog(path, {}) as log:
        for event in simulated_source().events():
            if isinstance(event, LapCompleted) and event.lap == 21:
                break
            log.event(event)
    return path


def test_a_recording_is_what_the_page_shows_first_and_can_be_seen_again(recording: Path) -> None:
    feed = feed_source(str(recording), Asked(driver="VER"))
    assert (feed.view.source, feed.view.race, feed.view.driver) == ("bahrain.log", "bahrain-2023", "VER")
    first, again = (list(feed.live.open(policy()).events()) for _ in range(2))
    assert len(first) == len(again) > 300, "what was read to know the field is told as well"
    with running(Settings(live=(feed.live,), first=feed.view._replace(lap=12, playing=False))) as port:
        with connected(port) as socket:
            page = Page(socket)
            session = page.hear("session")
            assert (session["kind"], session["race"], session["driver"]) == ("recorded", "bahrain-2023", "VER")
            assert page.hear("call")["lap"] == 12
        with connected(port, path="/ws?first=0") as socket:
            page = Page(socket)
            page.say(type="watch recorded", name="bahrain.log", race="monza-2023", driver="VER")
            assert page.next()["code"] == "unknown", "nothing was shown that was not asked for"


def test_a_lap_without_a_state_ends_the_history(bahrain: RaceRecord) -> None:
    """A policy with a memory, and the rollouts, get the laps since: a history with a gap would be refused."""
    exported = export_race(bahrain, bahrain.car_index("HAM"), 5, 10, (12, 30)).states
    looker = _Looks([exported[lap] for lap in (1, 2, 3, 3, 5, 6)])
    moments = [known.moment() for known in (looker.look() for _ in range(6)) if known.moment is not None]
    assert [len(moment.raw) for moment in moments] == [1, 2, 3, 3, 1, 2]
    assert [moment.lap for moment in moments] == [2, 3, 4, 4, 6, 7]


class _Looks:
    """A looker at states that are given one after the other."""

    def __init__(self, states: list[UnifiedRaceState]) -> None:
        self._waiting = states
        self._looker = StateLooker(policy(), self)  # type: ignore[arg-type]  # all that is asked of it is here
        self.record = simulated_source().head.record
        self.cars = {1: TrackedCar(1, "HAM")}

    def state(self, number: int) -> Tracked:
        """The next of the states."""
        return Tracked(self._waiting.pop(0), "", Health(0.0))

    def look(self) -> Known:
        """A look at it."""
        return self._looker.look("HAM", self)  # type: ignore[arg-type]
