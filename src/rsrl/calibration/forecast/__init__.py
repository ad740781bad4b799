"""Forecast of a race before it is run, from earlier races, grid and qualifying: `form` (features), `pace` (pace, base lap, retirements)."""

from rsrl.calibration.forecast.form import FEATURES, FormBook, PastRace
from rsrl.calibration.forecast.pace import PaceForecast, PastLevel, forecast_base_lap, forecast_pace, pace_figures, retirement_factors

__all__ = [
    "FEATURES",
    "FormBook",
    "PaceForecast",
    "PastLevel",
    "PastRace",
    "forecast_base_lap",
    "forecast_pace",
    "pace_figures",
    "retirement_factors",
]
