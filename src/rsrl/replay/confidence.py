"""How sure a call is: of the data that it rests on, and of its margin over the next best call."""

from typing import Final, NamedTuple

from rsrl.replay.caller import Called
from rsrl.state import ACTION_NAMES
from rsrl.translators import Tracked

__all__ = ["CLOSE_PLACES", "Confidence", "confidence_of"]

CLOSE_PLACES: Final = 0.1
"""Values of two calls that are nearer than this are close: a convention of display, not a measured error."""

SURE: Final = "high"
CLOSE: Final = "close"
LOW: Final = "low"
NONE: Final = "none"

OWN_FIELDS: Final = {"compound": "the tyre", "tyre_age_laps": "the age of the tyre"}


class Confidence(NamedTuple):
    """Of a call.

    Attributes:
        level: "high"; "close" where another call is worth nearly as much; "low" where data are incomplete; "none" without a call.
        why: what makes it less than high, in words.
    """

    level: str
    why: tuple[str, ...]


def confidence_of(tracked: Tracked, called: Called | None) -> Confidence:
    """The confidence of a call made from what was known."""
    if called is None:
        return Confidence(NONE, (tracked.reason,) if tracked.reason else ())
    health = tracked.health
    doubts = [f"{word} is assumed" for name, word in OWN_FIELDS.items() if health.fields.get(name) == "assumed"]
    doubts += health.missing
    doubts += [f"nothing is heard of {', '.join(health.unheard)}"] if health.unheard else []
    if doubts:
        return Confidence(LOW, tuple(doubts))
    margin = _margin(called)
    if margin is not None and margin < CLOSE_PLACES:
        return Confidence(CLOSE, (f"the next best call is worth {margin:.2f} places less",))
    return Confidence(SURE, ())


def _margin(called: Called) -> float | None:
    """Value of the call beyond the next best legal one; None where there is no other, or the policy has no values."""
    values = called.strategy.q_values
    others = [value for name, value in (values or {}).items() if name in called.legal and name != ACTION_NAMES[called.strategy.action]]
    return None if not values or not others else values[ACTION_NAMES[called.strategy.action]] - max(others)
