"""A model trained from several seeds, compared with strategists on the same races: each seed, and all of them together."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.evaluation.leaderboard import leaderboard, share_behind
from rsrl.evaluation.paired import RaceLog
from rsrl.results import Aggregate, Comparison, Row
from rsrl.statistics import mean_over_seeds, paired_difference, probability_of_improvement, stratified_bootstrap


@dataclass(frozen=True)
class SeedsResult:
    """Several training seeds of a model.

    Attributes:
        aggregate: all seeds together, and each other strategist against them.
        rows: seeds and other strategists, best mean position first; differences are against the mean of all seeds, those of a seed with
            an interval over races alone.
    """

    aggregate: Aggregate
    rows: tuple[Row, ...]


def over_seeds(models: Sequence[RaceLog], others: Sequence[RaceLog] = (), *, seed: int = 0) -> SeedsResult:
    """Compare all seeds of a model with other strategists. `seed` is that of the bootstrap.

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
    together = Aggregate(len(models), mean.value, mean.ci95, iqm.value, iqm.ci95, tuple(comparisons.values()))
    return SeedsResult(together, tuple(placed))


def _compared(log: RaceLog, positions: NDArray[np.float64], seed: int) -> Comparison:
    difference = mean_over_seeds(log.position[None] - positions)
    better = probability_of_improvement(-positions[:, None], -log.position[None, None], seed=seed)
    return Comparison(log.strategist, difference.value, difference.ci95, better.value, better.ci95)


def _against_all(row: Row, compared: Comparison | None, positions: NDArray[np.float64], names: list[str]) -> Row:
    """The row with its difference taken against the mean of the seeds."""
    if compared:
        return replace(row, difference=compared.difference, difference_ci95=compared.difference_ci95, p_better=compared.p_better)
    own = positions[names.index(row.strategist)]
    difference = paired_difference(own, positions.mean(axis=0))
    return replace(row, difference=difference.value, difference_ci95=difference.ci95, p_better=share_behind(own, positions))
