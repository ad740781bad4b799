"""How well predicted plans agree with those that pit walls ran: scores by car, means with intervals over races."""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.calibration.choices import SEQUENCES
from rsrl.results import MeanInterval, PlanOverall
from rsrl.statistics import bootstrap_over_races

Array = NDArray[np.float64]

MEASURES: Final = (
    "start_match", "compounds_match", "sequence_match", "stops_match", "regret_places", "regret_s", "first_stop_error_laps",
    "first_stop_bias_laps", "choice_logloss", "choice_logloss_given_others",
)  # fmt: skip
MEDIANS: Final = ("regret_places", "regret_s")
"""Measures of which the median counts: one car far out of its place would make the mean."""

NAN: Final = float("nan")


class CarScores(NamedTuple):
    """`MEASURES` of one car; NaN where a predictor says nothing."""

    values: Array

    @classmethod
    def of(cls, ran: int, predicted: int | None, **measures: float) -> "CarScores":
        """Scores of a predicted sequence against the one that was run, with measures that are known besides."""
        found = dict.fromkeys(MEASURES, NAN)
        if predicted is not None:
            a, b = SEQUENCES[ran], SEQUENCES[predicted]
            found["start_match"], found["compounds_match"] = float(a[0] == b[0]), float(sorted(a) == sorted(b))
            found["sequence_match"], found["stops_match"] = float(a == b), float(len(a) == len(b))
        if "first_stop_off_laps" in measures:
            off = measures.pop("first_stop_off_laps")
            found["first_stop_error_laps"], found["first_stop_bias_laps"] = abs(off), off
        return cls(np.array([(found | measures)[name] for name in MEASURES]))


def summary(cars: Sequence[CarScores]) -> dict[str, float]:
    """Each measure of one race or of many: mean over cars, or median."""
    table = np.array([c.values for c in cars]).reshape(len(cars), len(MEASURES))
    return {name: float(value) for name, value in zip(MEASURES, _statistic(table[None]), strict=True)}


def overall(races: Sequence[Sequence[CarScores]], seed: int = 0) -> PlanOverall:
    """All cars of many races with intervals of a bootstrap over races."""
    table = _padded(races)
    scores = dict(zip(MEASURES, _statistic(table).tolist(), strict=True))
    said = [name for name, value in scores.items() if np.isfinite(value)]
    intervals = {}
    if said:
        at = [MEASURES.index(name) for name in said]
        low, high = bootstrap_over_races(table, lambda drawn: _statistic(drawn)[at], seed=seed)
        intervals = {n: MeanInterval(mean=scores[n], low=float(a), high=float(b)) for n, a, b in zip(said, low, high, strict=True)}
    return PlanOverall(**scores, races=len(races), cars=sum(len(r) for r in races), intervals=intervals)


def logloss_lead(races: Sequence[Sequence[CarScores]], baseline: Sequence[Sequence[CarScores]], seed: int = 0) -> MeanInterval | None:
    """Log-loss less the baseline's: mean over cars with the interval of a bootstrap over races; None without a race."""
    if not races:
        return None
    at = MEASURES.index("choice_logloss")
    gap = _padded(races)[:, :, at] - _padded(baseline)[:, :, at]
    low, high = bootstrap_over_races(gap, np.nanmean, seed=seed)
    return MeanInterval(mean=float(np.nanmean(gap)), low=float(low), high=float(high))


def _padded(races: Sequence[Sequence[CarScores]]) -> Array:
    """[races, most cars, measures], NaN where there is no car."""
    most = max((len(r) for r in races), default=0)
    table = np.full((len(races), max(most, 1), len(MEASURES)), np.nan)
    for i, cars in enumerate(races):
        for j, car in enumerate(cars):
            table[i, j] = car.values
    return table


def _statistic(table: Array) -> Array:
    """Means and medians over races and cars, [measures]; NaN for a measure that nobody has."""
    flat = table.reshape(-1, len(MEASURES))
    found = np.full(len(MEASURES), np.nan)
    for i, name in enumerate(MEASURES):
        known = flat[np.isfinite(flat[:, i]), i]
        if len(known):
            found[i] = np.median(known) if name in MEDIANS else known.mean()
    return found
