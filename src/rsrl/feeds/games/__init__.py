"""The Formula One games of 2023 to 2026: their UDP packets, recorded or as they come, as canonical events."""

from collections.abc import Iterator
from pathlib import Path

from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.events import Event
from rsrl.feeds.games.endpoint import DEFAULT_PORT, listen, play
from rsrl.feeds.games.live import live_game_events
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
