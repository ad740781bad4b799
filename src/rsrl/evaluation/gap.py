"""How much of what there is to win a strategist wins: its share of the gap between fixed strategies and hindsight."""

import math
from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.evaluation.paired import RaceLog
from rsrl.statistics import Interval, mean_interval

FROM: Final = "fixed"
TO: Final = "hindsight"
"""Strategists between whom the gap lies."""


def gap_closed(logs: Mapping[str, RaceLog]) -> dict[str, tuple[float, Interval]]:
    """Share of the gap in mean position from `fixed` to `hindsight` each strategist closes, with its 95 % interval; none without both.

    All logs are of the same races. The interval is of the ratio of two paired means, by the delta method: of the mean of what a
    race's gain exceeds the share of that race's gap. Not a number where there is no gap.
    """
    if FROM not in logs or TO not in logs:
        return {}
    gap = (logs[FROM].position - logs[TO].position).astype(np.float64)
    return {name: _share((logs[FROM].position - log.position).astype(np.float64), gap) for name, log in logs.items()}


def _share(gain: NDArray[np.float64], gap: NDArray[np.float64]) -> tuple[float, Interval]:
    width = float(gap.mean())
    if width <= 0:
        return math.nan, (math.nan, math.nan)
    share = float(gain.mean()) / width
    low, high = mean_interval((gain - share * gap) / width)
    return share, (share + low, share + high)
