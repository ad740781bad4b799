"""The standing start of one race: what lap 1 costs, per grid place, its spread, and each driver's part."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import polars as pl

from rsrl.calibration.race.design import Array, Design, fit
from rsrl.calibration.race.pace_and_tyres import PaceModel
from rsrl.laps import with_status, with_stint_ages
from rsrl.season import COMPOUNDS, Figure

PER_PLACE_PRIOR_S: Final = (0.2, 0.2)  # 0.11-0.14 s in Heilmeier et al. 2020, 0.4 s in 2022-23
LAUNCHES: Final = ("S", "H")
FEWEST_LAUNCHES: Final = 2  # cars on each of two compounds
MIN_CARS: Final = 10
WRECKED_S: Final = 15.0  # beyond the expected first lap by this much: contact, a spin, a stop


@dataclass(frozen=True)
class StartAnalysis:
    """Lap 1 of one race against the pace model."""

    loss_s: Figure
    per_place_s: Figure
    sd_s: Figure
    launch_s: dict[str, Figure]  # soft and hard against medium, beyond what they are worth on a flying lap; absent where too few started so
    left_s: dict[str, float]  # each driver's first lap against the line through the field, wrecked ones left out


def analyse_start(race: pl.DataFrame, model: PaceModel, grid: dict[str, int]) -> StartAnalysis | None:
    """Fit lap 1; None where it is not timed (a fault of the source in some races) or not green for ten cars."""
    marked = with_status(with_stint_ages(race))
    timed = (pl.col("lap") == 1) & (pl.col("status") == 0) & pl.col("lap_time_s").is_not_null() & ~pl.col("in_lap")
    firsts = marked.filter(timed & pl.col("compound").is_in(list(COMPOUNDS)) & pl.col("driver").is_in(list(grid)))
    if firsts.height < MIN_CARS:
        return None
    extra = firsts["lap_time_s"].to_numpy() - model.predict(firsts)
    usual = np.abs(extra - np.median(extra)) < WRECKED_S
    firsts, extra = firsts.filter(pl.Series(usual)), extra[usual]
    if firsts.height < MIN_CARS:
        return None
    drivers = firsts["driver"].to_list()
    d = Design(firsts.height)
    d.add("loss", np.ones(firsts.height))
    d.add("place", np.array([grid[x] for x in drivers]) - 1.0, *PER_PLACE_PRIOR_S)
    result = fit(d, extra, np.arange(firsts.height))
    n = firsts.height
    loss, place = result.combine({"loss": 1.0}), result.combine({"place": 1.0})
    sd = max(result.sigma, 0.2)
    left = {x: float(v) for x, v in zip(drivers, result.residuals, strict=True) if abs(v) < WRECKED_S / 2}
    return StartAnalysis(
        Figure(*loss, n), Figure(*place, n), Figure(sd, float(1.17 * sd / np.sqrt(n)), n), _launches(firsts, result.residuals, sd), left
    )


def _launches(firsts: pl.DataFrame, residuals: Array, sd: float) -> dict[str, Figure]:
    """What cars on softs and hards lost on lap 1 against those on mediums, beyond place and compound, s; below zero: gained."""
    letters = firsts["compound"].to_numpy()
    counts = {c: int((letters == c).sum()) for c in COMPOUNDS}
    medium = counts["M"]
    found = {}
    for c in LAUNCHES:
        if min(counts[c], medium) >= FEWEST_LAUNCHES:
            gap = float(residuals[letters == c].mean() - residuals[letters == "M"].mean())
            found[c] = Figure(gap, sd * float(np.sqrt(1 / counts[c] + 1 / medium)), counts[c])
    return found
