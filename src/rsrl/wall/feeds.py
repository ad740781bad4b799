"""Feeds of real races for the wall: Formula One's live timing, a game, a recording. Race and season file are settled before the server
begins, so that whatever is wrong with a source is told by the command and not by the page."""

from collections.abc import AsyncIterator, Callable, Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import Final, NamedTuple

from rsrl.explanation import AnyPolicy
from rsrl.feeds import Event
from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.pacing import with_silences
from rsrl.feeds.recordings import STALE_AFTER_S, open_source
from rsrl.live import LiveFeed, LiveOptions, live_events
from rsrl.live.sources import F1, GAME
from rsrl.replay import Asked, Bound, CarWatch
from rsrl.replay.binding import season_asked
from rsrl.wall.catalogue import LiveSource
from rsrl.wall.messages import RecordingChoice
from rsrl.wall.messages.server import SourceKind
from rsrl.wall.settings import View
from rsrl.wall.sources import Head, TrackedSource

__all__ = ["FeedSource", "feed_source"]

PIPE: Final = "-"
FIELD_KNOWN_S: Final = 2.0
"""Live timing and games tell of all cars at once: so long after the first car the field is known."""

LONGEST_NAME: Final = 80
"""Of a name in messages."""


class FeedSource(NamedTuple):
    """A feed that the server is started with.

    Attributes:
        live: as it is listed and opened.
        view: what viewers see at first.
        note: what there is to say of the season file; "" for nothing.
    """

    live: LiveSource
    view: View
    note: str


def feed_source(source: str, asked: Asked, *, follow: bool = False, tell: Callable[[str], None] = lambda _: None) -> FeedSource:
    """A feed, once its race is known: waits until the source has told of its cars.

    Args:
        source: `f1`, `game`, `-` for a pipe, or a recording as of `rsrl.feeds.recordings.open_source`.
        asked: race, driver and season file, as far as they were asked for.
        follow: the recording is still being written, and is watched as it grows.
        tell: takes a line for people, when a connection is made or lost.

    Raises:
        RsrlError: the source cannot be had, is of no race, or ends before its cars are known; race, driver or season file are unknown.
    """
    if follow or source in (F1, GAME, PIPE):
        reader = live_events(source, Anomalies(), LiveOptions(season=season_asked(asked), tell=tell))
        events, stale_after_s = _as_they_come(reader), STALE_AFTER_S
        watch, heard = _field(events, asked, stale_after_s)
        head = _head("live", watch, watch.settle())
        return _listed(source, watch.settle(), head, lambda policy: TrackedSource(policy, head, chain(heard, events), stale_after_s))
    recorded, silence_s, beside = _recording(source, asked)
    watch, _ = _field(iter(recorded), beside, silence_s)
    head = _head("recorded", watch, watch.settle())

    def read_anew(policy: AnyPolicy) -> TrackedSource:
        return TrackedSource(policy, head, _recording(source, asked)[0], silence_s)

    return _listed(source, watch.settle(), head, read_anew)


def _as_they_come(reader: Callable[[], Iterable[Event] | AsyncIterator[Event]]) -> Iterator[Event]:
    with LiveFeed(reader, STALE_AFTER_S) as feed:
        yield from feed


def _recording(source: str, asked: Asked) -> tuple[Iterable[Event], float | None, Asked]:
    """Events of a recording with its silences, what a silence may last, and what is asked for beside them."""
    opened = open_source(source, Anomalies(), asked.race, season_asked(asked))
    if opened.stale_after_s is None:
        return opened.events, None, asked._replace(race=None) if opened.kind == "lap file" else asked
    return with_silences(opened.events, opened.stale_after_s), opened.stale_after_s, asked


def _field(events: Iterator[Event], asked: Asked, stale_after_s: float | None) -> tuple[CarWatch, list[Event]]:
    """The source read until session, distance and cars are known, at the latest a second after the start; with the events read."""
    watch, heard = CarWatch(asked, None, stale_after_s), list[Event]()
    first_car_s: float | None = None
    for event in events:
        heard.append(event)
        watch.take(event)
        if watch.bound is not None:
            break
        if watch.tracker.cars and watch.tracker.session is not None and watch.tracker.total_laps is not None:
            first_car_s = event.time_s if first_car_s is None else first_car_s
            if event.time_s > first_car_s + FIELD_KNOWN_S:
                break
    watch.settle()
    return watch, heard


def _head(kind: SourceKind, watch: CarWatch, bound: Bound) -> Head:
    session, record = watch.tracker.session, bound.record
    assert session is not None
    event = session.event or (record.event if record else bound.name)
    season = session.season or (record.season if record else 0)
    laps = watch.tracker.total_laps or (record.laps if record else None)
    cars = tuple((car.driver, car.team or "") for car in watch.tracker.cars.values())
    return Head(kind, bound.name, event, season, laps, record, bound.note or "", cars=cars)


def _listed(source: str, bound: Bound, head: Head, opened: Callable[[AnyPolicy], TrackedSource]) -> FeedSource:
    name = source if source in (F1, GAME, PIPE) else Path(source).name[:LONGEST_NAME]
    assert head.kind != "simulated"
    choice = RecordingChoice(name=name, race=head.race, event=head.event, season=head.season, kind=head.kind)
    return FeedSource(LiveSource(choice, opened), View(name, head.race, bound.driver), head.note)
