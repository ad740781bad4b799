"""A what-if in words. Every number in them stands in the table as well."""

from collections.abc import Sequence

from rsrl.explanation.moment import Moment
from rsrl.explanation.result import Decision
from rsrl.explanation.what_if.comparison import Comparison
from rsrl.explanation.what_if.options import doing, label
from rsrl.rollouts import Option

PART_NAMES = ("the stops", "tyres", "traffic", "safety cars")
SMALL_S = 0.05
EVERY = 0.995
"""Shares of futures from here on are told as all of them."""


def sentences_of(
    moment: Moment, decision: Decision, options: Sequence[Option], compared: Sequence[Comparison], races: int, suffix: str
) -> tuple[str, ...]:
    """What comes of the policy's call, what the other calls of this lap change, which options are its equals, which beat it."""
    own = compared[0]
    lines = [
        f"{moment.driver}, lap {moment.lap}{suffix}: the policy would {label(options[0])},"
        f" which ends in P{own.mean_position:.2f} on average over {races:,} futures."
    ]
    if len(decision.legal) == 1:
        lines.append("No other call is legal on this lap.")
    for o, c in zip(options, compared, strict=True):
        lines += [_change(o, c)] if o.offset == 0 and c is not own else []
        lines += [_later(c)] if o.call == 0 else []
    lines += _equals([label(o) for o, c in zip(options, compared, strict=True) if c.verdict == "equal"])
    lines += _better_later([(o, c) for o, c in zip(options, compared, strict=True) if c.verdict == "better" and o.offset > 0])
    open_ones = [label(o) for o, c in zip(options, compared, strict=True) if c.verdict == "not told apart" and o.offset > 0]
    if open_ones:
        lines.append(f"Not told apart from its call in {races:,} futures: {', '.join(open_ones)}.")
    return tuple(lines)


def _change(option: Option, c: Comparison) -> str:
    places, what = c.places, doing(option).capitalize()
    if c.verdict == "equal":
        return f"{what} is as good: {places.mean:+.2f} places [{places.low:+.2f}, {places.high:+.2f}]."
    if c.verdict == "not told apart":
        return f"{what} is not told apart from it: {places.mean:+.2f} places [{places.low:+.2f}, {places.high:+.2f}]."
    verb, amount = ("costs", places.mean) if c.verdict == "worse" else ("gains", -places.mean)
    low, high = sorted((abs(places.low), abs(places.high)))
    chances = f"better in {_percent(c.chance_gain)} of futures, worse in {_percent(c.chance_lose)}"
    return f"{what} {verb} {amount:.2f} places [{low:.2f}, {high:.2f}]: {chances}; {_time(c)}."


def _better_later(better: Sequence[tuple[Option, Comparison]]) -> list[str]:
    """Later stops that beat the policy's call: the best in full, the others by name."""
    if not better:
        return []
    best = min(better, key=lambda pair: pair[1].places.mean)
    others = ", ".join(label(option) for option, _ in better if option is not best[0])
    return [_change(*best), *([f"Better than its call, too: {others}."] if others else [])]


def _later(c: Comparison) -> str:
    """When the policy, left to it, boxes after staying out."""
    if c.stop_lap is None or c.stop_laps is None:
        return "Having stayed out, the policy boxes no more."
    often = "" if c.stops >= EVERY else f", in {_percent(c.stops)} of futures"
    first, last = c.stop_laps
    spread = f", eight times in ten on laps {first} to {last}" if first < last else ""
    return f"Having stayed out, the policy boxes on lap {c.stop_lap:.0f} on average{spread}{often}."


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def _time(c: Comparison) -> str:
    parts = ", ".join(f"{part:+.1f} s by {name}" for part, name in zip(c.parts, PART_NAMES, strict=True) if abs(part) >= SMALL_S)
    total = f"{abs(c.time_s):.1f} s {'slower' if c.time_s > 0 else 'quicker'} to the flag"
    return f"{total} ({parts})" if parts else total


def _equals(labels: Sequence[str]) -> list[str]:
    later = [text for text in labels if " in " in text]
    return [f"As good as its call, within what is measured: {', '.join(later)}."] if later else []
