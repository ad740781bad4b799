"""The sources that can be followed as they come: Formula One's live timing, a game, a file that grows, a pipe."""

import asyncio
import queue
import threading
from collections.abc import AsyncIterator, Callable, Iterable, Iterator
from pathlib import Path
from typing import Final, NamedTuple

from rsrl.errors import RsrlError
from rsrl.feeds import Event
from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.games import DEFAULT_PORT, live_game_events
from rsrl.feeds.live_timing import LiveTiming, live_timing_events, messages_of_lines
from rsrl.feeds.live_timing.recorder import Recorder
from rsrl.feeds.live_timing.signalr import URL
from rsrl.feeds.recordings import source_kind

__all__ = ["LiveOptions", "live_events"]

F1: Final = "f1"
GAME: Final = "game"


class LiveOptions(NamedTuple):
    """Of a live source.

    Attributes:
        port: UDP port of a game; None for the games' own.
        url: address of the live feed; None for Formula One's.
        record: a file that the lines of the live feed are written to as well.
        season: where live timing does not say; 0 for unknown.
        tell: takes a line for people, when a connection is made or lost.
    """

    port: int | None = None
    url: str | None = None
    record: Path | None = None
    season: int = 0
    tell: Callable[[str], None] = lambda _: None


def live_events(source: str, anomalies: Anomalies, options: LiveOptions) -> Callable[[], Iterable[Event] | AsyncIterator[Event]]:
    """What reads a source, for a thread of its own (`rsrl.live.LiveFeed`).

    Args:
        source: `f1`, `game`, the path of a recording of live timing that grows, or `-` for standard input.

    Raises:
        RsrlError: the source is none that can be followed. What is read later raises as its reader does.
    """
    if source == F1:
        return lambda: _f1_events(anomalies, options)
    if source == GAME:
        return lambda: live_game_events(options.port or DEFAULT_PORT, anomalies)
    kind, path = source_kind(source), Path(source)
    if kind != "live timing":
        raise RsrlError(f"{source}: a {kind} does not grow; replay it with rsrl replay. Sources are {F1}, {GAME}, a recording or -")
    if source != "-" and not path.exists():
        raise RsrlError(f"{source}: cannot be read (No such file or directory); sources are {F1}, {GAME}, a recording or -")
    follow = not path.is_dir() or (path / "live.jsonl").is_file()
    return lambda: live_timing_events(path, anomalies, season=options.season, follow=follow and source != "-")


def _f1_events(anomalies: Anomalies, options: LiveOptions) -> Iterator[Event]:
    """The events of the live feed; its connection lives in a thread of its own and is made again when it is lost."""
    lines: queue.Queue[bytes | BaseException | None] = queue.Queue()
    recorder = Recorder(options.record, options.tell, options.url or URL, take=lines.put)

    def connect() -> None:
        try:
            asyncio.run(recorder.run())
            lines.put(None)
        except BaseException as error:  # raised again where the lines are taken
            lines.put(error)

    threading.Thread(target=connect, daemon=True).start()
    feed = LiveTiming(anomalies, options.season)
    for message in messages_of_lines(_taken(lines), anomalies):
        yield from feed.events(message)


def _taken(lines: "queue.Queue[bytes | BaseException | None]") -> Iterator[bytes]:
    while (line := lines.get()) is not None:
        if isinstance(line, BaseException):
            raise line
        yield line.rstrip(b"\n")
