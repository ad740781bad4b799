"""Safety cars, virtual ones and retirements: hazards, durations, lap times under them; this Grand Prix shrunk towards all races."""

from collections.abc import Mapping
from typing import Final

import numpy as np
import polars as pl

from rsrl.calibration.design import robust_sd
from rsrl.calibration.facts import RaceFacts
from rsrl.laps import RACE, neutralised_laps, with_gaps, with_status, with_stint_ages
from rsrl.season import SC, VSC, Figure, IncidentFigures

TRACK_STRENGTH_RACES: Final = 6.0  # races of any track that weigh as much as one of this Grand Prix says about incidents
TEAM_STRENGTH_EVENTS: Final = 4.0  # prior retirements of a team at the field's rate
TRACK_STRENGTH_EVENTS: Final = 12.0  # prior retirements of this Grand Prix at the field's rate
AGEING: Final = "Heilmeier et al. 2020: tyres age x0.25 under SC, x0.5 under VSC"
MIN_RUNS: Final = 5
SC_LAPS: Final = (0.0, 0.182, 0.25, 0.227, 0.193, 0.057, 0.068, 0.023)  # Heilmeier et al. 2020
VSC_LAPS: Final = (0.479, 0.396, 0.021, 0.104)  # after the same source, which gives 1 to 4 laps
DURATION_PSEUDO: Final = 0.5  # added to each count of a duration up to the longest seen


def deployments(table: pl.DataFrame) -> pl.DataFrame:
    """One row per neutralisation: `season, round, lap` (first slow lap), `status`, `slow_laps`, `weight_laps`.

    A VSC that turns into a safety car is one safety car; so are two separated by a single lap. `weight_laps` is the sum of the
    laps' excess over green, in units of the usual excess (upper quartile of that status): a partly slow lap counts in part.
    """
    slow = neutralised_laps(table).filter(pl.col("status").is_in([VSC, SC])).with_columns(excess=pl.col("factor").fill_null(1.5) - 1.0)
    usual = slow.group_by("status").agg(usual=pl.col("excess").quantile(0.75))
    new = (pl.col("lap").diff().over(*RACE) > 2).fill_null(True)
    return (
        slow.join(usual, on="status")
        .sort(*RACE, "lap")
        .with_columns(run=new.cum_sum())
        .group_by("run", maintain_order=True)
        .agg(
            *(pl.col(c).first() for c in RACE),
            pl.col("lap").min(),
            pl.col("status").max(),
            slow_laps=pl.len(),
            weight_laps=(pl.col("excess") / pl.col("usual")).sum(),
        )
        .drop("run")
    )


def fit_incidents(table: pl.DataFrame, event_rounds: list[tuple[int, int]], base_over_green: float) -> IncidentFigures:
    """Fit everything about neutralisations.

    Args:
        table: lap table of all dry races of the seasons.
        event_rounds: (season, round) of this Grand Prix.
        base_over_green: base lap of the season file over the median green lap here: factors are given against the base lap.
    """
    runs = deployments(table)
    raced = table.group_by(*RACE).agg(laps=pl.col("lap").max())
    here = pl.DataFrame(event_rounds, schema={"season": pl.Int64, "round": pl.Int64}, orient="row")
    factors = _lap_factors(table)
    green = int(raced["laps"].sum()) - int(runs["slow_laps"].sum())
    return IncidentFigures(
        sc_lap1=_first_lap(runs, raced, here),
        sc_per_lap=_hazard(runs.filter((pl.col("status") == SC) & (pl.col("lap") > 2)), raced, here, green),
        vsc_per_lap=_hazard(runs.filter((pl.col("status") == VSC) & (pl.col("lap") > 2)), raced, here, green),
        sc_laps=_durations(runs.filter(pl.col("status") == SC), 10, SC_LAPS),
        vsc_laps=_durations(runs.filter(pl.col("status") == VSC), 5, VSC_LAPS),
        sc_lap_factor=_against_base(factors["sc"], base_over_green),
        sc_catch_factor=_against_base(factors["catch"], base_over_green),
        vsc_lap_factor=_against_base(factors["vsc"], base_over_green),
        sc_gap_s=factors["gap"],
        sc_wear_factor=Figure(0.25, 0.1, 0, AGEING),
        vsc_wear_factor=Figure(0.5, 0.15, 0, AGEING),
    )


def _first_lap(runs: pl.DataFrame, raced: pl.DataFrame, here: pl.DataFrame) -> Figure:
    """Probability that the start brings a safety car (laps 1 and 2 slow), this Grand Prix shrunk towards all races."""
    first = runs.filter((pl.col("status") == SC) & (pl.col("lap") <= 2))
    rate = (first.height + 0.5) / (raced.height + 1.0)
    own = first.join(here, on=RACE).height
    value = (own + TRACK_STRENGTH_RACES * rate) / (here.height + TRACK_STRENGTH_RACES)
    return Figure(value, float(np.sqrt(value * (1 - value) / raced.height)), raced.height, f"{first.height} in all races given, {own} here")


def _hazard(events: pl.DataFrame, raced: pl.DataFrame, here: pl.DataFrame, green_laps: int) -> Figure:
    """Gamma-Poisson: events per green lap here, with all races as a prior worth `TRACK_STRENGTH_RACES` of them."""
    rate = (events.height + 0.5) / green_laps
    own_laps = float(raced.join(here, on=RACE)["laps"].sum())
    own = events.join(here, on=RACE).height
    prior_laps = TRACK_STRENGTH_RACES * green_laps / raced.height
    value = (own + rate * prior_laps) / (own_laps + prior_laps)
    se = float(np.hypot(np.sqrt(max(own, 0.5)) / (own_laps + prior_laps), value / np.sqrt(events.height + 0.5)))
    return Figure(value, se, events.height, f"{events.height} in {green_laps} green laps of all races given, {own} here")


