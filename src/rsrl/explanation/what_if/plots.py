"""Pictures of a what-if: intervals by option, and where the time goes."""

from typing import TYPE_CHECKING

import numpy as np

from rsrl.errors import RsrlError
from rsrl.explanation.result import Explanation
from rsrl.explanation.what_if.comparison import PARTS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = {"better": "#1b7f5c", "worse": "#b5432a", "equal": "#3566a8", "not told apart": "#8a8a8a", "itself": "black"}
PART_COLOURS = dict(zip(PARTS, ("#b5432a", "#3566a8", "#d9a441", "#7a5aa6"), strict=True))
PART_TEXT = dict(zip(PARTS, ("pit stops", "tyres", "traffic", "safety cars"), strict=True))


def plot_what_if(explanation: Explanation, ax: "Axes | None" = None) -> "Axes":
    """A dot an option with its 95 % interval, against the policy's call at zero. Raises RsrlError for another method's explanation."""
    axes = _axes(explanation, ax)
    low, high = np.array(explanation.columns["low"]), np.array(explanation.columns["high"])
    for i, (value, verdict) in enumerate(zip(explanation.values, explanation.columns["verdict"], strict=True)):
        axes.errorbar(value, i, xerr=[[value - low[i]], [high[i] - value]], fmt="o", color=COLOURS[verdict], capsize=3, markersize=5)
    axes.axvline(0.0, color="black", linewidth=0.8)
    axes.set_xlabel("places against the policy's call (fewer is better), 95 % interval")
    return axes


def plot_time_split(explanation: Explanation, ax: "Axes | None" = None) -> "Axes":
    """Stacked bars of what the difference in race time is made of, and a mark at their sum. Raises RsrlError as `plot_what_if`."""
    axes = _axes(explanation, ax)
    rows = np.arange(len(explanation.labels))
    left, right = np.zeros(len(rows)), np.zeros(len(rows))
    for part in PARTS:
        values = np.array(explanation.columns[part])
        axes.barh(rows, values, left=np.where(values < 0, left, right), color=PART_COLOURS[part], label=PART_TEXT[part], height=0.6)
        left, right = left + np.minimum(values, 0), right + np.maximum(values, 0)
    axes.plot(explanation.columns["time_s"], rows, "D", color="black", markersize=4, label="in all")
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
