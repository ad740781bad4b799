"""A game's packets as they come, by UDP, and a recording sent as a game would send it."""

import asyncio
import errno
import socket
import time
from collections import deque
from collections.abc import AsyncIterator, Iterable
from typing import Final

from rsrl.errors import RsrlError
from rsrl.feeds.anomalies import Anomalies

__all__ = ["DEFAULT_PORT", "listen", "play"]

DEFAULT_PORT: Final = 20777
MOST_WAITING: Final = 1 << 14
"""Datagrams that wait to be read, some 30 s of a game at 60 Hz; beyond them the oldest are lost."""

MOST_LATE_S: Final = 0.05
"""A recording that is played later than this goes on later: packets in one burst to catch up would be lost."""

RECEIVE_BYTES: Final = 1 << 20
"""Asked of the system for the socket, which may give less: what comes while this process is not run waits there."""


class _Receiver(asyncio.DatagramProtocol):
    """Keeps datagrams with their time until they are read."""

    def __init__(self, anomalies: Anomalies) -> None:
        self.anomalies = anomalies
        self.waiting: deque[tuple[float, bytes]] = deque()
        self.arrived = asyncio.Event()
        self.begun_s = time.monotonic()

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        """Keep a datagram."""
        if len(self.waiting) >= MOST_WAITING:
            self.waiting.popleft()
            self.anomalies.add("packets came faster than they were read")
        self.waiting.append((time.monotonic() - self.begun_s, data))
        self.arrived.set()


async def listen(
    port: int, anomalies: Anomalies, host: str = "0.0.0.0", patience_s: float | None = None
) -> AsyncIterator[tuple[float, bytes]]:
    """Datagrams sent to a port, with seconds since listening began.

    Args:
        host: the address to listen at; all of this machine's by default, since a console sends from another one.
        patience_s: end when nothing has come for so long; None waits for ever.

    Raises:
        RsrlError: the port cannot be listened at, because another program does, as a rule.
    """
    loop = asyncio.get_running_loop()
    try:
        transport, receiver = await loop.create_datagram_endpoint(lambda: _Receiver(anomalies), local_addr=(host, port))
    except OSError as error:
        why = "another program listens there" if error.errno == errno.EADDRINUSE else error.strerror
        raise RsrlError(f"cannot listen at UDP port {port}: {why}; give another one with --port, and set it in the game too") from None
    transport.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BYTES)
    try:
        while True:
            while receiver.waiting:
                yield receiver.waiting.popleft()
            receiver.arrived.clear()
            try:
                await asyncio.wait_for(receiver.arrived.wait(), patience_s)
            except TimeoutError:
                return
    finally:
        transport.close()


async def play(packets: Iterable[tuple[float, bytes]], port: int, host: str = "127.0.0.1", speed: float = 1.0) -> int:
    """Send recorded packets to a port, `speed` times as fast as they came; how many were sent."""
    loop = asyncio.get_running_loop()
    transport, _ = await loop.create_datagram_endpoint(asyncio.DatagramProtocol, remote_addr=(host, port))
    begun_s, sent = time.monotonic(), 0
    try:
        for since_s, data in packets:
            early_s = since_s / speed - (time.monotonic() - begun_s)
            if early_s < -MOST_LATE_S:
                begun_s -= early_s
            await asyncio.sleep(max(early_s, 0.0))  # at zero too: who listens in this process reads one datagram a turn
            transport.sendto(data)
            sent += 1
    finally:
        transport.close()
    return sent
