"""Fits the figures of Grands Prix to real laps, with standard errors: race by race, pooled over tracks and seasons, written as records."""

from rsrl.calibration.analysis import RaceAnalysis, analyse_race
from rsrl.calibration.entry import RaceEntry, entry_from
from rsrl.calibration.history import Past, read_history
from rsrl.calibration.season_model import SeasonModel, figure_table, pool
from rsrl.calibration.seasons import analyse_seasons

__all__ = [
    "Past",
    "RaceAnalysis",
    "RaceEntry",
    "SeasonModel",
    "analyse_race",
    "analyse_seasons",
    "entry_from",
    "figure_table",
    "pool",
    "read_history",
]
