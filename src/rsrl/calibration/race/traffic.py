"""Cars close to each other in one race: dirty air, the gap of a held car, passing, lapping."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import polars as pl

from rsrl.calibration.literature import DRS_WINDOW
from rsrl.calibration.race.design import Array, robust_sd
from rsrl.calibration.race.pace_and_tyres import PaceModel
from rsrl.calibration.race.passing import PassingGrid, noise_of_passes, passing_grid
from rsrl.calibration.rules import FOLLOWING_GAIN, following_aid
from rsrl.laps import RACE
from rsrl.season import Figure

FIRST_LAP: Final = 4  # pairs before that are still the start
NEAR_S: Final = 1.5  # gap at the start of the lap: a car that arrives during it is seldom past at its end
AIR_WINDOWS_S: Final = tuple(float(w) for w in np.arange(1.5, 6.01, 0.25))
DIRTY_AIR: Final = (0.14, 6.0)  # loss at no gap and window: first guess while passing is analysed, near the pooled result
FOLLOWING_S: Final = (0.6, 15)  # first guess, and the number of held cars it counts as
ODD_S: Final = 1.5
ODD_LAPPING_S: Final = 4.0


@dataclass(frozen=True)
class DirtyAir:
    """Sums over laps begun behind another car, for each window of `AIR_WINDOWS_S`: with x = 1 - gap / window and e the excess time."""

    n: int
    cars: int
    sd_s: float
    xx: tuple[float, ...]
    xe: tuple[float, ...]
    ee: float


@dataclass(frozen=True)
class TrafficAnalysis:
    """Dirty air, following, passing and lapping in one race."""

    air: DirtyAir
    following_s: Figure | None
    passing: PassingGrid
    passed_loss_s: Figure | None  # lost by the passed car, beyond the bad lap that let it be passed
    blue_flag_s: Figure | None
    lapping_s: Figure | None


def analyse_traffic(laps: pl.DataFrame, model: PaceModel, noise_s: float) -> TrafficAnalysis:
    """Fit the traffic of one race.

    Args:
        laps: its green racing laps with the gap columns, in- and out-laps left out (`rsrl.laps.clean`).
        model: its pace model.
        noise_s: independent lap noise.
    """
    frame = laps.with_columns(free_s=pl.Series(model.predict(laps) + model.stint_effects(laps)))
    pairs = _pairs(frame)
    following = _following_gap(pairs)
    guess, weight = FOLLOWING_S
    held_s = guess if following is None else (following.value * following.n + guess * weight) / (following.n + weight)
    gain_s = FOLLOWING_GAIN[following_aid(model.season)].value
    gap = pairs["gap_start_s"].to_numpy()
    gap_other = pairs["gap_start_ahead_s"].fill_null(99.0).to_numpy()
    same = (pairs["lap_ahead_start_ahead"] == pairs["lap"] - 1).fill_null(False).to_numpy()
    other = pairs["free_ahead_s"].to_numpy() + np.where(same, _air(gap_other, gain_s), 0.0)
    advantage = other - pairs["free_s"].to_numpy() - _air(gap, gain_s)
    passed = pairs["passed"].to_numpy().astype(bool)
    blue, lapping = _lapping(frame)
    grid = passing_grid(gap, advantage, passed, held_s, noise_s)
    lost = _passed_loss(pairs, advantage, gap, held_s, noise_s)
    return TrafficAnalysis(_dirty_air(frame), following, grid, lost, blue, lapping)


def _dirty_air(frame: pl.DataFrame) -> DirtyAir:
    """Sums over laps begun 1.1 to 6 s behind a car on the same lap.

    Only those that a free lap would end more than 1.1 s behind, so that the air alone held the car up. Laps that did end there are the
    slower ones: they made the loss of simulated races 0.37 s where it was 0.25.
    """
    free_gap = pl.col("gap_ahead_s") - (pl.col("lap_time_s") - pl.col("free_s"))
    near = frame.filter((pl.col("lap") >= FIRST_LAP) & pl.col("gap_start_s").is_between(1.1, 6.0) & (free_gap > 1.1) & _same_lap())
    gap = near["gap_start_s"].to_numpy()
    extra = np.clip((near["lap_time_s"] - near["free_s"]).to_numpy(), -ODD_S, ODD_S)
    x = [np.maximum(1 - gap / w, 0.0) for w in AIR_WINDOWS_S]
    return DirtyAir(
        n=near.height,
        cars=near["driver"].n_unique(),
        sd_s=robust_sd(extra) if near.height else 0.0,
        xx=tuple(float(v @ v) for v in x),
        xe=tuple(float(v @ extra) for v in x),
        ee=float(extra @ extra),
    )


def _same_lap() -> pl.Expr:
    return pl.col("lap_ahead_start") == pl.col("lap") - 1


def _pairs(frame: pl.DataFrame) -> pl.DataFrame:
    """Car and the car ahead of it on the same lap, at the start of a lap on which neither pitted and all was green.

    Adds the other's `free_ahead_s`, `session_ahead_s`, end gap `end_gap_s` (negative: passed), `passed`, and `extra_ahead_s`, the
    other's time beyond what the model gives it in free air.
    """
    ahead = frame.select(
        *RACE,
        "lap",
        pl.col("driver").alias("driver_ahead_start"),
        pl.col("free_s").alias("free_ahead_s"),
        (pl.col("lap_time_s") - pl.col("free_s")).alias("extra_ahead_s"),
        pl.col("session_time_s").alias("session_ahead_s"),
        pl.col("gap_start_s").alias("gap_start_ahead_s"),
        pl.col("lap_ahead_start").alias("lap_ahead_start_ahead"),
    )
    near = frame.filter((pl.col("lap") >= FIRST_LAP) & (pl.col("gap_start_s") < NEAR_S) & _same_lap())
    return near.join(ahead, on=[*RACE, "lap", "driver_ahead_start"], maintain_order="left").with_columns(
        end_gap_s=pl.col("session_time_s") - pl.col("session_ahead_s"),
        passed=pl.col("session_time_s") < pl.col("session_ahead_s"),
    )


def _following_gap(pairs: pl.DataFrame) -> Figure | None:
    """Median end gap of cars begun within 1.5 s that the model would have brought level, and that stayed behind within 1.5 s."""
    held = pairs.filter(
        ~pl.col("passed") & (pl.col("end_gap_s") < 1.5) & (pl.col("gap_start_s") - (pl.col("free_ahead_s") - pl.col("free_s")) < 0.3)
    )
    if held.height < 5:
        return None
    gaps = held["end_gap_s"].to_numpy()
    return Figure(float(np.median(gaps)), float(1.25 * max(np.std(gaps), 0.1) / np.sqrt(len(gaps))), held.height)


def _air(gap: Array, gain_s: float) -> Array:
    """Time lost to the car ahead, what the following car's aid gains taken off, as in the simulator."""
    aid = np.where(gap < DRS_WINDOW.value, gain_s, 0.0)
    return np.asarray(DIRTY_AIR[0] * np.maximum(1 - gap / DIRTY_AIR[1], 0.0) - aid, dtype=np.float64)


