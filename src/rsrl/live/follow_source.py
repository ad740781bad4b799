"""Any source followed, live or recorded: one iterator of moments, for whoever shows a race."""

from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path
from typing import NamedTuple

from rsrl.explanation import AnyPolicy
from rsrl.feeds import Event, Heartbeat
from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.event_log import EventLog
from rsrl.feeds.pacing import paced, with_silences
from rsrl.feeds.recordings import STALE_AFTER_S, open_source
from rsrl.live.feed import LiveFeed
from rsrl.live.sources import LiveOptions, live_events
from rsrl.replay import Asked, CarWatch, live_look
from rsrl.replay.binding import season_asked
from rsrl.replay.follow import Look
from rsrl.results import LiveLook
from rsrl.translators import News, RaceTracker

__all__ = ["Moment", "follow_live", "follow_recorded"]


class Moment(NamedTuple):
    """A source after one more event.

    Attributes:
        clock_s: session time, s; what has passed silently since the last event is in it.
        watch: the tracker, the season file and the called car; the same object at every moment.
        event: taken in last.
        news: what it changed.
        looks: states and calls that it brought about, as they are logged.
        stale: nothing has been heard of the cars for too long.
    """

    clock_s: float
    watch: CarWatch
    event: Event
    news: tuple[News, ...]
    looks: tuple[LiveLook, ...]
    stale: bool

    @property
    def tracker(self) -> RaceTracker:
        """The race as it is known."""
        return self.watch.tracker


def follow_live(
    source: str,
    asked: Asked,
    policy: AnyPolicy | None,
    *,
    options: LiveOptions | None = None,
    anomalies: Anomalies | None = None,
    log: Path | None = None,
    until_silent_s: float | None = None,
) -> Iterator[Moment]:
    """Follow a source as it comes, until its session is over.

    Args:
        source: `f1`, `game`, the path of a recording that grows, or `-` for standard input.
        asked: race, driver and season file, as far as they were asked for.
        policy: calls the car; None follows it without calls.
        anomalies: what could not be read is counted there.
        log: a file that takes every event, state and call as a JSON line; `rsrl replay` reads it.
        until_silent_s: end after so long without anything; None for never.

    Raises:
        RsrlError: the source cannot be had, or is of no race; race, driver or season file are unknown; the log cannot be written.
    """
    anomalies = anomalies or Anomalies()
    options = options or LiveOptions()
    reader = live_events(source, anomalies, options._replace(season=options.season or season_asked(asked)))
    with LiveFeed(reader, STALE_AFTER_S, until_silent_s) as feed:
        yield from _moments(feed, source, asked, policy, STALE_AFTER_S, log)


def follow_recorded(
    source: str,
    asked: Asked,
    policy: AnyPolicy | None,
    *,
    speed: float | None = None,
    anomalies: Anomalies | None = None,
    log: Path | None = None,
) -> Iterator[Moment]:
    """Follow a recorded source to its end.

    Args:
        source: as of `rsrl.feeds.recordings.open_source`.
        asked, policy, anomalies, log: as of `follow_live`.
        speed: of a clock that begins with the first lap, times the race's; None for as fast as can be.

    Raises:
        RsrlError: as `follow_live`.
    """
    opened = open_source(source, anomalies or Anomalies(), asked.race, season_asked(asked))
    asked = asked._replace(race=None) if opened.kind == "lap file" else asked
    events = with_silences(opened.events, opened.stale_after_s) if opened.stale_after_s is not None else opened.events
    yield from _moments(paced(events, speed), source, asked, policy, opened.stale_after_s, log)


def _moments(
    events: "LiveFeed | Iterator[Event]", source: str, asked: Asked, policy: AnyPolicy | None, stale_after_s: float | None, log: Path | None
) -> Iterator[Moment]:
    fresh: list[LiveLook] = []

    def tell(driver: str, lap: int, look: Look) -> None:
        fresh.append(live_look(watch.tracker, driver, lap, look))

    watch = CarWatch(asked, policy, stale_after_s, tell)
    head = {"source": source, **asked._asdict(), "model": policy.name if policy else None}
    with EventLog(log, head) if log else nullcontext() as writer:
        for event in events:
            fresh.clear()
            news = watch.take(event)
            if writer is not None:
                writer.event(event)
                for look in fresh:
                    writer.add("look", look)
            silent_s = event.silent_s if isinstance(event, Heartbeat) else 0.0
            stale = stale_after_s is not None and watch.tracker.silent_s >= stale_after_s
            yield Moment(watch.tracker.time_s + silent_s, watch, event, news, tuple(fresh), stale)
            if watch.tracker.over and stale_after_s is not None:
                return
