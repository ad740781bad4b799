"""95 % intervals of means, differences, proportions and ratios."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

CONFIDENCE: Final = 0.95
"""Of every interval in this project."""

Z: Final = float(stats.norm.ppf(0.5 + CONFIDENCE / 2))
"""Standard errors from an estimate to either end of its normal interval, 1.959964."""

Interval = tuple[float, float]
Floats = NDArray[np.float64]
Reals = NDArray[np.float64] | NDArray[np.int64] | Sequence[float]


@dataclass(frozen=True)
class Estimate:
    """A figure with its 95 % interval."""

    value: float
    ci95: Interval


NOTHING: Final = Estimate(math.nan, (math.nan, math.nan))
"""Where there is nothing to estimate from."""


def standard_error(values: ArrayLike, axis: int = 0) -> Floats:
    """Standard error of the mean of independent values along an axis; NaN for a single value."""
    array = np.asarray(values, np.float64)
    n = array.shape[axis]
    if n < 2:
        return np.full(tuple(np.delete(array.shape, axis)), math.nan)
    return np.asarray(array.std(axis=axis, ddof=1) / math.sqrt(n))


def half_width(values: ArrayLike, axis: int = 0) -> Floats:
    """Half the width of Student's interval of the mean along an axis; NaN for a single value."""
    n = np.asarray(values).shape[axis]
    return np.asarray(student_quantile(n - 1) * standard_error(values, axis))


def student_quantile(freedom: float, comparisons: int = 1) -> float:
    """Standard errors to either end of an interval by Student's t; NaN without degrees of freedom.

    Args:
        freedom: degrees of freedom.
        comparisons: intervals that are to hold together in 95 % of cases, by Bonferroni's correction.
    """
    return float(stats.t.ppf(1 - (1 - CONFIDENCE) / 2 / comparisons, freedom)) if freedom > 0 else math.nan


def student_interval(estimate: float, standard_error: float, freedom: float, comparisons: int = 1) -> Interval:
    """Interval of an estimate by Student's t; the arguments are those of `student_quantile`."""
    half = student_quantile(freedom, comparisons) * standard_error
    return estimate - half, estimate + half


def normal_interval(estimate: float, standard_error: float) -> Interval:
    """Interval of an estimate whose standard error is known, or is of so many values that Student's t is the normal law."""
    return estimate - Z * standard_error, estimate + Z * standard_error


def mean_interval(values: Reals) -> Interval:
    """Interval of the mean of independent values by Student's t; NaN for a single value, a point where all are alike."""
    n = len(values)
    if n < 2:
        return NOTHING.ci95
    return student_interval(float(np.mean(values)), float(standard_error(values)), n - 1)


def mean_estimate(values: Reals) -> Estimate:
    """Mean of independent values with `mean_interval`; NaN without a value."""
    return Estimate(float(np.mean(values)), mean_interval(values)) if len(values) else NOTHING


def paired_difference(values: ArrayLike, others: ArrayLike) -> Estimate:
    """Mean of `values` less `others`, pair by pair, with Student's interval of the differences.

    Args:
        values, others: of equal length; two entries of one index share what is random, such as a simulated race.
    """
    return mean_estimate(np.asarray(values, np.float64) - np.asarray(others, np.float64))


def proportion_interval(share: float, n: int) -> Interval:
    """Wilson's score interval of a proportion observed in `n` independent trials (Wilson 1927); NaN without a trial."""
    if n < 1:
        return NOTHING.ci95
    z = Z * Z / n
    centre = (share + z / 2) / (1 + z)
    half = Z * math.sqrt(share * (1 - share) / n + z / (4 * n)) / (1 + z)
    return max(centre - half, 0.0), min(centre + half, 1.0)


def ratio_of_means(numerator: ArrayLike, denominator: ArrayLike) -> Estimate:
    """Ratio of two means over the same clusters, with its interval by the delta method; NaN where the denominator's mean is zero.

    The linearised ratio is the mean of (numerator - ratio x denominator) / mean denominator, to which Student's t applies. With sums
    and counts by cluster this is the cluster-robust interval of a mean over members: laps of a race are not independent, races are.

    Args:
        numerator, denominator: one value for each cluster, in the same order.
    """
    top, bottom = np.asarray(numerator, np.float64), np.asarray(denominator, np.float64)
    width = float(bottom.mean())
    if width == 0:
        return NOTHING
    ratio = float(top.mean()) / width
    half = float(half_width((top - ratio * bottom) / abs(width)))
    return Estimate(ratio, (ratio - half, ratio + half))
