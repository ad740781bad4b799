"""Recordings of a game's packets, as `rsrl record game` writes them: each datagram with the time at which it came."""

import struct
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Final

from rsrl.errors import RsrlError
from rsrl.feeds.anomalies import Anomalies

__all__ = ["PacketWriter", "read_packets"]

MAGIC: Final = b"RSRLPKT1"
_HEAD: Final = struct.Struct("<dH")
"""Seconds since the recording began, and bytes of the datagram that follows."""

FLUSH_EVERY: Final = 200


class PacketWriter:
    """Writes packets to a new file; a context. What a crash can lose is a second's packets."""

    def __init__(self, path: Path) -> None:
        try:
            self._stream = path.open("wb")
        except OSError as error:
            raise RsrlError(f"{path}: cannot be written ({error.strerror})") from None
        self._stream.write(MAGIC)
        self.count = 0

    def write(self, since_s: float, data: bytes) -> None:
        """Add a datagram."""
        self._stream.write(_HEAD.pack(since_s, len(data)) + data)
        self.count += 1
        if self.count % FLUSH_EVERY == 0:
            self._stream.flush()

    def __enter__(self) -> "PacketWriter":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._stream.close()


def read_packets(path: Path, anomalies: Anomalies) -> Iterator[tuple[float, bytes]]:
    """Seconds since the recording began, and the datagram. The last one may be half written.

    Raises:
        RsrlError: the file cannot be read, or is no recording of a game.
    """
    try:
        with path.open("rb") as stream:
            if stream.read(len(MAGIC)) != MAGIC:
                raise RsrlError(f"{path}: is no recording of a game's packets; rsrl record game makes one")
            while head := stream.read(_HEAD.size):
                if len(head) < _HEAD.size:
                    anomalies.add("half-written last packet")
                    return
                since_s, size = _HEAD.unpack(head)
                data = stream.read(size)
                if len(data) < size:
                    anomalies.add("half-written last packet")
                    return
                yield since_s, data
    except OSError as error:
        raise RsrlError(f"{path}: cannot be read ({error.strerror})") from None
