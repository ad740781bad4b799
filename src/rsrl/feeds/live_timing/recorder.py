"""Records the live feed to a file of RSRL's own lines, and connects again for as long as the session lasts."""

import asyncio
from collections.abc import Callable
from contextlib import aclosing, nullcontext
from datetime import UTC, datetime
from pathlib import Path
from typing import BinaryIO, Final

import msgspec

from rsrl.errors import RsrlError
from rsrl.feeds.live_timing.messages import own_line, parse_line
from rsrl.feeds.live_timing.signalr import SILENT_S, URL, FeedLost, Update, updates
from rsrl.feeds.live_timing.values import mapping

__all__ = ["Recorder"]

FIRST_WAIT_S: Final = 1.0
LONGEST_WAIT_S: Final = 30.0
FIRST_TRIES: Final = 5
"""Tries to reach the feed for the first time; once it has been reached there is no end to them."""

OFFLINE: Final = "check the network; without one, rsrl replay calls a recording, and rsrl live --source FILE one that grows"
"""What to do without a network."""


class _NewSession(Exception):  # noqa: N818
    """The feed has gone on to another session: everything before it is forgotten, and subscribed to anew."""


class Recorder:
    """Records a session of the live feed.

    Args:
        path: the file; each line is flushed, so that it can be read while it grows. A recording that exists is continued. None for no file.
        tell: takes a line for people when a connection is made or lost.
        url: the feed's address.
        silent_s: connect again after so long without anything.
        first_wait_s: before the second try; each further one waits twice as long, `LONGEST_WAIT_S` at most.
        take: takes each line too, as it is written.

    Attributes:
        lines: written so far.
        connections: how often the feed was joined.
        over: the session has ended.
    """

    def __init__(
        self,
        path: Path | None,
        tell: Callable[[str], None],
        url: str = URL,
        silent_s: float = SILENT_S,
        first_wait_s: float = FIRST_WAIT_S,
        take: Callable[[bytes], None] | None = None,
    ) -> None:
        self.path, self.tell, self.url, self.silent_s, self.first_wait_s, self.take = path, tell, url, silent_s, first_wait_s, take
        self.lines = self.connections = 0
        self.over = False

    async def run(self) -> None:
        """Record until the session ends.

        Raises:
            RsrlError: the file cannot be written, or is no recording; or the feed cannot be reached, `FIRST_TRIES` times in a row.
        """
        wait_s = self.first_wait_s
        tries = 0
        with _opened(self.path) if self.path else nullcontext() as stream:
            while not self.over:
                before = self.connections
                try:
                    await self._connection(stream)
                except FeedLost as lost:
                    tries += 1
                    if not self.connections and tries == FIRST_TRIES:
                        raise RsrlError(f"the live feed cannot be reached ({lost}); {OFFLINE}") from None
                    wait_s = self.first_wait_s if self.connections > before else wait_s
                    self.tell(f"{lost}; connecting again in {wait_s:.0f} s")
                    await asyncio.sleep(wait_s)
                    wait_s = min(2 * wait_s, LONGEST_WAIT_S)
                except _NewSession:
                    self.tell("another session begins; joining it")

    async def _connection(self, stream: BinaryIO | None) -> None:
        """Write what one connection gives, until the session ends. Raises FeedLost and _NewSession."""
        session: object = None
        async with aclosing(updates(self.url, silent_s=self.silent_s)) as feed:
            async for topic, payload, utc in feed:
                if not topic:
                    self.connections += 1
                    self.tell(f"connected to {self.url}")
                    session = mapping(payload.get("SessionInfo")).get("Key")
                elif topic == "SessionInfo" and (key := mapping(payload).get("Key", session)) != session:
                    if session is not None:
                        raise _NewSession
                    session = key
                self._write(_line((topic, payload, utc)), stream)
                if topic == "SessionStatus" and mapping(payload).get("Status") == "Ends":
                    self.over = True
                    return

    def _write(self, line: bytes, stream: BinaryIO | None) -> None:
        if stream is not None:
            stream.write(line)
            stream.flush()
        if self.take is not None:
            self.take(line)
        self.lines += 1


def _line(update: Update) -> bytes:
    topic, payload, utc = update
    if topic:
        return own_line(topic, payload, utc)
    now = datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
    return msgspec.json.encode({"snapshot": payload, "utc": now}) + b"\n"


def _opened(path: Path) -> BinaryIO:
    """The file, to add lines to; a last line that is half written is ended."""
    try:
        stream = path.open("ab+")
    except OSError as error:
        raise RsrlError(f"{path}: cannot be written ({error.strerror})") from None
    if stream.tell():
        stream.seek(0)
        first = stream.readline(1 << 23)
        try:
            parse_line(first)
        except ValueError:
            stream.close()
            raise RsrlError(f"{path}: exists and is no recording of live timing; name another file") from None
        stream.seek(-1, 2)
        if stream.read(1) != b"\n":
            stream.write(b"\n")
    return stream
