"""Cars close to each other: dirty air, DRS, the gap of a held car, passing, lapping."""

from typing import Final, NamedTuple

import numpy as np
import polars as pl
from scipy.optimize import minimize

from rsrl.calibration.design import Array, robust_sd
from rsrl.calibration.pace import PaceModel
from rsrl.errors import RsrlError
from rsrl.laps import RACE
from rsrl.season import Figure

DRS_GAIN: Final = Figure(0.5, 0.1, 0, "0.46-0.54 s in Heilmeier et al. 2020; not identifiable: cars within 1 s are also held up")
DRS_WINDOW: Final = Figure(1.0, 0.0, 0, "sporting regulations")
PASS_LOSS: Final = Figure(0.15, 0.15, 0, "0.3 s for each of the two in Heilmeier et al. 2020; half of it, as the passing car uses DRS")
FIRST_LAP: Final = 4  # pairs before that are still the start
NEAR_S: Final = 1.5  # how close a pair must begin: one that only arrives during the lap is seldom past at its end, whatever its advantage
THRESHOLD_PRIOR: Final = (1.0, 1.0)  # 1.2-3.8 s by track without DRS in Heilmeier et al. 2020
LOG_SCALE_PRIOR: Final = (-1.0, 0.5)  # about 0.37 s


class TrafficFit(NamedTuple):
    """Figures of cars close to each other, by their names in `TrackFigures`."""

    dirty_air_loss_s: Figure
    dirty_air_window_s: Figure
    following_gap_s: Figure
    pass_threshold_s: Figure
    pass_scale_s: Figure
    pass_loss_s: Figure
    drs_gain_s: Figure
    drs_window_s: Figure
    blue_flag_loss_s: Figure
    lapping_loss_s: Figure


def fit_traffic(laps: pl.DataFrame, model: PaceModel, noise_s: float) -> TrafficFit:
    """Fit the traffic figures of this Grand Prix.

    Args:
        laps: green racing laps of this Grand Prix with the gap columns, in- and out-laps left out (`rsrl.laps.clean`).
        model: its pace model.
        noise_s: independent lap noise.
    """
    frame = laps.filter(pl.col("compound_c").is_not_null())
    frame = frame.with_columns(free_s=pl.Series(model.predict(frame) + model.stint_effects(frame)))
    loss, window = _dirty_air(frame)
    pairs = _pairs(frame)
    gap = _following_gap(pairs)
    threshold, scale = _passing(pairs, gap.value, noise_s, loss.value, window.value)
    blue, lapping = _lapping(frame)
    return TrafficFit(loss, window, gap, threshold, scale, PASS_LOSS, DRS_GAIN, DRS_WINDOW, blue, lapping)


def _dirty_air(frame: pl.DataFrame) -> tuple[Figure, Figure]:
    """Loss at zero gap and the gap where it ends, from laps begun 1.1 to 6 s behind a car on the same lap and not held by it.

    A lap counts where the car ended it more than 1.1 s behind too: one that closed up was free to be as quick as the air
    let it. What remains is that a car may choose to sit at such a gap, so this is an upper estimate.
    """
    near = frame.filter(
        (pl.col("lap") >= FIRST_LAP) & pl.col("gap_start_s").is_between(1.1, 6.0) & (pl.col("gap_ahead_s") > 1.1) & _same_lap()
    )
    if near.height < 60:
        return Figure(0.5, 0.3, 0, "too few laps in dirty air to fit: assumed"), Figure(2.5, 0.5, 0, "assumed")
    gap = near["gap_start_s"].to_numpy()
    extra = (near["lap_time_s"] - near["free_s"]).to_numpy()
    cars = near.select(*RACE, "driver").unique().height
    windows = np.arange(1.5, 6.01, 0.25)
    fits = [_fade(gap, extra, w) for w in windows]
    costs = np.array([cost for _, cost in fits])
    best = int(np.argmin(costs))
    close = windows[costs < costs[best] * (1 + 4.0 / cars)]  # residuals hang together within a car: cars are what counts
    noise = robust_sd(extra) / np.sqrt(cars)
    slope = float(np.sqrt(np.mean(np.maximum(1 - gap / windows[best], 0.0) ** 2)))
    note = "laps begun and ended more than 1.1 s behind another car, against the pace model"
    loss = Figure(max(fits[best][0], 0.0), float(noise / max(slope, 0.05)), near.height, note)
    return loss, Figure(float(windows[best]), float(np.ptp(close) / 4 + 0.12), near.height, note)


