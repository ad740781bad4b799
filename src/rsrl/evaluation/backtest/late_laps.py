"""Laps late in their stints, forecast: where tyres that were fitted to the laps of stints alone come out too kind.

A lap is late where its tyres are older than on four fifths of the race's racing laps on that compound. Of the race itself the forecast
knows entry, grid, qualifying and nominated tyres; wear and what laps gain over the race come from earlier races. Each stint has a level of
its own, the mean of its earlier laps less what the forecast gives tyre, fuel and lap, so that neither the car's pace nor its set counts:
what is scored is how lap times go on from there. Laps behind another car have the forecast's own dirty air taken off
(`hindsight.race_laps`). Laps far off those around them, of a car that was lapped or went wide, are left out whatever the forecast.
"""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
import polars as pl
from numpy.typing import NDArray

from rsrl.evaluation.backtest.forecast import Season, forecast_record
from rsrl.evaluation.backtest.hindsight import race_laps
from rsrl.results import LateLapsRace, MeanInterval
from rsrl.season import RaceRecord
from rsrl.statistics import bootstrap_over_races

LATE_SHARE: Final = 0.8
ODD: Final = 3.0
"""Robust standard deviations from the median of the seven laps around it, beyond which a lap says nothing of tyres."""

ROBUST: Final = 1.4826  # standard deviations of a normal law in its median absolute deviation
FEWEST_EARLY: Final = 5
"""A stint with fewer earlier laps has no level to speak of."""

GOALS: Final = {"late_s": 0.45}
STINT: Final = ("driver", "stint_number")


class StintErrors(NamedTuple):
    """Errors of late and of earlier laps about their stint's level, s."""

    late: NDArray[np.float64]
    early: NDArray[np.float64]


def late_laps(season: Season, index: int) -> LateLapsRace | None:
    """Errors of one race; None for one that was wet, or in which no stint ran so long."""
    race = season.book.races[index]
    if race.wet:
        return None
    laps = season.laps_of(index)
    both, alone = (stint_errors(laps, forecast_record(season, index, choices=known)) for known in (True, False))
    if not len(both.late):
        return None
    return LateLapsRace(
        season.name(index), len(both.late), rms(both.late), rms(alone.late), len(both.early), rms(both.early), rms(alone.early)
    )


def stint_errors(race: pl.DataFrame, record: RaceRecord) -> StintErrors:
    """Errors of a race's racing laps about what a record makes of them from each stint's earlier laps.

    Args:
        race: all laps of the race.
        record: as it was forecast.
    """
    laps = _usual(race_laps(race, record))
    early = (pl.col("age_laps") <= pl.col("age_laps").quantile(LATE_SHARE, "linear").over("compound")).cast(pl.Float64)
    weight = early * pl.col("weight")
    laps = laps.with_columns(
        early=early, level_s=(weight * pl.col("extra_s")).sum().over(STINT) / weight.sum().over(STINT), seen=early.sum().over(STINT)
    ).filter(pl.col("seen") >= FEWEST_EARLY)
    error = (laps["extra_s"] - laps["level_s"]).to_numpy()
    is_early = laps["early"].to_numpy() > 0
    return StintErrors(error[~is_early], error[is_early])


def _usual(laps: pl.DataFrame) -> pl.DataFrame:
    """Laps near those around them in their stint."""
    around = pl.col("lap_time_s").rolling_median(window_size=7, min_samples=3, center=True).over(STINT)
    off = (pl.col("lap_time_s") - around).fill_null(0.0).abs()
    return laps.filter(off <= ODD * ROBUST * off.median())


def rms(errors: NDArray[np.float64]) -> float:
    """Root mean square; NaN of nothing."""
    return float(np.sqrt(np.mean(errors**2))) if len(errors) else float("nan")


def over_laps(races: Sequence[LateLapsRace], seed: int = 0) -> dict[str, MeanInterval]:
    """Root mean squares over the laps of all races and their differences, with intervals of a bootstrap over races."""
    columns = [(r.late_laps, r.late_s, r.late_lap_times_s, r.early_laps, r.early_s, r.early_lap_times_s) for r in races]
    table = np.array(columns, np.float64)
    low, high = bootstrap_over_races(table, _pooled, seed=seed)
    return {name: MeanInterval(float(v), float(a), float(b)) for name, v, a, b in zip(POOLED, _pooled(table), low, high, strict=True)}


POOLED: Final = ("late_s", "late_lap_times_s", "late_less_s", "early_s", "early_lap_times_s", "early_less_s")


def _pooled(table: NDArray[np.float64]) -> NDArray[np.float64]:
    """`POOLED` of rows of races."""
    found = []
    for laps, *errors in (table[:, :3].T, table[:, 3:].T):
        both, alone = (np.sqrt((laps * e**2).sum() / laps.sum()) for e in errors)
        found += [both, alone, both - alone]
    return np.array(found)
