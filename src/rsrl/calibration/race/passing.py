"""Likelihood of passes by threshold, scale and slope; the log-likelihoods of races add up.

As in the simulator, a follower that its own lap would bring level passes with probability logistic((advantage - needed) / scale), and is
held otherwise; needed = threshold + slope x (gap at the start of the lap - following gap). The slope is what the data ask for most: of
cars that start a lap within a quarter of a second of another half are past at its end, of those within 0.75 to 1 s one in twenty. The
lap a held car would have driven is not observed, so the noise of both cars is integrated out. An attempt counts as a pass if the follower
ends the lap ahead, which the time lost by the passed car helps.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from rsrl.calibration.literature import PASS_LOSS
from rsrl.calibration.race.design import Array

THRESHOLDS_S: Final = tuple(float(v) for v in np.arange(-0.5, 5.01, 0.125))
SCALES_S: Final = (0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.6, 0.75, 1.0)
SLOPES: Final = (0.5, 0.8, 1.1, 1.3, 1.5, 1.7, 2.0, 2.4, 3.0)  # s of advantage per s of gap
USUAL: Final = (1.35, 0.4, 1.4)  # threshold, scale and slope of a usual track, for the noise expected in a pass
PASSED_S: Final = 0.7  # lost by a passed car: first guess, near the pooled result
SURPRISE: Final = 2e-3  # probability of either outcome outside the model: mistakes, team orders
NODES: Final = 15


@dataclass(frozen=True)
class PassingGrid:
    """Log-likelihood of one race's pairs for each of `THRESHOLDS_S`, `SCALES_S` and `SLOPES`, nested in that order."""

    pairs: int
    passes: int
    log_likelihood: tuple[tuple[tuple[float, ...], ...], ...]


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
    beyond = [raw - slope * (gap - held_s)[:, None] for slope in SLOPES]

    def log_likelihood(threshold: float, scale: float, slope: int) -> float:
        chance = SURPRISE + (1 - 2 * SURPRISE) * ((reaches * _logistic((beyond[slope] - threshold) / scale)) @ weights)
        return float(np.sum(np.log(np.where(passed, chance, 1 - chance))))

    slopes = range(len(SLOPES))
    likely = tuple(tuple(tuple(log_likelihood(th, scale, i) for i in slopes) for scale in SCALES_S) for th in THRESHOLDS_S)
    return PassingGrid(len(gap), int(np.sum(passed)), likely)


def noise_of_passes(gap: Array, advantage: Array, held_s: float, noise_s: float) -> Array:
    """Expected noise (both cars together, s) in the advantage of each pair that passed, on a usual track."""
    raw, reaches, weights = _noisy_advantage(gap, advantage, held_s, noise_s)
    threshold, scale, slope = USUAL
    chance = reaches * _logistic((raw - threshold - slope * (gap - held_s)[:, None]) / scale) * weights
    total = chance.sum(axis=1)
    return np.asarray(np.where(total > 1e-9, (chance * (raw - advantage[:, None])).sum(axis=1) / np.maximum(total, 1e-9), 0.0))


def _logistic(x: Array) -> Array:
    return np.asarray(1 / (1 + np.exp(-np.clip(x, -40, 40))))


def _noisy_advantage(gap: Array, advantage: Array, held_s: float, noise_s: float) -> tuple[Array, Array, Array]:
    """Advantage with both cars' noise at quadrature nodes, whether that brings the cars level, and the nodes' weights."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(NODES)
    raw = advantage[:, None] + np.sqrt(2.0) * noise_s * nodes[None, :]
    return raw, gap[:, None] - raw < min(held_s, PASSED_S - PASS_LOSS.value), weights / weights.sum()
