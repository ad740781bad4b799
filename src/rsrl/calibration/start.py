"""The standing start: what lap 1 costs, per grid place, its spread, and what each driver gains."""

from typing import Final, NamedTuple

import numpy as np
import polars as pl

from rsrl.calibration.design import Design, fit
from rsrl.calibration.facts import RaceFacts
from rsrl.calibration.pace import PaceModel
from rsrl.errors import RsrlError
from rsrl.laps import RACE, with_status, with_stint_ages
from rsrl.season import Figure

PER_PLACE_PRIOR_S: Final = (0.13, 0.1)  # 0.11-0.14 s in Heilmeier et al. 2020
WRECKED_S: Final = 15.0  # beyond the expected first lap by this much: contact, a spin, a stop


class StartFit(NamedTuple):
    """Figures of the start; `gains` by driver."""

    loss_s: Figure
    per_place_s: Figure
    sd_s: Figure
    gains_s: dict[str, Figure]


def fit_start(table: pl.DataFrame, model: PaceModel, facts: dict[tuple[int, int], RaceFacts], season: int) -> StartFit:
    """Fit lap 1 of this Grand Prix.

    Args:
        table: lap table of every dry race of the seasons.
        model: pace model of this Grand Prix.
        facts: grid of every race, by (season, round); driver gains come from all of `season`, the rest from this Grand Prix.
        season: whose drivers' gains are wanted.

    Raises:
        RsrlError: no first lap of this Grand Prix has a time.
    """
    firsts = _first_laps(table, facts)
    here = firsts.join(model.laps.select(*RACE).unique(), on=RACE)
    here = here.filter(pl.col("compound_c").is_not_null())
    if here.height < 10:
        raise RsrlError(f"only {here.height} first laps of this Grand Prix have a time; add a season with --seasons")
    extra = here["lap_time_s"].to_numpy() - model.predict(here)
    usual = np.abs(extra - np.median(extra)) < WRECKED_S
    here, extra = here.filter(pl.Series(usual)), extra[usual]
    d = Design(here.height)
    for y in here["season"].unique().sort():
        d.add(f"loss {y}", here["season"].to_numpy() == y)
    d.add("place", here["grid"].to_numpy() - 1.0, *PER_PLACE_PRIOR_S)
    result = fit(d, extra, np.arange(here.height))
    weighted = {n: 1.0 / (len(d.names) - 1) for n in d.names if n.startswith("loss")}
    loss, loss_se = result.combine(weighted)
    place, place_se = result.combine({"place": 1.0})
    gains, within = _gains(firsts, season)
    sd = max(result.sigma**2 - float(np.var([g.value for g in gains.values()])), 0.05) ** 0.5
    note = f"lap 1 against the pace model, {here.height} cars; drivers' own spread over the season {within:.2f} s"
    return StartFit(
        Figure(loss, loss_se, here.height, note),
        Figure(place, place_se, here.height),
        Figure(float(sd), float(sd / np.sqrt(2 * here.height)), here.height),
        gains,
    )


def _first_laps(table: pl.DataFrame, facts: dict[tuple[int, int], RaceFacts]) -> pl.DataFrame:
    """Timed green first laps with the grid place of their car; races whose start was neutralised or has few times are left out."""
    laps = with_status(with_stint_ages(table)).filter(
        (pl.col("lap") == 1) & (pl.col("status") == 0) & pl.col("lap_time_s").is_not_null() & ~pl.col("in_lap")
    )
    grid = pl.DataFrame(
        [(s, r, d, g) for (s, r), f in facts.items() for d, g in f.grid.items()],
        schema={"season": pl.Int64, "round": pl.Int64, "driver": pl.String, "grid": pl.Int64},
        orient="row",
    )
    return laps.join(grid, on=[*RACE, "driver"]).filter(pl.len().over(*RACE) >= 10)


def _gains(firsts: pl.DataFrame, season: int) -> tuple[dict[str, Figure], float]:
    """Each driver's first laps of the season against the line through the field, shrunk; and their typical spread, s.

    Slow cars also lose pace on lap 1, which the grid place carries: it is what is left beyond that.
    """
    rows: list[tuple[str, float]] = []
    for _, race in firsts.filter(pl.col("season") == season).group_by(*RACE, maintain_order=True):
        d = Design(race.height)
        d.add("loss", np.ones(race.height))
        d.add("place", race["grid"].to_numpy() - 1.0, *PER_PLACE_PRIOR_S)
        left = fit(d, race["lap_time_s"].to_numpy(), np.arange(race.height)).residuals
        rows += [(driver, float(x)) for driver, x in zip(race["driver"], left, strict=True) if abs(x) < WRECKED_S / 2]
    frame = pl.DataFrame(rows, schema={"driver": pl.String, "left": pl.Float64}, orient="row")
    if frame.height < 40:
        return {}, 0.0
    cars = frame.group_by("driver").agg(mean=pl.col("left").median(), n=pl.len()).sort("driver")
    within = float(1.4826 * (frame["left"] - frame["left"].median()).abs().median())  # type: ignore[arg-type,operator]
    noise = 1.57 * within**2 / cars["n"].to_numpy()  # variance of a median
    between = max(float(np.var(cars["mean"].to_numpy()) - np.mean(noise)), 1e-3)
    keep = between / (between + noise)
    note = "first laps of the season against the line through the field, shrunk"
    gains = {
        driver: Figure(float(k * m), float(np.sqrt(k * e)), int(n), note)
        for driver, k, m, e, n in zip(cars["driver"], keep, cars["mean"], noise, cars["n"], strict=True)
    }
    return gains, within
