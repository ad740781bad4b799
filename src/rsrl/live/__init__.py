"""A race followed as it comes: live timing, a game, a file that grows; and recordings at the speed of a clock."""

from rsrl.live.feed import LiveFeed
from rsrl.live.follow_source import Moment, follow_live, follow_recorded
from rsrl.live.sources import LiveOptions, live_events

__all__ = ["LiveFeed", "LiveOptions", "Moment", "follow_live", "follow_recorded", "live_events"]
