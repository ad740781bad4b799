"""A log of a followed race: the events that came, and beside them whatever was made of them, as JSON lines that can be read again.

The first line is the head, `{"rsrl_log": 1, ...}`; then come `{"event": {...}}`, the canonical events in the order in which they were
taken in, and lines of other keys, such as `look`, which a reader of events passes over.
"""

from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Final

import msgspec

from rsrl.errors import RsrlError
from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.events import Event

__all__ = ["LOG_KEY", "EventLog", "log_events", "log_head"]

LOG_KEY: Final = "rsrl_log"
VERSION: Final = 1


class _Line(msgspec.Struct):
    event: Event | None = None


_encode: Final = msgspec.json.Encoder().encode
_decode: Final = msgspec.json.Decoder(_Line).decode


class EventLog:
    """Writes a log; a context. Each line is flushed, so that others can read it while it grows.

    Args:
        head: what is followed, under any keys.

    Raises:
        RsrlError: the file cannot be written.
    """

    def __init__(self, path: Path, head: dict[str, Any]) -> None:
        try:
            self._stream: IO[bytes] = path.open("wb")
        except OSError as error:
            raise RsrlError(f"{path}: cannot be written ({error.strerror})") from None
        self._write({LOG_KEY: VERSION, **head})

    def event(self, event: Event) -> None:
        """Add an event."""
        self._write({"event": event})

    def add(self, key: str, value: Any) -> None:
        """Add a line of another kind, under its key."""
        self._write({key: value})

    def _write(self, line: dict[str, Any]) -> None:
        self._stream.write(_encode(line) + b"\n")
        self._stream.flush()

    def __enter__(self) -> "EventLog":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._stream.close()


def log_head(path: Path) -> dict[str, Any]:
    """The head of a log. Raises RsrlError where the file is none."""
    try:
        with path.open("rb") as stream:
            head = msgspec.json.decode(stream.readline(1 << 20))
    except OSError as error:
        raise RsrlError(f"{path}: cannot be read ({error.strerror})") from None
    except msgspec.MsgspecError:
        head = None
    if not isinstance(head, dict) or head.get(LOG_KEY) != VERSION:
        raise RsrlError(f"{path}: is no log of rsrl live of version {VERSION}")
    return head


def log_events(path: Path, anomalies: Anomalies) -> Iterator[Event]:
    """The events of a log. Lines that cannot be read are counted; the last one may be half written.

    Raises:
        RsrlError: the file cannot be read, or is no log.
    """
    log_head(path)
    with path.open("rb") as stream:
        for line in stream:
            try:
                found = _decode(line)
            except msgspec.MsgspecError as error:
                anomalies.add("bad line" if line.endswith(b"\n") else "half-written last line", f"{line[:60]!r} ({error})")
                continue
            if found.event is not None:
                yield found.event
