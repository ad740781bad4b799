"""Events of a live source, read in a thread of its own, so that whoever takes them also notices when none come."""

import asyncio
import queue
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterable, Iterator
from typing import Final

from rsrl.errors import RsrlError
from rsrl.feeds import Event, Heartbeat

__all__ = ["LiveFeed"]

TICK_S: Final = 0.5
"""How often a silence is told of."""

MOST_WAITING: Final = 10_000
"""Events of a file that are read ahead; the reader of a port or a connection never waits, since what comes meanwhile would be lost."""

_END: Final = object()


class LiveFeed:
    """Events as they come, and silences by the wall clock; a context, and an iterator that may be run through once.

    Args:
        source: events from a thread: an iterable, which may block, or an asynchronous iterator, for which a loop is run.
        silent_after_s: once nothing has come for so long, a heartbeat says so every `TICK_S`.
        until_silent_s: end after so long without anything; None for never.
    """

    def __init__(
        self, source: Callable[[], Iterable[Event] | AsyncIterator[Event]], silent_after_s: float, until_silent_s: float | None = None
    ) -> None:
        self._source, self._silent_after_s, self._until_silent_s = source, silent_after_s, until_silent_s
        self._queue: queue.Queue[object] = queue.Queue()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._read, daemon=True)

    def __enter__(self) -> "LiveFeed":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()

    def _read(self) -> None:
        try:
            events = self._source()
            if isinstance(events, AsyncIterator):
                asyncio.run(self._from_loop(events))
            else:
                self._from_iterable(events)
            self._queue.put(_END)
        except BaseException as error:  # raised again where the events are taken
            self._queue.put(error)

    def _from_iterable(self, events: Iterable[Event]) -> None:
        for event in events:
            while self._queue.qsize() >= MOST_WAITING and not self._over.is_set():
                time.sleep(TICK_S / 10)
            if self._over.is_set():
                return
            self._queue.put(event)

    async def _from_loop(self, events: AsyncIterator[Event]) -> None:
        taking = asyncio.ensure_future(self._take(events))
        while not taking.done() and not self._over.is_set():
            await asyncio.wait([taking], timeout=TICK_S)
        if taking.done():
            taking.result()
        else:
            taking.cancel()
            await asyncio.gather(taking, return_exceptions=True)

    async def _take(self, events: AsyncIterator[Event]) -> None:
        async for event in events:
            self._queue.put(event)

    def __iter__(self) -> Iterator[Event]:
        """The events, with a heartbeat now and then while nothing comes. Raises what reading them raises."""
        came_s, latest_s, begun = time.monotonic(), 0.0, False
        while True:
            try:
                got = self._queue.get(timeout=TICK_S)
            except queue.Empty:
                silent_s = time.monotonic() - came_s
                if self._until_silent_s is not None and silent_s >= self._until_silent_s:
                    return
                if begun and silent_s >= self._silent_after_s:
                    yield Heartbeat(latest_s, silent_s=silent_s)
                continue
            if got is _END:
                return
            if isinstance(got, BaseException):
                raise got
            if not isinstance(got, Event):
                raise RsrlError("the source gives what is no event")
            came_s, latest_s, begun = time.monotonic(), max(latest_s, got.time_s), True
            yield got
