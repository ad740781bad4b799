"""Passing at circuits without a dry race in the fitted seasons, from the seasons before them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import polars as pl

from rsrl.calibration.pooling.traffic import EarlierPassing
from rsrl.calibration.race.analysis import RaceAnalysis
from rsrl.calibration.seasons import analyse_seasons
from rsrl.laps import RACE, read_seasons, season_file
from rsrl.season import circuit_of, grand_prix_of

FIRST_SEASON: Final = 2018


def earlier_passing(laps_folder: Path, facts_folder: Path | None, fitted: Sequence[RaceAnalysis]) -> tuple[EarlierPassing, ...]:
    """Passing in the dry races before the fitted seasons, at circuits where these have none; seasons without a lap file are left out.

    Args:
        laps_folder: holds `laps_<season>.csv.gz`.
        facts_folder: as of `analyse_seasons`.
        fitted: analyses of the fitted seasons.

    Raises:
        RsrlError: a file that cannot be read.
    """
    known = {a.entry.circuit for a in fitted if a.dry}
    found = []
    for season in range(FIRST_SEASON, min(a.entry.season for a in fitted)):
        if season_file(laps_folder, season).is_file():
            table = _elsewhere(read_seasons(laps_folder, (season,)), known)
            analyses = analyse_seasons(table, facts_folder, workers=1)
            found += [EarlierPassing(season, a.entry.circuit, a.traffic.passing) for a in analyses if a.traffic is not None]
    return tuple(found)


def _elsewhere(table: pl.DataFrame, known: set[str]) -> pl.DataFrame:
    """The laps of the races at other circuits."""
    events = table.select(*RACE, "event").unique()
    unseen = [circuit_of(grand_prix_of(event), season) not in known for season, event in events.select("season", "event").iter_rows()]
    return table.join(events.filter(pl.Series(unseen, dtype=pl.Boolean)).select(*RACE), on=list(RACE), how="semi")
