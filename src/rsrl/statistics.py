"""Figures over several training runs, with honest intervals: after Agarwal et al. 2021, "Deep RL at the edge of the statistical precipice".

Scores are float64 [runs, tasks, races]: runs differ in their training seed, a task is a race weekend. The races of a task are the same
for every run and every strategist (common random numbers), so they are resampled once for all runs together: resampled run by run, what
a lucky set of races does to all runs alike would be taken for noise that averages out. Runs are resampled task by task.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from rsrl.errors import RsrlError

CONFIDENCE: Final = 0.95
RESAMPLES: Final = 2000
NUMBERS_AT_ONCE: Final = 4_000_000
"""Resampling weights held in memory at a time, 32 MB."""

Interval = tuple[float, float]
Floats = NDArray[np.float64]
Statistic = Callable[[Floats], Floats]
"""From run means [resamples, runs, tasks] to one number each, [resamples]."""


@dataclass(frozen=True)
class Estimate:
    """A figure with its 95 % interval."""

    value: float
    ci95: Interval


def interquartile_mean(values: ArrayLike, axis: int | tuple[int, ...] | None = None) -> Floats:
    """Mean of the middle half: a quarter of the values, rounded down, is left out at either end.

    Args:
        axis: one axis or several taken together; None for all.
    """
    array = np.asarray(values, np.float64)
    axes = tuple(range(array.ndim)) if axis is None else (axis,) if isinstance(axis, int) else axis
    kept = [a for a in range(array.ndim) if a not in {x % array.ndim for x in axes}]
    flat = np.sort(array.transpose(*kept, *axes).reshape(*(array.shape[a] for a in kept), -1), axis=-1)
    n = flat.shape[-1]
    cut = n // 4
    result: Floats = flat[..., cut : n - cut].mean(axis=-1)
    return result


def iqm_of_runs(means: Floats) -> Floats:
    """Interquartile mean over runs and tasks together, from run means [..., runs, tasks]."""
    return interquartile_mean(means, axis=(-2, -1))


def mean_of_runs(means: Floats) -> Floats:
    """Mean over runs and tasks, from run means [..., runs, tasks]."""
    result: Floats = means.mean(axis=(-2, -1))
    return result


def mean_interval(values: NDArray[np.float64] | NDArray[np.int64]) -> Interval:
    """95 % interval of the mean by Student's t; NaN for a single value, a point where all are alike."""
    n = len(values)
    if n < 2:
        return math.nan, math.nan
    mean, se = float(np.mean(values)), float(np.std(values, ddof=1)) / math.sqrt(n)
    half = float(stats.t.ppf(0.5 + CONFIDENCE / 2, n - 1)) * se
    return mean - half, mean + half


def stratified_bootstrap(scores: ArrayLike, statistic: Statistic = iqm_of_runs, *, seed: int = 0, resamples: int = RESAMPLES) -> Estimate:
    """A statistic of the runs' mean scores with its percentile bootstrap interval.

    Runs are drawn anew within each task, and races within each task, the same for all runs. A single run leaves races alone to vary.
    A percentile bootstrap of n runs is too narrow by about sqrt(1 - 1/n): with fewer than ten, `mean_over_seeds` tells more.

    Args:
        scores: [runs, tasks, races], or [runs, tasks] where races are not known.

    Raises:
        RsrlError: scores of another shape, none, or not finite.
    """
    array = _checked(scores)
    runs, tasks, races = array.shape
    rng = np.random.default_rng(seed)
    drawn = []
    for n in _blocks(resamples, races):
        means = np.empty((n, runs, tasks))
        for task in range(tasks):
            by_races = _race_weights(rng, n, races) @ array[:, task].T
            pick = rng.integers(runs, size=(n, runs))
            means[:, :, task] = np.take_along_axis(by_races, pick, axis=1)
        drawn.append(statistic(means))
    return Estimate(float(statistic(array.mean(axis=2)[None])[0]), _percentiles(np.concatenate(drawn)))


