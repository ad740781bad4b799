"""Predictions without a simulator: finish where you start, and a median regression on what was known before the race."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.calibration import FormBook, forecast_places
from rsrl.evaluation.backtest.scores import Predicted, chances

Array = NDArray[np.float64]

SPREAD_WITHOUT_PAST: Final = 4.0


def grid_prediction(book: FormBook, index: int) -> Predicted:
    """Finish where you start; chances from how far earlier races ended from their grids."""
    moved = [race.facts.positions[d] - place for race, _ in book.training_races(index) for d, place in race.facts.grid.items()]
    coming = book.races[index].facts
    sd = float(np.std(moved)) if moved else SPREAD_WITHOUT_PAST
    return _with_chances(np.array([float(p) for p in coming.grid.values()]), sd, coming.laps)


def regression_prediction(book: FormBook, index: int) -> Predicted:
    """Median regression of the finishing position on all that the simulation's forecast knows, fitted to the earlier dry races."""
    forecast = forecast_places(book, index)
    if forecast is None:
        return grid_prediction(book, index)
    return _with_chances(forecast.places, forecast.sd, book.races[index].facts.laps)


def _with_chances(positions: Array, sd: float, laps: int) -> Predicted:
    p_points, p_win = chances(positions, sd)
    places = np.clip(np.rint(positions), 1, len(positions))
    return Predicted(places, positions, p_points, p_win, lap_positions=np.tile(positions, (laps, 1)))
