"""The paper's Figure 3, the commonest strategy of each strategist at four tracks, and strategies in words."""

from collections.abc import Sequence
from typing import Final

from rsrl.report.markup import Markup, element, together
from rsrl.report.numbers import MISSING, percent, whole
from rsrl.report.stints import Bar, stint_bars
from rsrl.report.svg import figure
from rsrl.report.tables import table
from rsrl.results import CommonStrategy, Participant, Race, Scored, TrackStrategy

FIGURE_TRACKS: Final = ("abu-dhabi", "japan", "mexico", "saudi-arabia")
"""The tracks of the paper's figure."""

SHOWN: Final = {"fixed": 2}
"""Strategies shown of a strategist, as in the paper; one of everybody else."""


def figure3(scored: Scored) -> Markup:
    """Stint bars for those of the paper's four tracks that the study has."""
    wanted = sorted((race for race in scored.races if race.track in FIGURE_TRACKS), key=lambda r: FIGURE_TRACKS.index(r.track))
    return together([_at(race, [row for row in scored.strategies if row.race == race.race]) for race in wanted])


def _at(race: Race, rows: Sequence[TrackStrategy]) -> Markup:
    names = dict.fromkeys(row.strategist for row in rows)
    shown = [row for name in names for row in [r for r in rows if r.strategist == name][: SHOWN.get(name, 1)]]
    if not shown:
        return Markup("")
    bars = [Bar(row.strategist, _note(row), row) for row in shown]
    told = "; ".join(f"{row.strategist} {row.text}, {_note(row)}" for row in shown)
    where = f"{race.event} {race.season}, {race.driver}"
    drawn = stint_bars(bars, race.laps, f"Commonest strategies at the {where}, {race.laps} laps: {told}.")
    note = "Right: share of the races finished in which these compounds were driven, and mean position in them."
    return figure(f"Commonest strategies: {where}", drawn, note)


def _note(row: CommonStrategy) -> str:
    return f"{percent(row.share)}, P{row.mean_position:.1f}"


def strategies_table(rows: Sequence[CommonStrategy]) -> Markup:
    """Strategies driven, of an evaluation, in words: a row for each strategist."""
    names = dict.fromkeys(row.strategist for row in rows)
    own = {name: [row for row in rows if row.strategist == name] for name in names}
    most = max(len(found) for found in own.values())
    cells = [[name, *(_words(row) for row in found), *[MISSING] * (most - len(found))] for name, found in own.items()]
    heads = ["strategist", "commonest", *("next" for _ in range(most - 1))]
    note = (
        "S-H@14: soft to the end of lap 14, then hard; laps are medians. "
        "Small: share of the races finished, mean position, and the laps of 80 % of the stops."
    )
    return table("Strategies driven most often", heads, cells, note=note, class_="grid")


def _words(row: CommonStrategy) -> Markup:
    windows = ", ".join(f"{low} to {high}" for low, high in row.windows)
    small = element("small", f"{_note(row)}{'; ' if windows else ''}{windows}")
    return together(row.plan, " ", small)


def told_races(strategists: Sequence[Participant]) -> str:
    """`960 races (planner 96)`."""
    most = max(row.races for row in strategists)
    fewer = [f"{row.strategist} {whole(row.races)}" for row in strategists if row.races != most]
    return f"{whole(most)} races" + (f" ({', '.join(fewer)})" if fewer else "")
