"""The mean over a few training seeds and many races, where both are random."""

import math

import numpy as np
from numpy.typing import ArrayLike

from rsrl.errors import RsrlError
from rsrl.statistics.intervals import NOTHING, Estimate, student_interval


def mean_over_seeds(values: ArrayLike) -> Estimate:
    """Mean of values [seeds, races], races the same for every seed, with an interval over both.

    The effects of seeds and of races add up, so the variance of the mean is estimated from the mean squares of a two-way layout without
    repeats, (MS_seeds + MS_races - MS_rest) / (seeds x races), no component below zero; Student's t with Satterthwaite's degrees of
    freedom (Satterthwaite 1946). For a paired comparison, give differences. With one seed the interval is over races alone.

    Raises:
        RsrlError: not such a table.
    """
    table = np.asarray(values, np.float64)
    if table.ndim != 2 or not table.size or not np.isfinite(table).all():
        raise RsrlError(f"values of shape {table.shape} are no table of seeds and races, or not all finite")
    seeds, races = table.shape
    mean = float(table.mean())
    if races < 2:
        return Estimate(mean, NOTHING.ci95)
    of_races = seeds * float(np.var(table.mean(axis=0), ddof=1))
    if seeds == 1:
        return Estimate(mean, student_interval(mean, math.sqrt(of_races / races), races - 1))
    of_seeds = races * float(np.var(table.mean(axis=1), ddof=1))
    rest_table = table - table.mean(axis=0) - table.mean(axis=1, keepdims=True) + mean
    rest_freedom = (seeds - 1) * (races - 1)
    rest = float((rest_table**2).sum()) / rest_freedom
    of_seeds, of_races = max(of_seeds, rest), max(of_races, rest)
    total = of_seeds + of_races - rest
    spread = of_seeds**2 / (seeds - 1) + of_races**2 / (races - 1) + rest**2 / rest_freedom
    freedom = total**2 / spread if spread > 0 else 1.0
    return Estimate(mean, student_interval(mean, math.sqrt(total / (seeds * races)), freedom))
