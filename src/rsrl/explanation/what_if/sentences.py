"""A what-if in words and in pictures. Every number of a sentence stands in the table as well."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from rsrl.drawing import PART_COLOURS, VERDICT_COLOURS
from rsrl.errors import RsrlError
from rsrl.explanation.moment import Moment
from rsrl.explanation.result import Decision, Explanation
from rsrl.explanation.what_if.comparison import PARTS, Comparison
from rsrl.explanation.what_if.options import doing, label
from rsrl.rollouts import Option

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PART_NAMES: Final = ("pit stops", "tyres", "traffic", "safety cars")
"""Of `PARTS`, as people say them."""

SMALL_S: Final = 0.05
"""Smaller parts of a time difference are left out of a sentence."""

EVERY: Final = 0.995
"""A share of futures from here on counts as all of them."""


def sentences_of(
    moment: Moment, decision: Decision, options: Sequence[Option], compared: Sequence[Comparison], races: int, suffix: str
) -> tuple[str, ...]:
    """What the policy's call leads to, what the other calls of this lap change, and which later stops equal or beat the call."""
    own = compared[0]
    pairs = list(zip(options, compared, strict=True))
    lines = [
        f"{moment.driver}, lap {moment.lap}{suffix}: the policy's call is to {label(options[0])};"
        f" mean finishing position {own.mean_position:.2f} over {races:,} simulated futures."
    ]
    if len(decision.legal) == 1:
        lines.append("No other call is legal on this lap.")
    for o, c in pairs:
        lines += [_change(o, c)] if o.offset == 0 and c is not own else []
        lines += [_later(c)] if o.call == 0 else []

    def later(verdict: str) -> list[tuple[Option, Comparison]]:
        return [(o, c) for o, c in pairs if c.verdict == verdict and o.offset > 0]

    lines += _listed("As good as the call", later("equal"))
    lines += _better_later(later("better"))
    lines += _listed(f"Undecided after {races:,} futures", later("undecided"))
    return tuple(lines)


def _listed(head: str, pairs: Sequence[tuple[Option, Comparison]]) -> list[str]:
    return [f"{head}: {', '.join(label(option) for option, _ in pairs)}."] if pairs else []


def _change(option: Option, c: Comparison) -> str:
    places, what = c.places, doing(option).capitalize()
    if c.verdict in ("equal", "undecided"):
        said = "is as good as the call" if c.verdict == "equal" else "may be better or worse than the call"
        return f"{what} {said}: {places.mean:+.2f} places [{places.low:+.2f}, {places.high:+.2f}]."
    verb, amount = ("costs", places.mean) if c.verdict == "worse" else ("gains", -places.mean)
    low, high = sorted((abs(places.low), abs(places.high)))
    chances = f"better in {_percent(c.chance_gain)} of the futures, worse in {_percent(c.chance_lose)}"
    return f"{what} {verb} {amount:.2f} places [{low:.2f}, {high:.2f}]: {chances}; {_time(c)}."


def _better_later(better: Sequence[tuple[Option, Comparison]]) -> list[str]:
    """Later stops that beat the policy's call: the best in full, the others by name."""
    if not better:
        return []
    best = min(better, key=lambda pair: pair[1].places.mean)
    return [_change(*best), *_listed("Also better than the call", [pair for pair in better if pair is not best])]


def _later(c: Comparison) -> str:
    """When the policy boxes if the car stays out now."""
    if c.stop_lap is None or c.stop_laps is None:
        return "After staying out, the policy does not box again."
    often = "" if c.stops >= EVERY else f", in {_percent(c.stops)} of the futures"
    first, last = c.stop_laps
    spread = f" (80 % of these stops on laps {first} to {last})" if first < last else ""
    return f"After staying out, the policy next boxes on lap {c.stop_lap:.0f} on average{spread}{often}."


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def _time(c: Comparison) -> str:
    parts = ", ".join(f"{name} {part:+.1f} s" for part, name in zip(c.parts, PART_NAMES, strict=True) if abs(part) >= SMALL_S)
    total = f"{abs(c.time_s):.1f} s {'slower' if c.time_s > 0 else 'faster'} to the flag"
    return f"{total} ({parts})" if parts else total


def plot_what_if(explanation: Explanation, ax: "Axes | None" = None) -> "Axes":
    """Each option as a dot with its 95 % interval, the policy's call at zero. Raises RsrlError if the explanation is not a what-if."""
    axes = _axes(explanation, ax)
    low, high = np.array(explanation.columns["low"]), np.array(explanation.columns["high"])
    for i, (value, verdict) in enumerate(zip(explanation.values, explanation.columns["verdict"], strict=True)):
        axes.errorbar(
            value, i, xerr=[[value - low[i]], [high[i] - value]], fmt="o", color=VERDICT_COLOURS[verdict], capsize=3, markersize=5
        )
    axes.axvline(0.0, color="black", linewidth=0.8)
    axes.set_xlabel("places against the policy's call (fewer is better), 95 % interval")
    return axes


def plot_time_split(explanation: Explanation, ax: "Axes | None" = None) -> "Axes":
    """The parts of the difference in race time as stacked bars, and their sum as a mark. Raises RsrlError as `plot_what_if`."""
    axes = _axes(explanation, ax)
    rows = np.arange(len(explanation.labels))
    left, right = np.zeros(len(rows)), np.zeros(len(rows))
    for part, name, colour in zip(PARTS, PART_NAMES, PART_COLOURS, strict=True):
        values = np.array(explanation.columns[part])
        axes.barh(rows, values, left=np.where(values < 0, left, right), color=colour, label=name, height=0.6)
        left, right = left + np.minimum(values, 0), right + np.maximum(values, 0)
    axes.plot(explanation.columns["time_s"], rows, "D", color="black", markersize=4, label="total")
    axes.axvline(0.0, color="black", linewidth=0.8)
    axes.set_xlabel("s to the flag against the policy's call")
    axes.legend(fontsize=8)
    return axes


def _axes(explanation: Explanation, ax: "Axes | None") -> "Axes":
    if explanation.method != "what-if":
        raise RsrlError(f"plot: this is an explanation by {explanation.method}, not a what-if")
    import matplotlib.pyplot as plt

    rows = len(explanation.labels)
    axes = plt.subplots(figsize=(7, 0.35 * rows + 1.2), layout="constrained")[1] if ax is None else ax
    axes.set_yticks(range(rows), list(explanation.labels))
    axes.set_ylim(rows - 0.5, -0.5)
    axes.set_title(explanation.question, loc="left", fontsize=9)
    return axes