def probability_of_improvement(x: ArrayLike, y: ArrayLike, *, seed: int = 0, resamples: int = RESAMPLES) -> Estimate:
    """P(X > Y): the chance that a run of X beats a run of Y in the same race of a task, ties counting half; the mean over tasks.

    Every run of X meets every run of Y. The interval draws runs of either and races anew. Give positions with their sign changed.

    Args:
        x, y: [runs of X or Y, tasks, races]; a strategist that is not trained is one run.

    Raises:
        RsrlError: other shapes, or different tasks and races.
    """
    first, second = _checked(x), _checked(y)
    if first.shape[1:] != second.shape[1:]:
        raise RsrlError(f"scores of {first.shape[1:]} and {second.shape[1:]} (tasks, races) can't be paired; run both on the same races")
    rng = np.random.default_rng(seed)
    (runs_x, tasks, races), runs_y = first.shape, second.shape[0]
    drawn = []
    wins = [_wins(first[:, t], second[:, t]) for t in range(tasks)]
    for n in _blocks(resamples, races):
        total = np.zeros(n)
        for task in range(tasks):
            by_races = (_race_weights(rng, n, races) @ wins[task].reshape(-1, races).T).reshape(n, runs_x, runs_y)
            total += np.einsum("nij,ni,nj->n", by_races, _shares(rng, n, runs_x), _shares(rng, n, runs_y))
        drawn.append(total / tasks)
    value = float(np.mean([w.mean() for w in wins]))
    return Estimate(value, _percentiles(np.concatenate(drawn)))


def mean_over_seeds(values: ArrayLike) -> Estimate:
    """Mean of values [seeds, races], races the same for every seed, with an interval that holds the luck of both.

    The seeds' effects and the races' add up, so the variance of the mean is estimated from the mean squares of a two-way layout without
    repeats, (MS_seeds + MS_races - MS_rest) / (seeds x races), no component below zero; Student's t with Satterthwaite's degrees of
    freedom (Satterthwaite 1946). For paired differences give differences. With one seed the interval is that of the races alone.

    Raises:
        RsrlError: not such a table.
    """
    table = np.asarray(values, np.float64)
    if table.ndim != 2 or not table.size or not np.isfinite(table).all():
        raise RsrlError(f"values of shape {table.shape} are no table of seeds and races, or not all finite")
    seeds, races = table.shape
    mean = float(table.mean())
    if races < 2:
        return Estimate(mean, (math.nan, math.nan))
    of_races = seeds * float(np.var(table.mean(axis=0), ddof=1))
    if seeds == 1:
        return Estimate(mean, _student(mean, of_races / races, races - 1))
    of_seeds = races * float(np.var(table.mean(axis=1), ddof=1))
    rest_table = table - table.mean(axis=0) - table.mean(axis=1, keepdims=True) + mean
    rest_freedom = (seeds - 1) * (races - 1)
    rest = float((rest_table**2).sum()) / rest_freedom
    of_seeds, of_races = max(of_seeds, rest), max(of_races, rest)
    total = of_seeds + of_races - rest
    spread = of_seeds**2 / (seeds - 1) + of_races**2 / (races - 1) + rest**2 / rest_freedom
    return Estimate(mean, _student(mean, total / (seeds * races), total**2 / spread if spread > 0 else 1.0))


def _student(mean: float, variance: float, freedom: float) -> Interval:
    half = float(stats.t.ppf(0.5 + CONFIDENCE / 2, freedom)) * math.sqrt(variance)
    return mean - half, mean + half


def _checked(scores: ArrayLike) -> Floats:
    array = np.asarray(scores, np.float64)
    if array.ndim == 2:
        array = array[:, :, None]
    if array.ndim != 3 or not array.size or not np.isfinite(array).all():
        raise RsrlError(f"scores of shape {array.shape} are not [runs, tasks, races], or not all finite")
    return array


def _blocks(resamples: int, races: int) -> Iterator[int]:
    """Sizes of the parts that resampling is done in."""
    most = max(NUMBERS_AT_ONCE // races, 1)
    for begun in range(0, resamples, most):
        yield min(most, resamples - begun)


def _race_weights(rng: np.random.Generator, n: int, races: int) -> Floats:
    """Share of each race in `n` resamples of `races` with replacement, [n, races]."""
    return _shares(rng, n, races) if races > 1 else np.ones((n, 1))


def _shares(rng: np.random.Generator, n: int, of: int) -> Floats:
    """Share of each of so many things in `n` resamples of them, [n, of]."""
    result: Floats = rng.multinomial(of, np.full(of, 1 / of), size=n) / of
    return result


def _wins(x: Floats, y: Floats) -> Floats:
    """1 where a run of x [runs, races] beats a run of y, half for a tie, [runs of x, runs of y, races]."""
    a, b = x[:, None], y[None]
    result: Floats = (a > b) + 0.5 * (a == b)
    return result


def _percentiles(drawn: Floats) -> Interval:
    tail = (1 - CONFIDENCE) / 2
    low, high = np.quantile(drawn, (tail, 1 - tail))
    return float(low), float(high)
