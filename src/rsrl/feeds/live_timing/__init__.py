"""Formula One's live timing, recorded or as it comes, as canonical events."""

from collections.abc import Iterator
from pathlib import Path

from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.events import Event
from rsrl.feeds.live_timing.sources import STANDARD_INPUT, messages_of_lines, read_messages
from rsrl.feeds.live_timing.translate import LiveTiming

__all__ = ["STANDARD_INPUT", "Anomalies", "LiveTiming", "live_timing_events", "messages_of_lines", "read_messages"]


def live_timing_events(
    path: Path, anomalies: Anomalies | None = None, *, season: int = 0, follow: bool = False, patience_s: float | None = None
) -> Iterator[Event]:
    """The events of a recording of live timing.

    Args:
        path: an archive folder, a folder of undercut-f1, a file of lines, or `STANDARD_INPUT`; see `read_messages`.
        anomalies: what could not be read is counted there.
        season: where the recording does not say; 0 for unknown.
        follow: wait for more at the end of a file that grows.
        patience_s: end when nothing has come for so long; None waits for ever.

    Raises:
        RsrlError: there is nothing to read, or it is no recording of live timing.
    """
    anomalies = anomalies or Anomalies()
    feed = LiveTiming(anomalies, season)
    for message in read_messages(path, anomalies, follow=follow, patience_s=patience_s):
        yield from feed.events(message)