def _durations(runs: pl.DataFrame, longest: int, published: tuple[float, ...]) -> tuple[float, ...]:
    """Shares of 1, 2, ... laps; the published ones where fewer than `MIN_RUNS` were seen."""
    if runs.height < MIN_RUNS:
        return published
    laps = np.clip(np.rint(runs["weight_laps"].to_numpy()), 1, longest).astype(int)
    counts = np.bincount(laps, minlength=2)[1:] + DURATION_PSEUDO
    shares = np.round(counts / counts.sum(), 4)
    shares[-1] = round(1.0 - float(shares[:-1].sum()), 4)
    return tuple(float(s) for s in shares)


def _lap_factors(table: pl.DataFrame) -> dict[str, Figure]:
    """Lap times under neutralisation over the race's median green lap, and the gap between queuing cars.

    The leader's second and later laps behind the safety car; laps of cars 3-10 s behind the next one (closing up) on the first
    two laps; the upper quartile of laps of VSC, as most are under it for a part only.
    """
    laps = with_status(with_gaps(with_stint_ages(table))).filter(~pl.col("in_lap") & ~pl.col("out_lap"))
    green = laps.filter((pl.col("status") == 0) & (pl.col("lap") > 1)).group_by(*RACE).agg(green_s=pl.col("lap_time_s").median())
    slow = neutralised_laps(table).rename({"status": "race_status"})
    first = (pl.col("lap").diff() != 1).fill_null(True)
    slow = slow.sort(*RACE, "lap").with_columns(run=first.cum_sum().over(*RACE))
    slow = slow.with_columns(nth=(pl.col("lap") - pl.col("lap").min() + 1).over(*RACE, "run"))
    laps = laps.join(slow, on=[*RACE, "lap"]).join(green, on=RACE).with_columns(ratio=pl.col("lap_time_s") / pl.col("green_s"))
    behind = laps.filter((pl.col("race_status") == SC) & pl.col("ratio").is_not_null())
    queue = behind.filter((pl.col("nth") >= 3) & (pl.col("position") > 1) & (pl.col("gap_ahead_s") < 3.0))
    vsc = laps.filter((pl.col("race_status") == VSC) & pl.col("ratio").is_not_null())["ratio"].to_numpy()
    closing = behind.filter(
        (pl.col("nth") <= 2) & pl.col("gap_start_s").is_between(3.0, 15.0) & (pl.col("gap_ahead_s") < pl.col("gap_start_s"))
    )
    queue_lead = behind.filter((pl.col("nth") >= 2) & (pl.col("position") == 1))["ratio"].to_numpy()
    return {
        "sc": _quantile_figure(queue_lead, 0.5, "leader's laps behind the SC", 1.6),
        "catch": _quantile_figure(closing["ratio"].to_numpy(), 0.5, "cars closing up to the queue", 1.4),
        "vsc": _quantile_figure(vsc, 0.75, "whole laps of VSC", 1.4),
        "gap": _quantile_figure(queue["gap_ahead_s"].to_numpy(), 0.5, "queuing cars at the line", 0.8),
    }


def _quantile_figure(values: np.ndarray, q: float, what: str, assumed: float) -> Figure:
    """Quantile with its standard error; the laps of one deployment hang together, so about ten of them count as one."""
    if len(values) < 10:
        return Figure(assumed, 0.15, 0, f"{what}: too few, Heilmeier et al. 2020 taken")
    se = 1.36 * robust_sd(values) / np.sqrt(max(len(values) / 10, 1))
    return Figure(float(np.quantile(values, q)), float(se), len(values), f"{what}, all races given")


def _against_base(factor: Figure, base_over_green: float) -> Figure:
    return Figure(factor.value / base_over_green, factor.se / base_over_green, factor.n, factor.note)


def retirement_hazards(
    table: pl.DataFrame, facts: Mapping[tuple[int, int], RaceFacts], season: int, event_rounds: list[tuple[int, int]]
) -> dict[str, Figure]:
    """Hazard per lap of each team of `season`: gamma-Poisson towards the field, times this Grand Prix's own factor, likewise shrunk."""
    cars = table.group_by(*RACE, "driver", "team").agg(laps=pl.len())
    out = pl.DataFrame(
        [(s, r, d) for (s, r), f in facts.items() for d in sorted(f.retired)],
        schema={"season": pl.Int64, "round": pl.Int64, "driver": pl.String},
        orient="row",
    ).with_columns(out=1)
    cars = cars.join(out, on=[*RACE, "driver"], how="left").with_columns(pl.col("out").fill_null(0))
    rate = (float(cars["out"].sum()) + 0.5) / float(cars["laps"].sum())
    here = pl.concat([cars.filter((pl.col("season") == s) & (pl.col("round") == r)) for s, r in event_rounds])
    expected = rate * float(here["laps"].sum())
    track = (float(here["out"].sum()) + TRACK_STRENGTH_EVENTS) / (expected + TRACK_STRENGTH_EVENTS)
    teams = cars.filter(pl.col("season") == season).group_by("team").agg(pl.col("out").sum(), pl.col("laps").sum()).sort("team")
    figures = {}
    for team, events, laps in teams.iter_rows():
        shape = events + TEAM_STRENGTH_EVENTS
        value = track * shape / (laps + TEAM_STRENGTH_EVENTS / rate)
        note = f"{events} retirements of the team in the season's dry races; this Grand Prix x{track:.2f}"
        figures[team] = Figure(float(value), float(value / np.sqrt(shape)), int(laps), note)
    return figures
