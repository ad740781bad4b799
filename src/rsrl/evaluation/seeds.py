"""One kind of model trained from several seeds, against strategists on the same races: each seed, and what they say together."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.evaluation.leaderboard import Row, leaderboard
from rsrl.evaluation.paired import RaceLog
from rsrl.statistics import Interval, mean_interval, mean_over_seeds, probability_of_improvement, stratified_bootstrap


@dataclass(frozen=True)
class Comparison:
    """A strategist against all seeds on the same races.

    Attributes:
        difference: mean over seeds and races of its position less the model's; above zero the model finishes ahead.
        difference_ci95: interval of it that holds the luck of seeds and of races (`mean_over_seeds`).
        p_better: chance that the model of some seed finishes ahead of it in a race, a tie counting half.
        p_better_ci95: bootstrap over seeds and races.
    """

    strategist: str
    difference: float
    difference_ci95: Interval
    p_better: float
    p_better_ci95: Interval


@dataclass(frozen=True)
class SeedsResult:
    """What several seeds of a model came to.

    Attributes:
        seeds: how many.
        mean_position: over seeds and races; its interval by `mean_over_seeds`.
        iqm_position: interquartile mean over the seeds' mean positions; its interval by `stratified_bootstrap`.
        comparisons: one for each other strategist, in the order given.
        rows: seeds and other strategists, best mean position first; differences are against the mean of all seeds, those of a seed with
            an interval of the races alone.
    """

    seeds: int
    mean_position: float
    mean_position_ci95: Interval
    iqm_position: float
    iqm_position_ci95: Interval
    comparisons: tuple[Comparison, ...]
    rows: tuple[Row, ...]


def over_seeds(models: Sequence[RaceLog], others: Sequence[RaceLog] = (), *, seed: int = 0) -> SeedsResult:
    """Put the seeds of a model together. `seed` is that of the bootstrap.

    Raises:
        RsrlError: no models, or logs of different races.
    """
    if not models:
        raise RsrlError("there are no models to put together; give one at least")
    rows = leaderboard(models[0], (*models[1:], *others))
    if len({row.strategist for row in rows}) < len(rows):
        raise RsrlError("two strategists go by the same name; name them apart")
    positions = np.array([log.position for log in models], np.float64)
    mean = mean_over_seeds(positions)
    iqm = stratified_bootstrap(positions[:, None], seed=seed)
    comparisons = {log.strategist: _compared(log, positions, seed) for log in others}
    placed = [_against_all(row, comparisons.get(row.strategist), positions, [log.strategist for log in models]) for row in rows]
    return SeedsResult(len(models), mean.value, mean.ci95, iqm.value, iqm.ci95, tuple(comparisons.values()), tuple(placed))


def _compared(log: RaceLog, positions: NDArray[np.float64], seed: int) -> Comparison:
    difference = mean_over_seeds(log.position[None] - positions)
    better = probability_of_improvement(-positions[:, None], -log.position[None, None], seed=seed)
    return Comparison(log.strategist, difference.value, difference.ci95, better.value, better.ci95)


def _against_all(row: Row, compared: Comparison | None, positions: NDArray[np.float64], names: list[str]) -> Row:
    """The row with its difference taken against the mean of the seeds."""
    if compared:
        return replace(row, difference=compared.difference, difference_ci95=compared.difference_ci95, p_better=compared.p_better)
    own = positions[names.index(row.strategist)]
    difference = own - positions.mean(axis=0)
    better = (own[None] > positions).mean() + (own[None] == positions).mean() / 2
    return replace(row, difference=float(difference.mean()), difference_ci95=mean_interval(difference), p_better=float(better))
