"""The standing start: what lap 1 costs, per grid place, its spread, and what each driver gains."""

from typing import Final, NamedTuple

import numpy as np
import polars as pl

from rsrl.calibration.design import Array, Design, fit
from rsrl.calibration.facts import RaceFacts
from rsrl.calibration.pace import PaceModel
from rsrl.errors import RsrlError
from rsrl.laps import RACE, with_status, with_stint_ages
from rsrl.season import Figure

PER_PLACE_PRIOR_S: Final = (0.13, 0.1)  # 0.11-0.14 s in Heilmeier et al. 2020
MIN_CARS: Final = 10
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

    Where this Grand Prix has no timed green first laps (a fault of the source in some races, or a safety car), those of all
    races stand in, and the figures' notes say so.

    Raises:
        RsrlError: no race has timed first laps.
    """
    firsts = _first_laps(table, facts)
    gains, within = _gains(firsts, season)
    spread = float(np.var([g.value for g in gains.values()])) if gains else 0.0
    here = firsts.join(model.laps.select(*RACE).unique(), on=RACE).filter(pl.col("compound_c").is_not_null())
    if here.height >= MIN_CARS:
        extra = here["lap_time_s"].to_numpy() - model.predict(here)
        note = f"lap 1 against the pace model, {here.height} cars; drivers' own spread over the season {within:.2f} s"
        return _fit(here, extra, note, gains, spread)
    if firsts.height < MIN_CARS:
        raise RsrlError(f"no race of the given seasons has {MIN_CARS} timed first laps under green; add a season with --seasons")
    extra = (firsts["lap_time_s"] - firsts["usual_s"]).to_numpy()
    return _fit(firsts, extra, "no timed green first lap here: those of all races given, against their lap 3 to 8", gains, spread)


def _fit(firsts: pl.DataFrame, extra: Array, note: str, gains: dict[str, Figure], gain_variance: float) -> StartFit:
    """Loss, slope over the grid and spread of lap 1; each race has its own loss, their mean is given."""
    races = firsts.select(pl.format("{}/{}", *RACE).alias("race"))["race"]
    centre = pl.DataFrame({"race": races, "extra": extra}).select(pl.col("extra").median().over("race"))["extra"].to_numpy()
    usual = np.abs(extra - centre) < WRECKED_S
    firsts, extra, races = firsts.filter(pl.Series(usual)), extra[usual], races.filter(pl.Series(usual))
    d = Design(firsts.height)
    for race in races.unique().sort():
        d.add(f"loss {race}", (races == race).to_numpy())
    d.add("place", firsts["grid"].to_numpy() - 1.0, *PER_PLACE_PRIOR_S)
    result = fit(d, extra, np.arange(firsts.height))
    loss, loss_se = result.combine({n: 1.0 / (len(d.names) - 1) for n in d.names if n.startswith("loss")})
    place, place_se = result.combine({"place": 1.0})
    sd = float(np.sqrt(max(result.sigma**2 - gain_variance, 0.05)))
    n = firsts.height
    return StartFit(
        Figure(max(loss, 0.0), loss_se, n, note),
        Figure(max(place, 0.0), place_se, n, note),
        Figure(sd, float(1.17 * sd / np.sqrt(n)), n, note),
        gains,
    )


def _first_laps(table: pl.DataFrame, facts: dict[tuple[int, int], RaceFacts]) -> pl.DataFrame:
    """Timed green first laps with the car's grid place and the race's `usual_s` lap; races with fewer than `MIN_CARS` are left out."""
    marked = with_status(with_stint_ages(table))
    early = marked.filter(pl.col("lap").is_between(3, 8) & (pl.col("status") == 0) & ~pl.col("in_lap") & ~pl.col("out_lap"))
    usual = early.group_by(*RACE).agg(usual_s=pl.col("lap_time_s").median())
    timed = (pl.col("lap") == 1) & (pl.col("status") == 0) & pl.col("lap_time_s").is_not_null() & ~pl.col("in_lap")
    laps = marked.filter(timed).join(usual, on=RACE)
    grid = pl.DataFrame(
        [(s, r, d, g) for (s, r), f in facts.items() for d, g in f.grid.items()],
        schema={"season": pl.Int64, "round": pl.Int64, "driver": pl.String, "grid": pl.Int64},
        orient="row",
    )
    return laps.join(grid, on=[*RACE, "driver"]).filter(pl.len().over(*RACE) >= MIN_CARS)


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
