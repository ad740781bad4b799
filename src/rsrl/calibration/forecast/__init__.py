"""Forecast of a race before it is run, from earlier races, grid and qualifying: `form` (features), `places`, `pace` (and retirements)."""

from rsrl.calibration.forecast.form import FEATURES, FormBook, PastRace
from rsrl.calibration.forecast.pace import PaceForecast, PastLevel, forecast_base_lap, forecast_pace, pace_figures, retirement_factors
from rsrl.calibration.forecast.places import PlaceForecast, forecast_places

__all__ = [
    "FEATURES",
    "FormBook",
    "PaceForecast",
    "PastLevel",
    "PastRace",
    "PlaceForecast",
    "forecast_base_lap",
    "forecast_pace",
    "forecast_places",
    "pace_figures",
    "retirement_factors",
]
