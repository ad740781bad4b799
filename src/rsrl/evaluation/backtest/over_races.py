"""Measures of races, each by itself, to their mean or median over races with its interval."""

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from rsrl.results import MeanInterval, Number
from rsrl.statistics import bootstrap_over_races


def over_races(races: Sequence[Mapping[str, Number]], medians: Collection[str] = (), seed: int = 0) -> dict[str, MeanInterval]:
    """Mean of each measure over the races that have it, with the interval of a bootstrap over them; one that no race has is left out.

    Args:
        races: measures by name, the same names for every race; None or NaN where a race has none.
        medians: measures of which the median counts.
        seed: of the bootstrap.
    """
    found = {}
    for name in races[0] if races else ():
        values = np.array([race[name] for race in races], np.float64)
        known = values[np.isfinite(values)]
        if len(known):
            statistic = np.median if name in medians else np.mean
            low, high = bootstrap_over_races(known, statistic, seed=seed)
            found[name] = MeanInterval(float(statistic(known)), float(low), float(high))
    return found