def _passed_loss(pairs: pl.DataFrame, advantage: Array, gap: Array, held_s: float, noise_s: float) -> Figure | None:
    """Median extra time of passed cars, less their half of the noise expected in a pass."""
    passed = pairs["passed"].to_numpy().astype(bool)
    extra = pairs["extra_ahead_s"].to_numpy()[passed]
    usual = np.abs(extra) < ODD_LAPPING_S
    if usual.sum() < 3:
        return None
    noise = noise_of_passes(gap[passed], advantage[passed], held_s, noise_s)[usual] / 2
    left = extra[usual] - noise
    return Figure(float(np.median(left)), float(1.25 * max(robust_sd(left), 0.2) / np.sqrt(len(left))), len(left))


def _lapping(frame: pl.DataFrame) -> tuple[Figure | None, Figure | None]:
    """Time lost by a car on the lap on which it is lapped, and by the one that laps it, against its own laps around.

    A car is lapped where one that crossed the line within 10 s behind it, a lap or more ahead in the race, crosses before it next time.
    """
    crossings = frame.select("driver", "lap", "session_time_s")
    starts = crossings.select("driver", (pl.col("lap") + 1).alias("lap"), pl.col("session_time_s").alias("start_s"))
    whole = crossings.join(starts, on=["driver", "lap"])
    events = whole.join(whole, how="cross", suffix="_by").filter(
        (pl.col("lap_by") > pl.col("lap"))
        & (pl.col("session_time_s_by") - pl.col("session_time_s")).is_between(-10.0, 0.0)
        & (pl.col("start_s_by") - pl.col("start_s")).is_between(0.0, 10.0)
    )
    extra = _against_neighbours(frame)
    lapped = events.select("driver", "lap").join(extra, on=["driver", "lap"])
    lapping = events.select(pl.col("driver_by").alias("driver"), pl.col("lap_by").alias("lap")).join(extra, on=["driver", "lap"])
    return _lapping_figure(lapped), _lapping_figure(lapping)


def _against_neighbours(frame: pl.DataFrame) -> pl.DataFrame:
    """Each lap's excess over the pace model less the same car's median excess on the eight laps around: `extra_s`."""
    excess = pl.col("lap_time_s") - pl.col("free_s")
    return (
        frame.sort("driver", "lap")
        .with_columns(extra_s=excess - excess.rolling_median(window_size=9, min_samples=4, center=True).over("driver"))
        .select("driver", "lap", "extra_s")
        .drop_nulls()
    )


def _lapping_figure(events: pl.DataFrame) -> Figure | None:
    """Mean extra time per event (a lap with two of them counts once for each), laps with more than 4 s left out."""
    counted = events.group_by("driver", "lap").agg(pl.col("extra_s").first(), times=pl.len()).sort("driver", "lap")
    per_event = (counted["extra_s"] / counted["times"]).to_numpy()
    per_event = per_event[np.abs(per_event) < ODD_LAPPING_S]
    if len(per_event) < 3:
        return None
    return Figure(float(np.mean(per_event)), float(max(np.std(per_event), 0.3) / np.sqrt(len(per_event))), len(per_event))