def _fade(gap: Array, extra: Array, window: float) -> tuple[float, float]:
    """Least absolute slope of the fading loss for a window, and the cost (sum of absolute residuals)."""
    x = np.maximum(1 - gap / window, 0.0)
    loss = float(np.sum(x * np.clip(extra, -1.5, 1.5)) / max(float(np.sum(x * x)), 1e-9))
    return loss, float(np.mean(np.abs(np.clip(extra, -1.5, 1.5) - loss * x)))


def _same_lap() -> pl.Expr:
    return pl.col("lap_ahead_start") == pl.col("lap") - 1


def _pairs(frame: pl.DataFrame) -> pl.DataFrame:
    """Car and the car ahead of it on the same lap, at the start of a lap on which neither pitted and all was green.

    Adds the other's `free_ahead_s`, `lap_time_ahead_s`, its end gap `end_gap_s` (negative: passed) and `passed`.
    """
    ahead = frame.select(
        *RACE,
        "lap",
        pl.col("driver").alias("driver_ahead_start"),
        pl.col("free_s").alias("free_ahead_s"),
        pl.col("session_time_s").alias("session_ahead_s"),
        pl.col("gap_start_s").alias("gap_start_ahead_s"),
        pl.col("lap_ahead_start").alias("lap_ahead_start_ahead"),
    )
    near = frame.filter((pl.col("lap") >= FIRST_LAP) & (pl.col("gap_start_s") < NEAR_S) & _same_lap())
    return near.join(ahead, on=[*RACE, "lap", "driver_ahead_start"]).with_columns(
        end_gap_s=pl.col("session_time_s") - pl.col("session_ahead_s"),
        passed=pl.col("session_time_s") < pl.col("session_ahead_s"),
    )


def _following_gap(pairs: pl.DataFrame) -> Figure:
    """Median end gap of cars begun within 1.5 s that the model would have brought level, and that stayed behind within 1.5 s."""
    held = pairs.filter(
        ~pl.col("passed") & (pl.col("end_gap_s") < 1.5) & (pl.col("gap_start_s") - (pl.col("free_ahead_s") - pl.col("free_s")) < 0.3)
    )
    if held.height < 15:
        return Figure(0.7, 0.3, 0, "too few held cars to fit: assumed")
    gaps = held["end_gap_s"].to_numpy()
    return Figure(float(np.median(gaps)), float(1.25 * np.std(gaps) / np.sqrt(len(gaps))), held.height)


def _passing(pairs: pl.DataFrame, following_s: float, noise_s: float, dirty_s: float, window_s: float) -> tuple[Figure, Figure]:
    """Threshold and scale of passing by maximum likelihood, with weak priors.

    As in the simulator, a follower whose own lap brings it to the other passes with probability
    logistic((advantage - threshold) / scale), otherwise it is held. That lap is not seen for a held car, so both cars' noise
    is integrated out; dirty air and DRS act as in the simulator. There it tries from `following_s` behind, but is seen to have passed
    only where it ends ahead; half that gap stands for both, which on simulated laps gives back the figures put in
    (tests/test_calibration_recovery.py).
    """
    if pairs.height < 50:
        raise RsrlError(f"only {pairs.height} laps of one car close behind another in this Grand Prix; add a season with --seasons")
    gap = pairs["gap_start_s"].to_numpy()
    gap_other = pairs["gap_start_ahead_s"].fill_null(99.0).to_numpy()
    same = (pairs["lap_ahead_start_ahead"] == pairs["lap"] - 1).fill_null(False).to_numpy()
    other = pairs["free_ahead_s"].to_numpy() + np.where(same, _air(gap_other, dirty_s, window_s), 0.0)
    advantage = other - pairs["free_s"].to_numpy() - _air(gap, dirty_s, window_s)
    nodes, weights = np.polynomial.hermite_e.hermegauss(41)
    weights = weights / weights.sum()
    raw = advantage[:, None] + np.sqrt(2.0) * noise_s * nodes[None, :]
    reaches = gap[:, None] - raw < following_s / 2
    passed = pairs["passed"].to_numpy()

    def cost(p: Array) -> float:
        chance = reaches / (1 + np.exp(-np.clip((raw - p[0]) / np.exp(p[1]), -40, 40)))
        total = np.clip(chance @ weights, 1e-4, 1 - 1e-4)  # one pass in ten thousand laps is a mistake or a team order
        prior = ((p[0] - THRESHOLD_PRIOR[0]) / THRESHOLD_PRIOR[1]) ** 2 + ((p[1] - LOG_SCALE_PRIOR[0]) / LOG_SCALE_PRIOR[1]) ** 2
        return float(-np.sum(np.where(passed, np.log(total), np.log1p(-total))) + prior / 2)

    best = minimize(cost, np.array([THRESHOLD_PRIOR[0], LOG_SCALE_PRIOR[0]]), method="Nelder-Mead")
    se = _curvature_errors(cost, best.x)
    note = f"{int(passed.sum())} passes in {len(gap)} laps begun within {NEAR_S:g} s, neither car pitting"
    scale = float(np.exp(best.x[1]))
    return Figure(float(best.x[0]), se[0], len(gap), note), Figure(scale, scale * se[1], len(gap), note)


