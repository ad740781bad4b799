"""Each car's pace as the race itself shows it, with everything else as it was known before: what replaying a race may look at."""

from collections.abc import Mapping

import numpy as np
import polars as pl
from numpy.typing import NDArray

from rsrl.laps import with_gaps, with_status, with_stint_ages
from rsrl.season import GREEN, SC, VSC, Figure, RaceRecord

Array = NDArray[np.float64]

FREE_GAP_S = 2.0
TRAFFIC_WEIGHT = 0.5  # behind another car, whose cost is taken off first: it says less of what the car can do; chosen on 2023
FREE_LAPS_PER_LOOK = 8.0  # laps of a stint hang together: so many free ones count as one independent look at the car
HUBER_S = 0.6
SLOW_SHARE = 1.035


def race_laps(race: pl.DataFrame, record: RaceRecord) -> pl.DataFrame:
    """Green racing laps with `extra_s`: lap time less what the record gives its tyre, fuel and lap in free air, car and base lap left out.

    Also `weight`: 1 in free air, `TRAFFIC_WEIGHT` behind another car, whose loss by the record's own dirty air and DRS is taken off.
    """
    laps = with_gaps(with_status(with_stint_ages(race))).filter(pl.col("lap") <= record.laps)
    ageing = {GREEN: 1.0, VSC: record.incidents.vsc_wear_factor.value, SC: record.incidents.sc_wear_factor.value}
    aged = pl.col("status").replace_strict(ageing, default=record.incidents.sc_wear_factor.value, return_dtype=pl.Float64)
    keys = ["driver", "stint_number"]
    laps = laps.sort("driver", "lap").with_columns(wear_laps=(aged.cum_sum() - aged).over(keys))
    racing = laps.filter(
        (pl.col("status") == GREEN)
        & (pl.col("lap") > 1)
        & ~pl.col("in_lap")
        & ~pl.col("out_lap")
        & pl.col("lap_time_s").is_not_null()
        & pl.col("compound").is_in(list(record.tyres))
    )
    usual = pl.col("lap_time_s").rolling_median(window_size=7, min_samples=1, center=True).over(keys)
    racing = racing.filter(pl.col("lap_time_s") < SLOW_SHARE * usual)
    gap = racing["gap_start_s"].fill_null(99.0).to_numpy()
    extra = racing["lap_time_s"].to_numpy() - _free_lap(racing, record) - _in_traffic(gap, record)
    return racing.with_columns(extra_s=pl.Series(extra), weight=pl.Series(np.where(gap > FREE_GAP_S, 1.0, TRAFFIC_WEIGHT)))


def _free_lap(laps: pl.DataFrame, record: RaceRecord) -> Array:
    """Tyre, fuel and evolution of each lap as in the simulator, without base lap and car."""
    t = record.track
    left = 1.0 - (laps["lap"].to_numpy() - 0.5) / record.laps
    age = laps["wear_laps"].to_numpy()
    total = (t.fuel_s_per_kg.value * t.fuel_start_kg.value + t.evolution_s.value) * left
    letters = laps["compound"].to_numpy()
    for letter, tyre in record.tyres.items():
        on = letters == letter
        worn = tyre.offset_s.value + age * (tyre.wear_s_per_lap.value + age * tyre.curvature_s_per_lap2.value)
        total = total + np.where(on, worn, 0.0)
    return np.asarray(total, dtype=np.float64)


def _in_traffic(gap: Array, record: RaceRecord) -> Array:
    t = record.track
    dirty = t.dirty_air_loss_s.value * np.maximum(1 - gap / t.dirty_air_window_s.value, 0.0)
    return np.asarray(dirty - np.where(gap < t.drs_window_s.value, t.drs_gain_s.value, 0.0), dtype=np.float64)


def hindsight_pace(race: pl.DataFrame, record: RaceRecord, before: Mapping[str, Figure]) -> tuple[Figure, dict[str, Figure]]:
    """Base lap and pace of every starter from the race's own laps.

    Args:
        race: all laps of the race.
        record: everything but pace, as it was known before the race.
        before: the forecast of each starter's pace, which stands in as far as a car's laps are few: a car that retired early gets
            neither the slowest pace nor none.

    Returns:
        base lap, and pace against the mean starter with its standard error.
    """
    laps = race_laps(race, record)
    level = _centre(laps["extra_s"].to_numpy(), laps["weight"].to_numpy()) if laps.height else record.track.base_lap_s.value
    look_variance = record.track.stint_sd_s.value**2 + record.track.lap_noise_sd_s.value**2 / FREE_LAPS_PER_LOOK
    paces: dict[str, tuple[float, float, int]] = {}
    for driver, prior in before.items():
        own = laps.filter(pl.col("driver") == driver)
        weight = own["weight"].to_numpy()
        looks = float(weight.sum()) / FREE_LAPS_PER_LOOK
        if looks <= 0:
            paces[driver] = (prior.value, prior.se, 0)
            continue
        seen = _centre(own["extra_s"].to_numpy(), weight) - level
        trust, belief = looks / look_variance, prior.se**-2
        paces[driver] = ((trust * seen + belief * prior.value) / (trust + belief), float((trust + belief) ** -0.5), own.height)
    mean = float(np.mean([value for value, _, _ in paces.values()]))
    note = "the race's own laps, shrunk to the forecast"
    base = Figure(level + mean, 0.2, laps.height, "the race's own laps")
    return base, {d: Figure(value - mean, se, n, note) for d, (value, se, n) in paces.items()}


def _centre(values: Array, weights: Array) -> float:
    """Weighted Huber mean."""
    centre = float(np.median(values))
    for _ in range(8):
        w = weights / np.maximum(np.abs(values - centre) / HUBER_S, 1.0)
        centre = float(np.average(values, weights=w))
    return centre
