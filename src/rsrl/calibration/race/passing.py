"""Likelihood of passes by threshold and scale; the log-likelihoods of races add up.

As in the simulator, a follower that its own lap would bring level passes with probability logistic((advantage - threshold) / scale), and
is held otherwise. The lap a held car would have driven is not observed, so the noise of both cars is integrated out. An attempt starts
from the following gap; it counts as a pass if the follower ends the lap ahead, which the time lost by the passed car helps.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from rsrl.calibration.literature import PASS_LOSS
from rsrl.calibration.race.design import Array

THRESHOLDS_S: Final = tuple(float(v) for v in np.arange(-0.5, 5.01, 0.125))
SCALES_S: Final = (0.15, 0.2, 0.27, 0.36, 0.48, 0.64, 0.85, 1.1)
USUAL: Final = (1.2, 0.44)  # threshold and scale of a usual track, for the noise expected in a pass
PASSED_S: Final = 0.7  # lost by a passed car: first guess, near the pooled result
SURPRISE: Final = 2e-3  # probability of either outcome outside the model: mistakes, team orders
NODES: Final = 21


@dataclass(frozen=True)
class PassingGrid:
    """Log-likelihood of one race's pairs for each of `THRESHOLDS_S` (rows) and `SCALES_S` (columns)."""

    pairs: int
    passes: int
    log_likelihood: tuple[tuple[float, ...], ...]


def passing_grid(gap: Array, advantage: Array, passed: Array, held_s: float, noise_s: float) -> PassingGrid:
    """Likelihood of who passed.

    Args:
        gap: s behind at the start of the lap.
        advantage: s a lap, of the follower, expected: dirty air and DRS counted.
        passed: whether it ended ahead.
        held_s: following gap.
        noise_s: lap noise of each car.
    """
    raw, reaches, weights = _noisy_advantage(gap, advantage, held_s, noise_s)
    rows = []
    for threshold in THRESHOLDS_S:
        row = []
        for scale in SCALES_S:
            chance = (reaches / (1 + np.exp(-np.clip((raw - threshold) / scale, -40, 40)))) @ weights
            chance = SURPRISE + (1 - 2 * SURPRISE) * chance
            row.append(float(np.sum(np.where(passed, np.log(chance), np.log1p(-chance)))))
        rows.append(tuple(row))
    return PassingGrid(len(gap), int(np.sum(passed)), tuple(rows))


def noise_of_passes(gap: Array, advantage: Array, held_s: float, noise_s: float) -> Array:
    """Expected noise (both cars together, s) in the advantage of each pair that passed, on a usual track."""
    raw, reaches, weights = _noisy_advantage(gap, advantage, held_s, noise_s)
    chance = reaches / (1 + np.exp(-np.clip((raw - USUAL[0]) / USUAL[1], -40, 40))) * weights
    total = chance.sum(axis=1)
    return np.asarray(np.where(total > 1e-9, (chance * (raw - advantage[:, None])).sum(axis=1) / np.maximum(total, 1e-9), 0.0))


def _noisy_advantage(gap: Array, advantage: Array, held_s: float, noise_s: float) -> tuple[Array, Array, Array]:
    """Advantage with both cars' noise at quadrature nodes, whether that brings the cars level, and the nodes' weights."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(NODES)
    raw = advantage[:, None] + np.sqrt(2.0) * noise_s * nodes[None, :]
    return raw, gap[:, None] - raw < min(held_s, PASSED_S - PASS_LOSS.value), weights / weights.sum()
