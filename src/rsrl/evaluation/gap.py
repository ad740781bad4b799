"""The share of the gap between fixed strategies and hindsight that a strategist closes."""

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from rsrl.evaluation.paired import RaceLog
from rsrl.statistics import Estimate, ratio_of_means

WORST: Final = "fixed"
BEST: Final = "hindsight"
"""Strategists between whom the gap lies."""


def gap_closed(logs: Mapping[str, RaceLog]) -> dict[str, Estimate]:
    """Share of the gap in mean position from `fixed` to `hindsight` that each strategist closes; none without both.

    All logs are of the same races.
    """
    if WORST not in logs or BEST not in logs:
        return {}
    worst, best = logs[WORST].position, logs[BEST].position
    return {name: share_of_gap(log.position, worst, best) for name, log in logs.items()}


def share_of_gap(positions: ArrayLike, worst: ArrayLike, best: ArrayLike) -> Estimate:
    """Share of the gap from `worst` to `best` that `positions` closes, 1 where they are as good as `best`.

    The interval is that of a ratio of two paired means (`ratio_of_means`). NaN where the two ends are level.

    Args:
        positions, worst, best: finishing positions [races]; where one has fewer, the first races are what they have in common.
    """
    own, high, low = (np.asarray(values, np.float64) for values in (positions, worst, best))
    races = min(len(own), len(high), len(low))
    return ratio_of_means(high[:races] - own[:races], high[:races] - low[:races])
