"""One session clock for all forms: an archive has it already, elsewhere the first time of day is its zero."""

from collections.abc import Iterable, Iterator
from typing import Final

from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.live_timing.messages import Message

__all__ = ["session_clock"]

LONGEST_LEAP_S: Final = 6 * 3600.0
"""No message comes so long after the one before, or before it; a stamp that says so is wrong, unless the next one like it agrees. The
session clock then goes on from where it was."""

AGREE_S: Final = 60.0
MOST_HELD: Final = 1000
_EPOCH_FROM_S: Final = 1e8
"""Stamps from here on are seconds since 1970, below they are of a session's clock."""


def session_clock(messages: Iterable[Message], anomalies: Anomalies) -> Iterator[Message]:
    """The messages with `stamp_s` on the session clock, s.

    Topics are not stamped by one clock, so that stamps go back by some seconds between topics; they are left as they are. A message
    without a stamp has the time of the one before; those before the first stamp, a snapshot as a rule, wait for it.
    """
    held: list[Message] = []
    origin = last = leapt = 0.0
    begun = False
    for message in messages:
        stamp = message.stamp_s
        if not begun:
            if stamp is None and len(held) < MOST_HELD:
                held.append(message)
                continue
            begun = True
            last = stamp or 0.0
            origin = last if last >= _EPOCH_FROM_S else 0.0
            yield from (early._replace(stamp_s=last - origin) for early in held)
            held = []
        if stamp is None:
            stamp = last
        elif abs(stamp - last) > LONGEST_LEAP_S:
            if abs(stamp - leapt) > AGREE_S:
                anomalies.add("time of day leaps", f"{message.topic} by {stamp - last:.0f} s")
                leapt, stamp = stamp, last
            else:
                origin += stamp - last
        last = stamp
        now = stamp - origin
        yield message if message.stamp_s == now else message._replace(stamp_s=now)
    yield from (early._replace(stamp_s=0.0) for early in held)
