"""Finished cells as arrays, and what is estimated from them: means and paired differences, with 95 % intervals.

Race number i has the same random numbers for every strategist, so strategists are compared race by race. Where one called fewer races
than another, the first races are what they have in common.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rsrl.results import Difference, DrivenStrategy, from_plain
from rsrl.statistics import Interval, mean_interval, student_interval

Values = NDArray[np.float64]


@dataclass(frozen=True)
class Run:
    """A finished cell; arrays by race."""

    position: Values
    points: Values
    stops: Values
    invalid: Values
    retired: Values
    driven: tuple[str, ...]
    laps: int
    common: tuple[DrivenStrategy, ...]
    decision_ms: float

    @classmethod
    def of(cls, result: Mapping[str, Any]) -> "Run":
        """From what `run_cell` gives, nothing left out."""
        position, points, stops, invalid, retired = (
            np.array(result[name], np.float64) for name in ("position", "points", "stops", "invalid", "retired")
        )
        common = tuple(from_plain(one, DrivenStrategy) for one in result["common"])
        driven, decision_ms = tuple(result["driven"]), result["timing"]["decision_ms"]
        return cls(position, points, stops, invalid, retired, driven, result["laps"], common, decision_ms)

    @property
    def races(self) -> int:
        """How many."""
        return len(self.position)


def comparable_mean(values: Values, longest: Values) -> tuple[float, Interval]:
    """Mean of n races, told for the N >= n races that another strategist called, and its interval.

    The estimate is the other's mean over N plus the mean difference over n, a control variate: how easy the first n races
    were cancels. It is exactly the plain mean, and the plain interval, where n is N.
    """
    n, total = len(values), len(longest)
    if n == total:
        return float(values.mean()), mean_interval(values)
    weighted = values - longest[:n] * (1 - n / total)  # each race's share of the estimate, times n
    value = float(weighted.mean() + longest[n:].sum() / total)
    if n < 2:
        return value, (math.nan, math.nan)
    variance = float(weighted.var(ddof=1)) / n
    if total - n > 1:
        variance += (total - n) * float(longest[n:].var(ddof=1)) / total**2
    return value, student_interval(value, math.sqrt(variance), n - 1)


def difference(behind: Sequence[Values], ahead: Sequence[Values]) -> Difference:
    """How far one strategist finishes behind another on the races both called: arrays by track, averaged over tracks."""
    pairs = [(own[: len(other)], other[: len(own)]) for own, other in zip(behind, ahead, strict=True)]
    places = over_tracks([own - other for own, other in pairs])
    won = over_tracks([(own > other) + (own == other) / 2 for own, other in pairs])
    return Difference(float(places.mean()), mean_interval(places), float(won.mean()), mean_interval(won), len(places))


def over_tracks(runs: Sequence[Values]) -> Values:
    """Mean over tracks of each race number. Races of one number share random numbers, so only these means are independent."""
    races = min(len(run) for run in runs)
    return np.mean([run[:races] for run in runs], axis=0)
