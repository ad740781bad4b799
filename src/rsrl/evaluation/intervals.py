"""Intervals of a mean over races."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy import stats

CONFIDENCE = 0.95
Interval = tuple[float, float]


def mean_interval(values: NDArray[np.float64] | NDArray[np.int64]) -> Interval:
    """95 % interval of the mean by Student's t; not a number for a single value, a point where all are alike."""
    n = len(values)
    if n < 2:
        return math.nan, math.nan
    mean, se = float(np.mean(values)), float(np.std(values, ddof=1)) / math.sqrt(n)
    half = float(stats.t.ppf(0.5 + CONFIDENCE / 2, n - 1)) * se
    return mean - half, mean + half
