"""The paper's Figure 3: the commonest strategy of each strategist at a track, with its pit windows."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from rsrl.drawing import StintBar, plot_strategies
from rsrl.results import Scored, TrackStrategy

FIGURE_TRACKS: Final = ("abu-dhabi", "japan", "mexico", "saudi-arabia")
"""The tracks of the paper's figure."""

FIXED_SHOWN: Final = 2
"""Strategies shown of `fixed`, as in the paper; one of everybody else."""


def plot_figure3(scored: Scored, folder: Path) -> list[Path]:
    """Draw the tracks of the paper that the study has, a PNG each; `scored` is what `score` gives. Returns the files.

    Raises:
        RsrlError: a file cannot be written.
    """
    paths = []
    for race in scored.races:
        rows = [row for row in scored.strategies if row.race == race.race]
        if race.track not in FIGURE_TRACKS or not rows:
            continue
        path = folder / f"strategies-{race.race}.png"
        title = f"Commonest strategies: {race.event} {race.season}, {race.driver}"
        paths += plot_strategies(_bars(rows), race.laps, title, "10-90 % of stops", path)
    return paths


def _bars(rows: Sequence[TrackStrategy]) -> list[StintBar]:
    bars = []
    for name in dict.fromkeys(row.strategist for row in rows):
        own = [row for row in rows if row.strategist == name][: FIXED_SHOWN if name == "fixed" else 1]
        for row in own:
            note = f"{100 * row.share:.0f} %  P{row.mean_position:.1f}"
            bars.append(StintBar(row.text, note, row.compounds, row.laps, row.windows, group=name))
    return bars
