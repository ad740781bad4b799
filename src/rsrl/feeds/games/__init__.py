"""The Formula One games of 2023 to 2026: their UDP packets, recorded or as they come, as canonical events."""

from collections.abc import AsyncIterator, Iterator
from pathlib import Path

from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.events import Event
from rsrl.feeds.games.endpoint import DEFAULT_PORT, listen, play
from rsrl.feeds.games.packets import Packet, decode
from rsrl.feeds.games.recording import PacketWriter, read_packets
from rsrl.feeds.games.translate import GameFeed

__all__ = [
    "DEFAULT_PORT",
    "GameFeed",
    "Packet",
    "PacketWriter",
    "decode",
    "game_events",
    "listen",
    "live_game_events",
    "play",
    "read_packets",
]


def game_events(path: Path, anomalies: Anomalies | None = None) -> Iterator[Event]:
    """The events of a recording of a game. Raises RsrlError where it is none."""
    anomalies = anomalies or Anomalies()
    feed = GameFeed(anomalies)
    for _, data in read_packets(path, anomalies):
        packet = decode(data, anomalies)
        if packet is not None:
            yield from feed.events(packet)


async def live_game_events(
    port: int = DEFAULT_PORT, anomalies: Anomalies | None = None, patience_s: float | None = None
) -> AsyncIterator[Event]:
    """The events of a game that sends to a port, until nothing has come for `patience_s`. Raises RsrlError where the port is taken."""
    anomalies = anomalies or Anomalies()
    feed = GameFeed(anomalies)
    async for _, data in listen(port, anomalies, patience_s=patience_s):
        packet = decode(data, anomalies)
        if packet is not None:
            for event in feed.events(packet):
                yield event
