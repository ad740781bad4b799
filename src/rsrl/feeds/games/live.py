"""A game's events as they come."""

from collections.abc import AsyncGenerator

from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.events import Event
from rsrl.feeds.games.endpoint import DEFAULT_PORT, listen
from rsrl.feeds.games.packets import decode
from rsrl.feeds.games.translate import GameFeed

__all__ = ["live_game_events"]


async def live_game_events(
    port: int = DEFAULT_PORT, anomalies: Anomalies | None = None, patience_s: float | None = None
) -> AsyncGenerator[Event, None]:
    """The events of a game that sends to a port, until nothing has come for `patience_s`. Raises RsrlError where the port is taken."""
    anomalies = anomalies or Anomalies()
    feed = GameFeed(anomalies)
    async for _, data in listen(port, anomalies, patience_s=patience_s):
        packet = decode(data, anomalies)
        if packet is not None:
            for event in feed.events(packet):
                yield event
