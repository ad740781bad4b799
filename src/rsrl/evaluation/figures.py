"""The paper's Figure 2: how often each strategist finishes where."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rsrl.drawing import SERIES_COLOURS, new_figure, save_figure
from rsrl.evaluation.paired import RaceLog
from rsrl.season import FIELD_SIZE


def plot_positions(logs: Sequence[RaceLog], title: str, path: Path) -> None:
    """Share of races by finishing position for each strategist, retirements included; dashed lines are the means.

    The axis has `FIELD_SIZE` places, and more where somebody finished further back.

    Raises:
        RsrlError: the file cannot be written.
    """
    from matplotlib.ticker import MaxNLocator

    figure, (axes,) = new_figure(8.0, 4.5)
    last = max(FIELD_SIZE, *(int(log.position.max()) for log in logs))
    places = np.arange(1, last + 1)
    for i, log in enumerate(logs):
        colour = SERIES_COLOURS[i % len(SERIES_COLOURS)]
        shares = 100 * np.bincount(log.position, minlength=last + 1)[1:] / len(log.position)
        model = i == 0
        label = f"{log.strategist}  P{log.position.mean():.2f}"
        axes.plot(places, shares, "-o", color=colour, lw=2.4 if model else 1.5, ms=5 if model else 3.5, label=label, zorder=10 - i)
        if model:
            axes.fill_between(places, shares, color=colour, alpha=0.12, lw=0)
        axes.axvline(log.position.mean(), color=colour, ls=(0, (4, 3)), lw=1.1, alpha=0.8)
    axes.set(xlim=(0.5, last + 0.5), xticks=places, xlabel="finishing position", ylabel="% of races")
    axes.set_ylim(bottom=0)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid(visible=False, axis="x")
    axes.legend(frameon=False, fontsize=9, title="mean position", title_fontsize=9, alignment="left")
    save_figure(figure, title, path)