def _air(gap: Array, dirty_s: float, window_s: float) -> Array:
    """Time lost to the car ahead, DRS included, as in the simulator."""
    drs = np.where(gap < DRS_WINDOW.value, DRS_GAIN.value, 0.0)
    return np.asarray(dirty_s * np.maximum(1 - gap / window_s, 0.0) - drs, dtype=np.float64)


def _curvature_errors(cost, at: Array) -> list[float]:  # type: ignore[no-untyped-def]
    """Standard errors from the second differences of a minus-log-posterior at its minimum."""
    h = 0.05
    n = len(at)
    hessian = np.zeros((n, n))
    for i in range(n):
        for j in range(n):
            ei, ej = np.eye(n)[i] * h, np.eye(n)[j] * h
            hessian[i, j] = (cost(at + ei + ej) - cost(at + ei - ej) - cost(at - ei + ej) + cost(at - ei - ej)) / (4 * h * h)
    return [float(v) for v in np.sqrt(np.maximum(np.diag(np.linalg.pinv(hessian)), 0.0))]


def _lapping(frame: pl.DataFrame) -> tuple[Figure, Figure]:
    """Time lost by a car on the lap on which it is lapped, and by the one that laps it, against its own laps around.

    A car is lapped where one that crossed the line within 10 s behind it, a lap or more ahead in the race, crosses before it next time.
    """
    crossings = frame.select(*RACE, "driver", "lap", "session_time_s")
    events = (
        crossings.join(crossings, on=RACE, suffix="_by")
        .filter((pl.col("lap_by") > pl.col("lap")) & ((pl.col("session_time_s_by") - pl.col("session_time_s")).is_between(-10.0, 0.0)))
        .join(
            crossings.select(*RACE, "driver", (pl.col("lap") + 1).alias("lap"), pl.col("session_time_s").alias("start_s")),
            on=[*RACE, "driver", "lap"],
        )
        .join(
            crossings.select(
                *RACE,
                pl.col("driver").alias("driver_by"),
                (pl.col("lap") + 1).alias("lap_by"),
                pl.col("session_time_s").alias("start_by_s"),
            ),
            on=[*RACE, "driver_by", "lap_by"],
        )
        .filter((pl.col("start_by_s") - pl.col("start_s")).is_between(0.0, 10.0))
    )
    extra = _against_neighbours(frame)
    lapped = events.select(*RACE, "driver", "lap").join(extra, on=[*RACE, "driver", "lap"])
    lapping = events.select(*RACE, pl.col("driver_by").alias("driver"), pl.col("lap_by").alias("lap")).join(
        extra, on=[*RACE, "driver", "lap"]
    )
    return _lapping_figure(lapped, Figure(1.0, 0.5, 0, "assumed")), _lapping_figure(lapping, Figure(0.3, 0.3, 0, "assumed"))


def _against_neighbours(frame: pl.DataFrame) -> pl.DataFrame:
    """Each lap's excess over the pace model less the same car's median excess on the eight laps around: `extra_s`."""
    keys = [*RACE, "driver"]
    excess = pl.col("lap_time_s") - pl.col("free_s")
    return (
        frame.sort(*keys, "lap")
        .with_columns(extra_s=excess - excess.rolling_median(window_size=9, min_samples=4, center=True).over(keys))
        .select(*keys, "lap", "extra_s")
        .drop_nulls()
    )


def _lapping_figure(events: pl.DataFrame, assumed: Figure) -> Figure:
    """Mean extra time per event (a lap with two of them counts once for each), laps with more than 4 s left out."""
    counted = events.group_by(*RACE, "driver", "lap").agg(pl.col("extra_s").first(), times=pl.len())
    per_event = (counted["extra_s"] / counted["times"]).to_numpy()
    per_event = per_event[np.abs(per_event) < 4.0]
    if len(per_event) < 10:
        return assumed
    value, se = float(np.mean(per_event)), float(np.std(per_event) / np.sqrt(len(per_event)))
    return Figure(max(value, 0.0), se, len(per_event), "laps on which it happened, against the same car's laps around")
