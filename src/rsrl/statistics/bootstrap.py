"""Bootstraps: over races, over training runs and races together, and the Bayesian one for the best of several.

Scores of several training runs are float64 [runs, tasks, races]: runs differ in their training seed, a task is a race weekend. The races of
a task are the same for every run and every strategist (common random numbers), so a resample holds the same races for all runs: resampled
run by run, the effect of a draw of races on all runs alike would count as noise that averages out over runs. Runs are resampled task by
task, after Agarwal et al. 2021, "Deep RL at the edge of the statistical precipice".
"""

from collections.abc import Callable, Iterator
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rsrl.errors import RsrlError
from rsrl.statistics.intervals import CONFIDENCE, Estimate, Floats, Interval

RESAMPLES: Final = 2000
NUMBERS_AT_ONCE: Final = 4_000_000
"""Resampling weights held in memory at a time, 32 MB."""

Statistic = Callable[[Floats], Floats]
"""From run means [..., runs, tasks] to one number each, [...]."""


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


def bootstrap_over_races(
    values: ArrayLike, statistic: Callable[[Floats], Any] = np.mean, *, seed: int = 0, resamples: int = RESAMPLES
) -> tuple[Floats, Floats]:
    """Percentile bootstrap interval of a statistic of races, drawn with replacement.

    Args:
        values: [races, ...]: whatever belongs to one race stays together, so laps and calls may depend on each other within a race.
        statistic: from values [races, ...] of a resample to a number or an array. A resample without a value (NaN) is left out.

    Returns:
        Lower and upper ends, of the statistic's shape.

    Raises:
        RsrlError: no races.
    """
    array = np.asarray(values, np.float64)
    if not array.ndim or not len(array):
        raise RsrlError("no races to resample")
    rng = np.random.default_rng(seed)
    races = rng.integers(0, len(array), (resamples, len(array)))
    low, high = np.nanquantile([statistic(array[drawn]) for drawn in races], _ENDS, axis=0)
    return low, high


def stratified_bootstrap(scores: ArrayLike, statistic: Statistic = iqm_of_runs, *, seed: int = 0, resamples: int = RESAMPLES) -> Estimate:
    """A statistic of the runs' mean scores with its percentile bootstrap interval.

    Runs are drawn anew within each task, and races within each task, the same for all runs. With a single run only the races vary.
    A percentile bootstrap of n runs is too narrow by about sqrt(1 - 1/n): with fewer than ten, prefer `mean_over_seeds`.

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


def probability_of_best(positions: NDArray[np.int64], *, seed: int = 0, resamples: int = RESAMPLES) -> Floats:
    """Chance of each of several to have the least mean, those that tie sharing it: a Bayesian bootstrap over races (Rubin 1981).

    Args:
        positions: int64 [compared, races], all on the same races. A resample weighs the races alike for all.
    """
    compared, races = positions.shape
    rng, scores = np.random.default_rng(seed), positions.T.astype(np.float32)  # half the memory, and finishing positions are small
    wins = np.zeros(compared)
    for n in _blocks(resamples, races):
        weights = rng.standard_exponential((n, races), dtype=np.float32)
        means = weights @ scores / weights.sum(axis=1, keepdims=True)
        best = means <= means.min(axis=1, keepdims=True) + 1e-6
        wins += (best / best.sum(axis=1, keepdims=True)).sum(axis=0)
    return wins / resamples


_ENDS: Final = ((1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2)


def _checked(scores: ArrayLike) -> Floats:
    array = np.asarray(scores, np.float64)
    if array.ndim == 2:
        array = array[:, :, None]
    if array.ndim != 3 or not array.size or not np.isfinite(array).all():
        raise RsrlError(f"scores of shape {array.shape} are not [runs, tasks, races], or not all finite")
    return array


def _blocks(resamples: int, races: int) -> Iterator[int]:
    """Sizes of the parts in which resampling is done."""
    most = max(NUMBERS_AT_ONCE // races, 1)
    for begun in range(0, resamples, most):
        yield min(most, resamples - begun)


def _race_weights(rng: np.random.Generator, n: int, races: int) -> Floats:
    """Share of each race in `n` resamples of `races` with replacement, [n, races]."""
    return _shares(rng, n, races) if races > 1 else np.ones((n, 1))


def _shares(rng: np.random.Generator, n: int, count: int) -> Floats:
    """Share of each of `count` items in `n` resamples with replacement, [n, count]."""
    result: Floats = rng.multinomial(count, np.full(count, 1 / count), size=n) / count
    return result


def _wins(x: Floats, y: Floats) -> Floats:
    """1 where a run of x [runs, races] beats a run of y, half for a tie, [runs of x, runs of y, races]."""
    a, b = x[:, None], y[None]
    result: Floats = (a > b) + 0.5 * (a == b)
    return result


def _percentiles(drawn: Floats) -> Interval:
    low, high = np.quantile(drawn, _ENDS)
    return float(low), float(high)
