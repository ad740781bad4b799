"""How far a driver's pace moves from race to race, from team mates: what a car likes of a track cancels out between them."""

from typing import Final

import numpy as np
import polars as pl

from rsrl.calibration.design import Design, fit
from rsrl.calibration.pace import FREE_AIR_S
from rsrl.laps import RACE
from rsrl.season import Figure

MIN_LAPS: Final = 15
PRIOR_SD_SHARE: Final = 0.0015  # of a lap: 0.14 s at Bahrain
PRIOR_PAIRS: Final = 6.0


def fit_form(laps: pl.DataFrame, season: int, base_lap_s: float) -> Figure:
    """Race-to-race spread of one car's pace, s, for the whole field.

    Args:
        laps: kept laps (`rsrl.laps.clean`) of every dry race of the seasons.
        season: the one used.
        base_lap_s: lap to which shares are scaled.

    In every race the pace of each driver is fitted with his compounds, tyre ages and fuel; the spread over the races of the difference of
    team mates, less what the fits leave uncertain, is that of two cars.
    """
    shares: list[float] = []
    noise: list[float] = []
    for _, race in laps.filter(pl.col("season") == season).group_by(*RACE, maintain_order=True):
        pace = _race_pace(race)
        for _, pair in pace.group_by("team", maintain_order=True):
            if pair.height == 2:
                shares.append(float(pair["pace"][0] - pair["pace"][1]) / float(race["lap_time_s"].median()))  # type: ignore[arg-type]
                noise.append(float(pair["se"].pow(2).sum()) / float(race["lap_time_s"].median()) ** 2)  # type: ignore[arg-type]
    frame = np.array(shares)
    if len(frame) < 10:
        value = PRIOR_SD_SHARE * base_lap_s
        return Figure(value, value / 2, 0, "assumed: too few races with both cars of a team")
    variance = float((1.4826 * np.median(np.abs(frame - np.median(frame)))) ** 2 - np.mean(noise)) / 2
    n = len(frame)
    pooled = (max(variance, 0.0) * n + PRIOR_SD_SHARE**2 * PRIOR_PAIRS) / (n + PRIOR_PAIRS)
    value = float(np.sqrt(pooled)) * base_lap_s
    return Figure(
        value, float(value / np.sqrt(2 * n)), n, "team mates' gap from race to race, all dry races of the season; one value for all"
    )


def _race_pace(race: pl.DataFrame) -> pl.DataFrame:
    """`driver, team, pace, se` in one race, drivers with `MIN_LAPS` only, by name within a team."""
    d = Design(race.height)
    d.add("lap", race["lap"].to_numpy())
    for compound in race["compound"].unique().sort():
        on = (race["compound"] == compound).to_numpy().astype(float)
        d.add(f"offset {compound}", on, 0.0, 1.0)
        d.add(f"wear {compound}", on * race["age_laps"].to_numpy(), 0.07, 0.1)
    names = race.group_by("driver", "team").len().filter(pl.col("len") >= MIN_LAPS).sort("team", "driver")
    for driver in race["driver"].unique().sort():
        d.add(driver, (race["driver"] == driver).to_numpy())
    weights = np.where(race["gap_start_s"].fill_null(99.0).to_numpy() > FREE_AIR_S, 1.0, 0.3)
    stints = (race["driver"] + race["stint_number"].cast(pl.String)).to_numpy()
    result = fit(d, race["lap_time_s"].to_numpy(), stints, weights, iterations=5)
    own = [result.names.index(driver) for driver in names["driver"]]
    centred = np.eye(len(result.names))[own] - np.eye(len(result.names))[own].mean(axis=0)
    ses = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", centred, result.cov, centred), 0.0))
    return names.with_columns(pace=pl.Series(result.beta[own]), se=pl.Series(ses))
