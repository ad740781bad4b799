"""Recordings of live timing as messages: a folder, a file, a file that still grows, a pipe."""

import contextlib
import gzip
import heapq
import sys
import time
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import IO, Final

from rsrl.errors import RsrlError
from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.live_timing.clock import session_clock
from rsrl.feeds.live_timing.messages import TOPICS, Message, json_value, parse_line, snapshot_messages

__all__ = ["STANDARD_INPUT", "messages_of_lines", "read_messages"]

STANDARD_INPUT: Final = Path("-")
"""The name of standard input in place of a recording."""

LONGEST_LINE: Final = 1 << 23
"""Bytes; an opening snapshot has some 200 thousand, so a longer line is none."""

UNREADABLE_START: Final = 100
"""A source whose first lines, as many as this, all lack a form is no recording of live timing."""

POLL_S: Final = 0.1
"""Between looks at a file that grows."""

SUBSCRIBE, LIVE, STREAM = "subscribe.json", "live.jsonl", ".jsonStream"


def read_messages(path: Path, anomalies: Anomalies, *, follow: bool = False, patience_s: float | None = None) -> Iterator[Message]:
    """The messages of a recording in the order in which they came, with the session clock as their stamp.

    The form is told from what is in it: an archive folder of `<Topic>.jsonStream` files, merged by time; a folder of undercut-f1; lines of
    any form of `messages`. Any file may be compressed (.gz). Lines that cannot be read are counted and left out.

    Args:
        path: a folder, a file, a named pipe, or `STANDARD_INPUT`.
        follow: go on when the file's end is reached, and wait for more.
        patience_s: end when nothing has come for so long; None waits for ever.

    Raises:
        RsrlError: there is nothing to read, or it is no recording of live timing.
    """
    if path != STANDARD_INPUT and path.is_dir():
        if follow and not (path / LIVE).is_file():
            raise RsrlError(f"{path}: an archive is of a session that is over; name the file that grows")
        messages = _folder(path, anomalies, follow, patience_s)
    else:
        messages = _file(path, anomalies, follow, patience_s)
    yield from session_clock(messages, anomalies)


def messages_of_lines(lines: Iterable[bytes], anomalies: Anomalies) -> Iterator[Message]:
    """The messages of lines as they come, such as those of a connection, with the session clock as their stamp."""
    yield from session_clock(_parsed(lines, anomalies, Path("the live feed"), None), anomalies)


def _folder(path: Path, anomalies: Anomalies, follow: bool, patience_s: float | None) -> Iterator[Message]:
    live = next((path / name for name in (LIVE, f"{LIVE}.gz") if (path / name).is_file()), None)
    if live:
        return _file(live, anomalies, follow, patience_s)
    files = [_archive_file(path, topic) for topic in TOPICS if topic != "TimingDataF1" or _archive_file(path, "TimingData") is None]
    streams = [_parsed(_lines(file, anomalies), anomalies, file, _topic_of(file)) for file in files if file]
    if not streams:
        raise RsrlError(f"{path}: holds no recording of live timing; there is neither {LIVE} nor any <Topic>{STREAM}")
    return heapq.merge(*streams, key=lambda message: message.stamp_s or 0.0)


def _archive_file(folder: Path, topic: str) -> Path | None:
    names = (folder / f"{topic}{STREAM}{suffix}" for suffix in ("", ".gz"))
    return next((name for name in names if name.is_file()), None)


def _topic_of(path: Path) -> str | None:
    """The topic that a file's name says: `TimingData` of `TimingData.jsonStream.gz`."""
    topic, stream, _ = path.name.partition(STREAM)
    return topic if stream and topic in TOPICS else None


def _file(path: Path, anomalies: Anomalies, follow: bool, patience_s: float | None) -> Iterator[Message]:
    subscribe = path.with_name(SUBSCRIBE)
    if path.name.startswith(LIVE) and subscribe.is_file():
        yield from _subscription(subscribe)
    yield from _parsed(_lines(path, anomalies, follow, patience_s), anomalies, path, _topic_of(path))


def _subscription(path: Path) -> list[Message]:
    """The opening snapshot that undercut-f1 keeps in a file of its own; older servers wrapped it in `R`."""
    try:
        topics = json_value(path.read_bytes().removeprefix(b"\xef\xbb\xbf"))
        return snapshot_messages(topics.get("R", topics) if isinstance(topics, dict) else topics, None)
    except OSError as error:
        raise RsrlError(f"{path}: cannot be read ({error.strerror})") from None
    except ValueError as error:
        raise RsrlError(f"{path}: is no opening snapshot of live timing ({error})") from None


def _parsed(lines: Iterable[bytes], anomalies: Anomalies, path: Path, topic: str | None) -> Iterator[Message]:
    """The messages of lines. Raises RsrlError where the first lines, or all there are, cannot be read."""
    read = bad = 0
    for line in lines:
        try:
            messages = parse_line(line, topic)
        except ValueError as error:
            bad += 1
            anomalies.add("bad line", f"{line[:60]!r} ({error})")
            if not read and bad >= UNREADABLE_START:
                break
            continue
        read += 1
        yield from messages
    if not read:
        why = f"none of its first {bad} lines can be read" if bad else "it is empty"
        raise RsrlError(f"{path}: is no recording of live timing: {why}")


def _lines(path: Path, anomalies: Anomalies, follow: bool = False, patience_s: float | None = None) -> Iterator[bytes]:
    """Lines without their ends and without blank ones. The last line may lack its end: it may be half written, or not."""
    rest = b""
    skipping = False  # within a line that is too long
    try:
        with _opened(path) as stream:
            for chunk in _chunks(stream, anomalies, follow, patience_s):
                *whole, rest = (rest + chunk).split(b"\n")
                if skipping and whole:
                    whole, skipping = whole[1:], False
                yield from (line for line in whole if line.strip())
                if len(rest) > LONGEST_LINE:
                    if not skipping:
                        anomalies.add("line too long", f"{rest[:60]!r}")
                    rest, skipping = b"", True
    except OSError as error:
        raise RsrlError(f"{path}: cannot be read ({error.strerror or error})") from None
    if rest.strip() and not skipping:
        with contextlib.suppress(ValueError):
            parse_line(rest, _topic_of(path))
            yield rest
            return
        anomalies.add("half-written last line", f"{rest[:60]!r}")


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[IO[bytes]]:
    if path == STANDARD_INPUT:
        yield sys.stdin.buffer
        return
    with path.open("rb") as raw:
        if path.suffix == ".gz":
            with gzip.open(raw) as unpacked:
                yield unpacked  # type: ignore[misc]  # a reader of bytes like any other
        else:
            yield raw


def _chunks(stream: IO[bytes], anomalies: Anomalies, follow: bool, patience_s: float | None) -> Iterator[bytes]:
    """What the stream holds and, where it is followed, what is added to it. A compressed file that is cut short ends where it is cut."""
    waited_s = 0.0
    while True:
        try:
            chunk = stream.read1(1 << 16) if hasattr(stream, "read1") else stream.read(1 << 16)
        except (EOFError, zlib.error, gzip.BadGzipFile) as error:
            anomalies.add("compressed file cut short", str(error))
            return
        if chunk:
            waited_s = 0.0
            yield chunk
        elif not follow or (patience_s is not None and waited_s >= patience_s):
            return
        else:
            time.sleep(POLL_S)
            waited_s += POLL_S
