"""Figures of an evaluation, drawn off screen: finishing positions by strategist, and strategies as stint bars."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from rsrl.errors import RsrlError
from rsrl.evaluation.paired import RaceLog
from rsrl.season import COMPOUND_NAMES, FIELD_SIZE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COMPOUND_COLOURS: Final = ("#da291c", "#ffd12e", "#f4f4f4")
"""Pirelli's red, yellow and white."""

LINE_COLOURS: Final = ("#0b5fa5", "#e07b00", "#3a9a5b", "#a2418c", "#6b6b6b", "#8a5a2b", "#17a2b8")
EDGE: Final = "#333333"
DPI: Final = 150


class StintBar(NamedTuple):
    """One strategy to draw: `windows` are the first and last lap of each stop's pit window."""

    label: str
    note: str
    compounds: tuple[int, ...]
    laps: tuple[int, ...]
    windows: Sequence[tuple[int, int] | None]
    group: str = ""


def plot_positions(logs: Sequence[RaceLog], title: str, path: Path) -> None:
    """The paper's Figure 2: density of finishing positions by strategist, retirements included; dashed lines are the means.

    Raises:
        RsrlError: the file cannot be written.
    """
    from matplotlib.ticker import MaxNLocator

    figure, axes = _blank(8.0, 4.5)
    places = np.arange(1, FIELD_SIZE + 1)
    for i, log in enumerate(logs):
        colour = LINE_COLOURS[i % len(LINE_COLOURS)]
        shares = 100 * np.bincount(log.position, minlength=FIELD_SIZE + 1)[1:] / len(log.position)
        model = i == 0
        label = f"{log.strategist}  P{log.position.mean():.2f}"
        axes.plot(places, shares, "-o", color=colour, lw=2.4 if model else 1.5, ms=5 if model else 3.5, label=label, zorder=10 - i)
        if model:
            axes.fill_between(places, shares, color=colour, alpha=0.12, lw=0)
        axes.axvline(log.position.mean(), color=colour, ls=(0, (4, 3)), lw=1.1, alpha=0.8)
    axes.set(xlim=(0.5, FIELD_SIZE + 0.5), xticks=places, xlabel="finishing position", ylabel="% of races")
    axes.set_ylim(bottom=0)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid(axis="y", color="#e3e3e3", lw=0.8)
    axes.legend(frameon=False, fontsize=9, title="mean position", title_fontsize=9, alignment="left")
    _save(figure, axes, title, path)


def plot_strategies(bars: Sequence[StintBar], laps: int, title: str, window_text: str, path: Path) -> None:
    """Strategies as stint bars, top to bottom; black brackets are pit windows, what they mean is `window_text`.

    Raises:
        RsrlError: the file cannot be written.
    """
    heights = _heights(bars)
    figure, axes = _blank(9.0, 1.5 + 0.42 * (max(heights) + 1))
    for y, bar in zip(heights, bars, strict=True):
        _draw_bar(axes, y, bar, laps)
    for group in dict.fromkeys(bar.group for bar in bars):
        if group:
            first = next(y for y, bar in zip(heights, bars, strict=True) if bar.group == group)
            axes.text(0, first - 0.62, group, fontsize=9.5, fontweight="bold", va="center")
    axes.set_yticks(heights, [bar.label for bar in bars], fontsize=9)
    axes.tick_params(axis="y", length=0)
    axes.set(xlim=(0, laps), ylim=(max(heights) + 0.6, -1.0 if bars[0].group else -0.7), xlabel="lap")
    axes.set_xticks([*range(0, laps - 2, 5), laps])
    axes.spines["left"].set_visible(False)
    _compound_legend(figure, window_text)
    _save(figure, axes, title, path)


def _heights(bars: Sequence[StintBar]) -> list[float]:
    """Where each bar stands: one below the other, with room for the name of each group."""
    heights: list[float] = []
    y, group = 0.0, bars[0].group
    for bar in bars:
        if bar.group != group:
            y, group = y + 0.75, bar.group
        heights.append(y)
        y += 1.0
    return heights


def _draw_bar(axes: "Axes", y: float, bar: StintBar, laps: int) -> None:
    edges = (0, *bar.laps, laps)
    for compound, begin, end in zip(bar.compounds, edges, edges[1:], strict=False):
        axes.barh(y, end - begin, left=begin, height=0.6, color=COMPOUND_COLOURS[compound], edgecolor=EDGE, lw=0.8)
        ink = "white" if compound == 0 else EDGE
        axes.text((begin + end) / 2, y, str(end - begin), ha="center", va="center", fontsize=8, color=ink)
    for lap, window in zip(bar.laps, bar.windows, strict=True):
        axes.plot([lap, lap], [y - 0.3, y + 0.3], color="black", lw=2)
        if window is not None:
            axes.plot(window, [y + 0.36, y + 0.36], color="black", lw=1.3, marker="|", ms=5, clip_on=False)
    axes.text(laps + 0.6, y, bar.note, va="center", fontsize=9)


def _compound_legend(figure: "Figure", window_text: str) -> None:
    from matplotlib.artist import Artist
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Artist] = [
        Patch(facecolor=colour, edgecolor=EDGE, label=name) for colour, name in zip(COMPOUND_COLOURS, COMPOUND_NAMES, strict=True)
    ]
    handles.append(Line2D([], [], color="black", marker="|", label=window_text))
    figure.legend(handles=handles, ncols=4, loc="outside lower center", frameon=False, fontsize=9)


def _blank(width: float, height: float) -> "tuple[Figure, Axes]":
    """A figure without a window system."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    return figure, axes


def _save(figure: "Figure", axes: "Axes", title: str, path: Path) -> None:
    axes.set_title(title, loc="left", fontsize=11, fontweight="bold")
    try:
        figure.savefig(path, dpi=DPI)
    except OSError as error:
        raise RsrlError(f"{path}: cannot be written ({error.strerror}); choose another folder with --out") from None
