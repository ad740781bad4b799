"""What a tree is fitted to: states of many races with the policy's calls, thinned where nothing is in doubt."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.tree.driving import Calls, Driven, Floats
from rsrl.strategists import made_legal

THINNING: Final = 8
"""Of the states in which staying out is clear, one in so many is kept and stands for all of them."""

CLEAR_QUANTILE: Final = 0.25
"""Quantile of the margins by which a policy stays out, above which staying out counts as clear."""


@dataclass(frozen=True)
class Samples:
    """States with the policy's calls.

    Attributes:
        rows: float32 [N, C].
        labels: int8 [N], the policy's calls made legal as the tree's are.
        stands_for: int64 [N], how many states each stands for.
        at_stake: float32 [N], the policy's best less its worst legal value.
    """

    rows: Floats
    labels: Calls
    stands_for: NDArray[np.int64]
    at_stake: Floats

    def weights(self, stop_weight: float, by_stake: bool) -> NDArray[np.float64]:
        """Weights [N] for fitting: a state of a stop counts `stop_weight` times, each as often as there is at stake where asked for."""
        weight = self.stands_for * np.where(self.labels > 0, stop_weight, 1.0)
        return np.asarray(weight * self.at_stake if by_stake else weight, np.float64)


def margins(driven: Driven) -> Floats:
    """Value of the best legal call less that of the second best, float32 [T, R]; infinite with one legal call."""
    ordered = np.sort(np.where(driven.legal, driven.q, -np.inf), axis=2)
    return np.asarray(ordered[..., 3] - ordered[..., 2], np.float32)


def clear_margin(driven: Driven) -> float:
    """Margin from which staying out counts as clear, from races driven by the policy; infinite where it never stays out."""
    stays = margins(driven)[driven.choices & (driven.answers == 0)]
    return float(np.quantile(stays, CLEAR_QUANTILE)) if len(stays) else float("inf")


def samples_of(driven: Driven, clear: float, rng: np.random.Generator) -> Samples:
    """The choices of races as samples, thinned where staying out is clear."""
    is_clear = (driven.answers == 0) & (margins(driven) > clear)
    drawn = rng.random(is_clear.shape) < 1.0 / THINNING
    kept = driven.choices & (drawn | ~is_clear)
    legal, q = driven.legal[kept], driven.q[kept]
    stake = np.where(legal, q, -np.inf).max(axis=1) - np.where(legal, q, np.inf).min(axis=1)
    return Samples(
        driven.rows[kept], made_legal(driven.answers[kept], legal), np.where(is_clear[kept], THINNING, 1).astype(np.int64),
        stake.astype(np.float32),
    )  # fmt: skip


def together(parts: list[Samples]) -> Samples:
    """All samples of several parts."""
    return Samples(*(np.concatenate([getattr(part, name) for part in parts]) for name in Samples.__dataclass_fields__))
