"""The race trace: every car's gap to a car that laps at the winner's average, as strategists draw a race."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from rsrl.drawing.canvas import new_figure, save_figure
from rsrl.drawing.labels import spread
from rsrl.drawing.style import STATUS_COLOURS
from rsrl.drawing.teams import car_styles
from rsrl.season import GREEN, RED, SC, VSC

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_LAPS_BEHIND: Final = 1.6
"""A car further back than so many laps leaves the trace, with an arrow at its label, so that the scale serves the others."""

LABEL_GAP: Final = 0.026
"""Least distance of two driver codes, as a share of the height."""

STATUS_NAMES: Final = {VSC: "virtual safety car", SC: "safety car", RED: "red flag"}


@dataclass(frozen=True)
class TracePanel:
    """One race to trace.

    Attributes:
        name: what stands above the panel.
        drivers, teams: of each car.
        race_time_s: race time at the end of each lap, float64 [laps, cars], NaN where a car did not complete it.
        track_status: of each lap, [laps]; codes as in `rsrl.season`.
    """

    name: str
    drivers: Sequence[str]
    teams: Sequence[str]
    race_time_s: NDArray[np.float64]
    track_status: NDArray[np.int64]


def gaps_to_reference(race_time_s: NDArray[np.float64], track_status: NDArray[np.int64]) -> NDArray[np.float64]:
    """Gap of each car to the reference in s, [laps, cars], positive behind it.

    The reference drives every racing lap in the winner's average racing lap, and every other lap as the winner did. So it ends level with
    the winner, and behind a safety car the field closes up to the leader instead of falling away from a car that nothing slows.

    Args:
        race_time_s: float64 [laps, cars], NaN where a car did not complete the lap; somebody completes the last.
        track_status: [laps].
    """
    winner = race_time_s[:, int(np.nanargmin(race_time_s[-1]))]
    known = np.isfinite(winner)
    if not known.all():  # a lap missing in the source: shared out between its neighbours
        laps = np.arange(len(winner))
        winner = np.interp(laps, np.concatenate([[-1], laps[known]]), np.concatenate([[0.0], winner[known]]))
    lap_s = np.diff(winner, prepend=0.0)
    racing = np.asarray(track_status) == GREEN
    if racing.any():
        lap_s = np.where(racing, lap_s[racing].mean(), lap_s)
    gaps: NDArray[np.float64] = race_time_s - np.cumsum(lap_s)[:, None]
    return gaps


def plot_race_trace(panels: Sequence[TracePanel], title: str, path: Path) -> None:
    """Draw races side by side on one scale: a line for each car in its team's colour, bands where the race was neutralised.

    Raises:
        RsrlError: the file cannot be written.
    """
    figure, axes = new_figure(7.6 * len(panels), 6.6, len(panels), share_y=True)
    traces = [gaps_to_reference(panel.race_time_s, panel.track_status) for panel in panels]
    deepest = max(MOST_LAPS_BEHIND * float(np.nanmin(p.race_time_s[-1])) / len(p.race_time_s) for p in panels)
    bottom = min(max(float(np.nanmax(gaps)) for gaps in traces), deepest)
    top = min(float(np.nanmin(gaps)) for gaps in traces)
    room = 0.03 * (bottom - top)
    for axis, panel, gaps in zip(axes, panels, traces, strict=True):
        axis.set_ylim(bottom + room, top - room)
        axis.set_xlim(0.5, len(gaps) * 1.09)
        _draw_bands(axis, panel.track_status)
        _draw_cars(axis, panel, np.where(gaps > deepest, np.nan, gaps), gaps)
        axis.set_title(panel.name, loc="left", fontsize=10)
        axis.set_xlabel("lap")
    axes[0].set_ylabel("gap to the winner's average racing lap, s")
    save_figure(figure, title, path)


def _draw_bands(axes: "Axes", track_status: NDArray[np.int64]) -> None:
    named: set[int] = set()
    for lap, status in enumerate(track_status, 1):
        if int(status) in STATUS_COLOURS:
            label = STATUS_NAMES[int(status)] if int(status) not in named else None
            axes.axvspan(lap - 0.5, lap + 0.5, color=STATUS_COLOURS[int(status)], lw=0, zorder=0, label=label)
            named.add(int(status))
    if named:
        axes.legend(loc="lower left", frameon=True, edgecolor="none", fontsize=8)


def _draw_cars(axes: "Axes", panel: TracePanel, shown: NDArray[np.float64], gaps: NDArray[np.float64]) -> None:
    laps = np.arange(1, len(shown) + 1)
    labels: list[tuple[float, float, str, str]] = []  # last lap and gap, text, colour
    for i, style in enumerate(car_styles(list(panel.teams))):
        axes.plot(laps, shown[:, i], color=style.colour, ls=style.dash, lw=1.3)
        last = np.flatnonzero(np.isfinite(shown[:, i]))
        if not len(last):
            continue
        lap, gap = float(laps[last[-1]]), float(shown[last[-1], i])
        beyond = np.isfinite(gaps[last[-1] + 1 :, i]).any()
        retired = not beyond and lap < len(shown) - 2  # lapped cars end a lap or two early
        if retired:
            axes.plot(lap, gap, "x", color=style.colour, ms=6, mew=1.8)
        labels.append((lap, gap, panel.drivers[i] + (" \u2193" if beyond else ""), style.colour))
    _write_codes(axes, labels, len(shown))


def _write_codes(axes: "Axes", labels: list[tuple[float, float, str, str]], laps: int) -> None:
    """Codes of who reached the flag at the right, moved apart; of who retired where the line ends."""
    bottom, top = axes.get_ylim()
    gap_s = LABEL_GAP * (bottom - top)
    at_end = [label for label in labels if label[0] >= laps - 2 or label[2].endswith("\u2193")]
    places = spread([label[1] for label in at_end], gap_s, top + gap_s / 2, bottom - gap_s / 2)
    for (lap, gap, text, colour), place in zip(at_end, places, strict=True):
        axes.plot([lap, laps * 1.025], [gap, place], color=colour, lw=0.5, alpha=0.6)
        axes.text(laps * 1.03, place, text, fontsize=7.5, va="center", color=colour, fontweight="bold")
    taken: list[tuple[float, float]] = []
    for lap, gap, text, colour in sorted(label for label in labels if label not in at_end):
        y = gap + gap_s
        while any(abs(y - other) < gap_s and abs(lap - at) < 0.06 * laps for at, other in taken):
            y += gap_s
        taken.append((lap, y))
        axes.text(
            lap, y, text, fontsize=7, va="center", ha="center", color=colour, bbox={"fc": "white", "ec": "none", "pad": 0.6, "alpha": 0.7}
        )
