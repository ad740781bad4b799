"""How good a prediction of one race was, and of many: errors, rank correlation, Brier score, intervals over races."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import spearmanr

from rsrl.results import MeanInterval
from rsrl.statistics import bootstrap_over_races

Array = NDArray[np.float64]

MEASURES: Final = (
    "mae_position", "mae_rank_classified", "spearman", "brier_points", "logloss_winner", "mae_green_lap_s", "mae_lap_position",
    "stops_mae", "first_stop_within_3", "sc_laps_predicted", "sc_laps_actual",
)  # fmt: skip
"""Figures of one race, in the order of the JSON; nan where a predictor says nothing about it."""

POINTS_PLACES: Final = 10
MIN_CHANCE: Final = 1e-3
"""A winner's probability is counted as no less than this: 1,000 simulated races cannot tell it from nothing."""
RESAMPLES: Final = 4000


@dataclass(frozen=True)
class Actual:
    """The official result of a race, by car in grid order, and what was counted on its laps."""

    positions: Array  # 1 .. starters
    classified: NDArray[np.bool_]
    stops: Array  # of cars that reached the flag; nan for the others
    first_stop: Array  # lap; nan for a car that made none
    lap_positions: Array  # [laps, cars] at the end of each lap, nan where the car did not complete it
    green_lap_s: Array  # [laps, cars] times of racing laps as `rsrl.laps.clean` keeps them; nan elsewhere
    sc_laps: int


@dataclass(frozen=True)
class Predicted:
    """What a predictor says of a race; None where it says nothing."""

    position: Array  # the place it names for each car: the median of its distribution, which the mean absolute error rewards
    mean_position: Array  # the order it expects, without ties
    p_points: Array
    p_win: Array
    lap_positions: Array | None = None  # [laps, cars] mean
    green_lap_s: Array | None = None  # [laps, cars] mean
    stops: Array | None = None  # mean of the races in which the car reached the flag
    first_stop: Array | None = None  # median lap
    sc_laps: float | None = None


def score(predicted: Predicted, actual: Actual) -> dict[str, float]:
    """`MEASURES` of one race. Errors in position are over every starter, ranks and stops over the classified."""
    known = actual.classified
    winner = int(np.argmin(actual.positions))
    nan = float("nan")
    scores = {
        "mae_position": _mae(predicted.position, actual.positions),
        "mae_rank_classified": _mae(ranks(predicted.mean_position[known]), ranks(actual.positions[known])),
        "spearman": float(spearmanr(predicted.mean_position, actual.positions).statistic),
        "brier_points": float(np.mean((predicted.p_points - (actual.positions <= POINTS_PLACES)) ** 2)),
        "logloss_winner": float(-np.log(max(float(predicted.p_win[winner]), MIN_CHANCE))),
        "mae_green_lap_s": _mae(predicted.green_lap_s, actual.green_lap_s),
        "mae_lap_position": _mae(predicted.lap_positions, actual.lap_positions),
        "stops_mae": nan if predicted.stops is None else _mae(predicted.stops[known], actual.stops[known]),
        "first_stop_within_3": nan,
        "sc_laps_predicted": nan if predicted.sc_laps is None else predicted.sc_laps,
        "sc_laps_actual": float(actual.sc_laps),
    }
    if predicted.first_stop is not None:
        made = np.isfinite(actual.first_stop) & np.isfinite(predicted.first_stop)
        if made.any():
            scores["first_stop_within_3"] = float(np.mean(np.abs(predicted.first_stop[made] - actual.first_stop[made]) <= 3))
    return {name: scores[name] for name in MEASURES}


def ranks(values: Array) -> Array:
    """Rank 1.. of each value, ties in order of appearance."""
    order = np.argsort(values, kind="stable")
    out = np.empty(len(values))
    out[order] = np.arange(1, len(values) + 1)
    return out


def _mae(predicted: Array | None, actual: Array) -> float:
    """Mean absolute error where both are known."""
    if predicted is None:
        return float("nan")
    error = np.abs(predicted - actual)
    return float(np.nanmean(error)) if np.isfinite(error).any() else float("nan")


def chances(mean_position: Array, sd: float, seed: int = 0, draws: int = 4000) -> tuple[Array, Array]:
    """P(points) and P(win) of a predictor that gives positions only: independent normal errors of `sd` about them, ranked."""
    rng = np.random.default_rng(seed)
    drawn = mean_position + rng.normal(0.0, sd, (draws, len(mean_position)))
    places = np.argsort(np.argsort(drawn, axis=1), axis=1)
    return np.asarray((places < POINTS_PLACES).mean(axis=0)), np.asarray((places == 0).mean(axis=0))


def average(races: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Mean of each measure over the races that have it."""
    out: dict[str, float] = {"races": float(len(races))}
    for name in MEASURES:
        values = np.array([r[name] for r in races])
        out[name] = float(np.nanmean(values)) if np.isfinite(values).any() else float("nan")
    return out


def differences(races: Sequence[Mapping[str, float]], base: Sequence[Mapping[str, float]], seed: int = 0) -> dict[str, MeanInterval]:
    """Each measure less the same race's of `base`: mean with the interval of a bootstrap over races."""
    out = {}
    for name in MEASURES[:-2]:
        gap = np.array([r[name] - b[name] for r, b in zip(races, base, strict=True)])
        if not np.isfinite(gap).any():
            continue
        low, high = bootstrap_over_races(gap[np.isfinite(gap)], seed=seed, resamples=RESAMPLES)
        out[name] = MeanInterval(float(np.nanmean(gap)), float(low), float(high))
    return out
