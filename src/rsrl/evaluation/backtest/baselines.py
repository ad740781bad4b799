"""Predictions without a simulator: finish where you start, and a ridge regression on what was known before the race."""

from typing import Final

import numpy as np
from numpy.typing import NDArray
from sklearn.linear_model import Ridge
from sklearn.preprocessing import StandardScaler

from rsrl.calibration import FEATURES, FormBook
from rsrl.evaluation.backtest.scores import Predicted, chances

Array = NDArray[np.float64]

RIDGE_ALPHA: Final = 20.0
SPREAD_WITHOUT_PAST: Final = 4.0


def training_table(book: FormBook, index: int) -> tuple[Array, Array]:
    """Features [rows, features] and finishing positions of every starter of the dry races before race `index`."""
    rows: list[Array] = []
    positions: list[float] = []
    for race, features in book.training_races(index):
        rows += [features[d] for d in race.facts.grid]
        positions += [float(race.facts.positions[d]) for d in race.facts.grid]
    return np.array(rows).reshape(-1, len(FEATURES)), np.array(positions)


def grid_prediction(book: FormBook, index: int) -> Predicted:
    """Finish where you start; chances from how far earlier races ended from their grids."""
    x, y = training_table(book, index)
    coming = book.races[index].facts
    sd = float(np.std(y - x[:, FEATURES.index("grid")])) if len(y) else SPREAD_WITHOUT_PAST
    return _with_chances(np.array([float(p) for p in coming.grid.values()]), sd, coming.laps)


def regression_prediction(book: FormBook, index: int) -> Predicted:
    """Ridge regression of the finishing position on `FEATURES`, fitted to the earlier dry races alone."""
    x, y = training_table(book, index)
    if not len(y):
        return grid_prediction(book, index)
    scaler = StandardScaler().fit(x)
    model = Ridge(alpha=RIDGE_ALPHA).fit(scaler.transform(x), y)
    coming = book.races[index].facts
    now = book.features(index)
    predicted = model.predict(scaler.transform(np.array([now[d] for d in coming.grid])))
    sd = float(np.std(y - model.predict(scaler.transform(x))))
    return _with_chances(np.asarray(predicted, dtype=np.float64), sd, coming.laps)


def _with_chances(positions: Array, sd: float, laps: int) -> Predicted:
    p_points, p_win = chances(positions, sd)
    return Predicted(positions, p_points, p_win, lap_positions=np.tile(positions, (laps, 1)))
