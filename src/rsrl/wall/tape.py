"""The events of a source as they come, kept for all who follow them: each reader begins at the begin and waits where the source does."""

import threading
from collections.abc import Iterator

from rsrl.errors import RsrlError
from rsrl.feeds import Event, Session
from rsrl.season import RaceRecord
from rsrl.translators import News, RaceTracker, TrackedStates
from rsrl.wall.sources import Source

WAIT_S = 0.5
"""A reader looks so often whether it is to stop."""


class Tape:
    """Events so far. One thread writes them, any number read.

    Attributes:
        failed: why the source broke off, in one line; "" for an end as it should be.
    """

    def __init__(self) -> None:
        self.failed = ""
        self._events: list[Event] = []
        self._closed = self._stopped = False
        self._more = threading.Condition()

    def record(self, source: Source) -> None:
        """Take in a source to its end, or until `stop`."""
        try:
            for event in source.events():
                if self._stopped:
                    return
                with self._more:
                    self._events.append(event)
                    self._more.notify_all()
        except RsrlError as error:
            self.failed = str(error)
        with self._more:
            self._closed = True
            self._more.notify_all()

    def stop(self) -> None:
        """End all readers, and the writer at its next event."""
        with self._more:
            self._stopped = True
            self._more.notify_all()

    def read(self) -> Iterator[Event]:
        """All events from the first on, to the end of the source."""
        done = 0
        while True:
            with self._more:
                while done == len(self._events) and not (self._closed or self._stopped):
                    self._more.wait(WAIT_S)
                if self._stopped or done == len(self._events):
                    return
                event = self._events[done]
            done += 1
            yield event


class Timed:
    """A tracker with the session clock, 0 at the start of the race or at the first lap of one joined late, and states where wanted.

    Attributes:
        tracker, states: of the session under way; `states` None without a record.

    Args:
        stale_after_s: as of `TrackedStates`.
    """

    def __init__(self, record: RaceRecord | None, stale_after_s: float | None = None) -> None:
        self._record, self._stale_after_s = record, stale_after_s
        self.tracker = RaceTracker()
        self.states: TrackedStates | None = None
        self._start_s: float | None = None

    def take(self, event: Event) -> tuple[News, ...]:
        """Take in an event; what it changed."""
        news = self.tracker.take(event)
        if isinstance(event, Session):
            self._start_s = None
            self.states = None if self._record is None else TrackedStates(self._record, self.tracker, self._stale_after_s)
        if self.states is not None:
            self.states.note(news)
        if any(one.kind == "start" or (one.kind == "lap" and self._start_s is None) for one in news):
            self._start_s = self.tracker.time_s
        return news

    @property
    def started(self) -> bool:
        """The race has been started."""
        return self._start_s is not None

    def clock_s(self, time_s: float | None = None) -> float:
        """A time of the source, by default its latest, on the session clock; 0 before the start."""
        if self._start_s is None:
            return 0.0
        return round(max((self.tracker.time_s if time_s is None else time_s) - self._start_s, 0.0), 3)
