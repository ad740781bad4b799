"""A recording told at the speed of a clock, and its silences told as such."""

import time
from collections.abc import Iterable, Iterator
from typing import Final

from rsrl.errors import RsrlError
from rsrl.feeds.events import Event, Heartbeat, LapCompleted, LapCount

__all__ = ["paced", "parse_speed", "with_silences"]

SLOWEST: Final = 1.0
FASTEST: Final = 1000.0
AT_ONCE: Final = "max"


def parse_speed(text: str) -> float | None:
    """Speed of a replay clock, times that of the race; None for `max`. Raises RsrlError for what is neither."""
    if text.strip().lower() == AT_ONCE:
        return None
    try:
        speed = float(text.strip().lower().removesuffix("x"))
    except ValueError:
        speed = 0.0
    if not SLOWEST <= speed <= FASTEST:
        raise RsrlError(f"speed {text!r} is none; write {AT_ONCE}, or a number from {SLOWEST:.0f} to {FASTEST:.0f}")
    return speed


def with_silences(events: Iterable[Event], after_s: float) -> Iterator[Event]:
    """The events, and within each stretch of more than `after_s` on the source's clock in which there is none, a heartbeat after that time.

    So a reader notices a silence when it has lasted for so long, not when it ends.
    """
    latest_s: float | None = None
    for event in events:
        if latest_s is not None and event.time_s > latest_s + after_s:
            yield Heartbeat(latest_s, silent_s=after_s)
        latest_s = event.time_s if latest_s is None else max(latest_s, event.time_s)
        yield event


def paced(events: Iterable[Event], speed: float | None) -> Iterator[Event]:
    """The events, each when it is due on a clock of `speed` times the race's that begins with the first lap; None for all at once."""
    if speed is None:
        yield from events
        return
    begun: tuple[float, float] | None = None
    for event in events:
        if begun is None and isinstance(event, LapCount | LapCompleted):
            begun = event.time_s, time.monotonic()
        if begun is not None:
            time.sleep(max((event.time_s - begun[0]) / speed - (time.monotonic() - begun[1]), 0.0))
        yield event
