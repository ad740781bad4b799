"""Strategies as bars of stints, a few strategists a page."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from rsrl.drawing.canvas import new_figure, save_figure
from rsrl.drawing.style import COMPOUND_COLOURS, COMPOUND_INKS, INK
from rsrl.season import COMPOUND_NAMES, COMPOUNDS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

GROUPS_A_PAGE: Final = 6
"""Most strategists on a page."""

SHORTEST_LABELLED: Final = 0.05
"""A stint shorter than this share of the race has no room for its letter and laps."""


class StintBar(NamedTuple):
    """One strategy to draw.

    Attributes:
        label, note: left and right of the bar.
        compounds: codes of the stints, first to last; laps: at the end of which each stop is made.
        windows: first and last lap of each stop's pit window, None where there is none.
        group: whose strategy it is; bars of a group stand together under its name.
    """

    label: str
    note: str
    compounds: tuple[int, ...]
    laps: tuple[int, ...]
    windows: Sequence[tuple[int, int] | None]
    group: str = ""


def pages_of(bars: Sequence[StintBar]) -> list[list[StintBar]]:
    """The bars of at most GROUPS_A_PAGE groups a page, in their order; bars without groups are one page."""
    groups = list(dict.fromkeys(bar.group for bar in bars))
    pages = [set(groups[i : i + GROUPS_A_PAGE]) for i in range(0, len(groups), GROUPS_A_PAGE)]
    return [[bar for bar in bars if bar.group in page] for page in pages]


def plot_strategies(bars: Sequence[StintBar], laps: int, title: str, window_text: str, path: Path) -> list[Path]:
    """Draw strategies as stint bars, top to bottom; brackets are pit windows, what they mean is `window_text`.

    Returns:
        The pages written: `path`, then the same name with -2, -3 ... for further pages.

    Raises:
        RsrlError: a file cannot be written.
    """
    pages = pages_of(bars)
    paths = [path if i == 0 else path.with_stem(f"{path.stem}-{i + 1}") for i in range(len(pages))]
    for i, (page, place) in enumerate(zip(pages, paths, strict=True)):
        _plot_page(page, laps, title + (f" ({i + 1} of {len(pages)})" if len(pages) > 1 else ""), window_text, place)
    return paths


def _plot_page(bars: Sequence[StintBar], laps: int, title: str, window_text: str, path: Path) -> None:
    heights = _heights(bars)
    figure, (axes,) = new_figure(9.0, 1.4 + 0.36 * (max(heights) + 1))
    for y, bar in zip(heights, bars, strict=True):
        _draw_bar(axes, y, bar, laps)
    for group in dict.fromkeys(bar.group for bar in bars):
        if group:
            first = next(y for y, bar in zip(heights, bars, strict=True) if bar.group == group)
            axes.text(0, first - 0.62, group, fontsize=9.5, fontweight="bold", va="center")
    axes.set_yticks(heights, [bar.label for bar in bars], fontsize=9)
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False)
    axes.set(xlim=(0, laps), ylim=(max(heights) + 0.6, -1.0 if bars[0].group else -0.7), xlabel="lap")
    axes.set_xticks([*range(0, laps - 2, 5), laps])
    axes.spines["left"].set_visible(False)
    _legend(figure, window_text)
    save_figure(figure, title, path)


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
        axes.barh(y, end - begin, left=begin, height=0.62, color=COMPOUND_COLOURS[compound], edgecolor=INK, lw=0.8)
        if end - begin >= SHORTEST_LABELLED * laps:
            text = f"{COMPOUNDS[compound]} {end - begin}"
            axes.text((begin + end) / 2, y, text, ha="center", va="center", fontsize=8, color=COMPOUND_INKS[compound])
    for window in bar.windows:
        if window is not None:
            axes.plot(window, [y + 0.41, y + 0.41], color=INK, lw=1.3, marker="|", ms=5, clip_on=False)
    axes.text(laps + 0.01 * laps, y, bar.note, va="center", fontsize=9)


def _legend(figure: "Figure", window_text: str) -> None:
    from matplotlib.artist import Artist
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Artist] = [
        Patch(facecolor=colour, edgecolor=INK, label=f"{letter} {name}")
        for colour, letter, name in zip(COMPOUND_COLOURS, COMPOUNDS, COMPOUND_NAMES, strict=True)
    ]
    handles.append(Line2D([], [], color=INK, marker="|", label=window_text))
    figure.legend(handles=handles, ncols=4, loc="outside lower center", frameon=False, fontsize=9)
