"""The picture of an audit: how often first stops are matched, and what the calls of each team lost."""

from pathlib import Path
from typing import TYPE_CHECKING, Final

from rsrl.audit.car import TEAM
from rsrl.drawing import SERIES_COLOURS, new_figure, save_figure
from rsrl.results import AuditMean, SeasonAudit, known

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ROW_IN: Final = 0.34


def plot_audit(result: SeasonAudit, path: Path) -> None:
    """Draw an audit as PNG. Raises RsrlError where the file cannot be written."""
    teams = [(one.name, one.against_policy[TEAM]) for one in result.by_team if TEAM in one.against_policy]
    figure, (left, right) = new_figure(11.0, max(3.2, ROW_IN * len(teams) + 1.4), 2)
    shares = [(name, result.overall.within_two_laps[name]) for name in result.callers]
    for axes, rows, label in (
        (left, shares, "share of first stops matched within two laps"),
        (right, teams, "places a car and race lost to the policy's calls (below zero: gained)"),
    ):
        for y, (_, mean) in enumerate(rows):
            _draw(axes, y, mean)
        axes.set_yticks(range(len(rows)), [name for name, _ in rows])
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.set_xlabel(f"{label}, 95 % over races", fontsize=8)
    left.set_xlim(0, 1)
    right.axvline(0.0, color=SERIES_COLOURS[2], lw=0.8)
    save_figure(figure, f"{result.season}, {result.overall.races} dry races, called by {result.model}", path)


def _draw(axes: "Axes", y: int, one: AuditMean) -> None:
    """A mean with its interval, where there is one."""
    if one.mean is None:
        return
    low, high = known(one.ci95) or (one.mean, one.mean)
    axes.plot([low, high], [y, y], color=SERIES_COLOURS[0], lw=1.4)
    axes.plot([one.mean], [y], "o", color=SERIES_COLOURS[0], ms=5)
