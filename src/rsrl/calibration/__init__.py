"""Fits the figures of Grands Prix to real laps, with standard errors: race by race, pooled over tracks and seasons, written as records."""

from rsrl.calibration.calibrate import Calibration, Diagnosis, calibrate
from rsrl.calibration.choices import ChoiceFits, choices_in
from rsrl.calibration.earlier_passing import earlier_passing
from rsrl.calibration.entry import RaceEntry, entry_from
from rsrl.calibration.forecast.form import FEATURES, FormBook, PastRace
from rsrl.calibration.forecast.pace import PaceForecast, PastLevel, forecast_base_lap, forecast_pace, pace_figures, retirement_factors
from rsrl.calibration.forecast.places import PlaceForecast, forecast_places
from rsrl.calibration.history import EarlierRace, read_history
from rsrl.calibration.pooling.lap_figures import lap_figures_of
from rsrl.calibration.pooling.season_model import SeasonModel, figure_table, pool
from rsrl.calibration.pooling.traffic import EarlierPassing
from rsrl.calibration.race.analysis import RaceAnalysis, analyse_race
from rsrl.calibration.race_facts import RaceFacts, race_facts
from rsrl.calibration.seasons import analyse_seasons

__all__ = [
    "FEATURES",
    "Calibration",
    "ChoiceFits",
    "Diagnosis",
    "EarlierPassing",
    "EarlierRace",
    "FormBook",
    "PaceForecast",
    "PastLevel",
    "PastRace",
    "PlaceForecast",
    "RaceAnalysis",
    "RaceEntry",
    "RaceFacts",
    "SeasonModel",
    "analyse_race",
    "analyse_seasons",
    "calibrate",
    "choices_in",
    "earlier_passing",
    "entry_from",
    "figure_table",
    "forecast_base_lap",
    "forecast_pace",
    "forecast_places",
    "lap_figures_of",
    "pace_figures",
    "pool",
    "race_facts",
    "read_history",
    "retirement_factors",
]
