"""Believable ranges as part of the prior: a posterior that reaches beyond its range is cut off there, its mean and spread taken anew.

The value is then inside the range, not on its edge, so that no file is written which `season.toml_io` refuses. A posterior well inside is
left as it is.
"""

from typing import Final

from scipy.stats import truncnorm

from rsrl.season import Figure
from rsrl.season.bounds import bounds_of

FAR: Final = 6.0
"""Standard errors beyond which an edge does not matter; further outside than that only the tail of the law is left."""

TAIL_SHARE: Final = 0.1
"""Of the range: mean of what is left of a law so far outside, at most."""


def truncated(figure: Figure, low: float, high: float) -> Figure:
    """Mean and standard deviation of the normal distribution of a figure between `low` and `high`."""
    value, se = figure.value, figure.se
    outside = max(low - value, value - high)
    if outside < -FAR * se or (se == 0 and outside <= 0):
        return figure
    if outside > FAR * se:  # a normal law's tail falls off like an exponential one of this mean
        mean = min(se * se / outside, TAIL_SHARE * (high - low))
        return figure._replace(value=low + mean if value < low else high - mean, se=mean)
    law = truncnorm((low - value) / se, (high - value) / se, value, se)
    return figure._replace(value=float(min(max(law.mean(), low), high)), se=float(law.std()))  # rounding alone can pass an edge


def believable(figure: Figure, name: str, low: float = float("-inf")) -> Figure:
    """A figure within its range in `season.bounds`, and above `low`."""
    least, most = bounds_of(name)
    return truncated(figure, max(least, low), most)
