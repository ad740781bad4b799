"""Pit-lane loss under green, VSC and SC, the heavy tail of stop times, cold tyres, and how teams differ."""

from math import gamma
from typing import Final, NamedTuple

import numpy as np
import polars as pl
from scipy.optimize import minimize

from rsrl.calibration.design import Array, Design, fit, robust_sd
from rsrl.calibration.pace import PaceModel
from rsrl.calibration.stops import green_stops, stop_table
from rsrl.errors import RsrlError
from rsrl.laps import RACE
from rsrl.season import COMPOUNDS, Figure, PitFigures

COLD_PRIOR_S: Final = (1.0, 0.3)  # out-lap on cold tyres, Bayesian fit in the literature
COLD_CONTRAST_SD_S: Final = 0.4
RATIO_VSC: Final = (20 / 28, 0.1)  # published for Singapore: green 28 s, VSC 20 s, SC 15 s
RATIO_SC: Final = (15 / 28, 0.1)
SLOW: Final = 1.12
CLEAR_S: Final = 1.5  # an out-lap that ends closer to another car was held up
MIN_STOPS: Final = 8
TAIL_MAX_S: Final = 40.0


class PitFit(NamedTuple):
    """Pit figures, cold-lap loss by letter, and each team's stops against the average."""

    figures: PitFigures
    cold_s: dict[str, Figure]
    team_s: dict[str, Figure]


def fit_pit(table: pl.DataFrame, model: PaceModel, event_rounds: list[tuple[int, int]]) -> PitFit:
    """Fit the pit figures.

    Args:
        table: lap table of every dry race of the seasons; other races serve the stop-time tail, the teams and the ratios.
        model: pace model of this Grand Prix, for what a lap would have cost without the stop.
        event_rounds: (season, round) of this Grand Prix.
    """
    stops = stop_table(table)
    green = green_stops(stops)
    excess, per_race = stop_excess(green)
    if len(excess) < MIN_STOPS:
        raise RsrlError(
            "no race of the given seasons has enough green-flag stops for the spread of stop times; add a season with --seasons"
        )
    scale, shape = fit_tail(excess, per_race)
    here = pl.concat([green.filter((pl.col("season") == s) & (pl.col("round") == r)) for s, r in event_rounds])
    if here.height < MIN_STOPS:
        raise RsrlError(f"only {here.height} green-flag stops of this Grand Prix in the lap files; add a season with --seasons")
    loss, cold = _green_loss(here, model, float(scale.value))
    vsc = _combine(_event_ratios(stops, green, 1), RATIO_VSC)
    sc = _combine(_event_ratios(stops, green, 2), RATIO_SC)
    figures = PitFigures(
        loss_green_s=loss,
        loss_vsc_s=_scaled(loss, vsc, "VSC"),
        loss_sc_s=_scaled(loss, sc, "SC"),
        tail_scale_s=scale,
        tail_shape=shape,
        tail_max_s=Figure(TAIL_MAX_S, 10.0, len(excess), "longer stops are repairs, which no plan foresees"),
    )
    return PitFit(figures, cold, _team_losses(green, model.season))


def stop_excess(green: pl.DataFrame) -> tuple[Array, Array]:
    """Pit-lane time of each green stop beyond its race's quickest, and the stops of that race.

    Races with fewer than eight stops are left out, and so are stops of 15 s more: repairs and penalties.
    """
    lanes = green.drop_nulls("lane_s").filter(pl.len().over(*RACE) >= MIN_STOPS)
    lanes = lanes.with_columns(excess=pl.col("lane_s") - pl.col("lane_s").min().over(*RACE), stops=pl.len().over(*RACE))
    lanes = lanes.filter(pl.col("excess") < 15.0)
    return lanes["excess"].to_numpy().astype(np.float64), lanes["stops"].to_numpy().astype(np.float64)


def fit_tail(excess: Array, stops: Array) -> tuple[Figure, Figure]:
    """Scale and shape of a log-logistic distribution of the time beyond the quickest stop possible, by maximum likelihood.

    The quickest of n stops is itself above the quickest possible, by about scale x n ** (-1 / shape) x gamma(1 + 1 / shape)
    (the mean of the Weibull law that minima follow), which is added back; figures and shift are found together. Standard errors are
    those of the law's Fisher information.
    """
    scale, shape = 1.0, 2.0
    for _ in range(40):
        values = excess + scale * stops ** (-1 / shape) * gamma(1 + 1 / shape)

        def loss(p: Array, values: Array = values) -> float:
            z = (np.log(values) - p[0]) * np.exp(p[1])
            return float(-np.sum(p[1] + z - np.log(values) - 2 * np.logaddexp(0.0, z)))

        best = minimize(loss, np.array([np.log(scale), np.log(shape)]), method="BFGS")
        scale, shape = float(np.exp(best.x[0])), float(np.exp(best.x[1]))
    note = "green stops of all dry races given, beyond each race's quickest"
    n = len(excess)
    scale_se, shape_se = scale * np.sqrt(3 / n) / shape, shape * np.sqrt(9 / (3 + np.pi**2) / n)
    return Figure(scale, float(scale_se), n, note), Figure(shape, float(shape_se), n, note)


def _green_loss(stops: pl.DataFrame, model: PaceModel, typical_excess_s: float) -> tuple[Figure, dict[str, Figure]]:
    """Loss of the quickest stop and the cold lap by compound: both laps of a stop against the model's laps without it.

    Only loss + cold lap is measured; contrasts between compounds are too. What share is cold tyre comes from the prior.
    """
    fitted = stops.filter(pl.col("compound_c").is_not_null() & pl.col("compound_c_out").is_not_null())
    clear = fitted.filter(pl.col("out_gap_s").fill_null(99.0) > CLEAR_S)
    fitted = clear if clear.height >= MIN_STOPS else fitted
    extra = fitted["in_s"].to_numpy() + fitted["out_s"].to_numpy() - _without_stop(fitted, model)
    d = Design(fitted.height)
    d.add("loss", np.ones(fitted.height))
    d.add("cold", np.ones(fitted.height), *COLD_PRIOR_S)
    for letter, c in model.c_numbers.items():
        d.add(f"cold {letter}", (fitted["compound_c_out"] == c).to_numpy(), 0.0, COLD_CONTRAST_SD_S)
    cars = (fitted["season"].cast(pl.String) + fitted["driver"]).to_numpy()
    result = fit(d, extra, cars)
    value, se = result.combine({"loss": 1.0})
    note = f"in-lap and out-lap against the pace model, less the typical stop's excess {typical_excess_s:.2f} s and the cold lap"
    cold = {letter: _cold(result.combine({"cold": 1.0, f"cold {letter}": 1.0}), fitted, c) for letter, c in model.c_numbers.items()}
    return Figure(value - typical_excess_s, se, fitted.height, note), {c: cold[c] for c in COMPOUNDS}


def _cold(value: tuple[float, float], stops: pl.DataFrame, c: str) -> Figure:
    n = stops.filter(pl.col("compound_c_out") == c).height
    return Figure(value[0], value[1], n, "level from literature (1.0 +- 0.3 s), contrasts between compounds from out-laps")


def _without_stop(stops: pl.DataFrame, model: PaceModel) -> Array:
    """The in-lap on the old tyre in its traffic and a free out-lap on the new one at age zero: the pace model without a stop."""
    before = model.predict(stops) + model.traffic(stops)
    after = model.predict(
        stops.with_columns(pl.col("compound_c_out").alias("compound_c"), lap=pl.col("lap") + 1, age_laps=pl.lit(0, dtype=pl.Int64))
    )
    return np.asarray(before + after, dtype=np.float64)


def _event_ratios(stops: pl.DataFrame, green: pl.DataFrame, status: int) -> Array:
    """Loss under a neutralisation over the race's green loss: one median per race and lap on which cars stopped."""
    normal = green.group_by(*RACE).agg(normal_s=pl.col("loss_s").median(), stops=pl.len()).filter(pl.col("stops") >= 4)
    slow = stops.filter(
        (pl.col("status") == status)
        & (pl.col("slow_in") > SLOW)
        & (pl.col("slow_out") > SLOW)
        & (pl.col("status_out") == status)
        & (pl.col("lane_s") < 40.0)
    )
    first = slow.filter(pl.col("lap") == pl.col("lap").min().over(*RACE)) if status == 2 else slow
    ratios = first.join(normal, on=RACE).with_columns(ratio=pl.col("loss_s") / pl.col("normal_s"))
    return np.asarray(ratios.group_by(*RACE, "lap").agg(pl.col("ratio").median()).sort(*RACE, "lap")["ratio"].to_numpy(), dtype=np.float64)


def _combine(ratios: Array, prior: tuple[float, float]) -> tuple[float, float, int]:
    """Precision-weighted mean of the events' median ratio and the published one."""
    n = len(ratios)
    if n < 3:
        return prior[0], prior[1], n
    se = 1.25 * max(robust_sd(ratios), 0.1) / np.sqrt(n)
    weight = se**-2 / (se**-2 + prior[1] ** -2)
    return float(weight * np.median(ratios) + (1 - weight) * prior[0]), float((se**-2 + prior[1] ** -2) ** -0.5), n


def _scaled(loss: Figure, ratio: tuple[float, float, int], what: str) -> Figure:
    note = f"green loss x {ratio[0]:.2f}: {what} stops of {ratio[2]} laps in all races given, and the ratio published for Singapore"
    return Figure(loss.value * ratio[0], float(np.hypot(loss.se * ratio[0], loss.value * ratio[1])), ratio[2], note)


def _team_losses(green: pl.DataFrame, season: int) -> dict[str, Figure]:
    """Each team's pit-lane time against its race's median over a season, shrunk towards zero by its reliability."""
    own = green.filter((pl.col("season") == season) & (pl.len().over(*RACE) >= 8)).drop_nulls("lane_s")
    own = own.with_columns(extra=pl.col("lane_s") - pl.col("lane_s").median().over(*RACE)).filter(pl.col("extra") < 5.0)
    teams = own.group_by("team").agg(mean=pl.col("extra").median(), n=pl.len(), sd=pl.col("extra").std()).sort("team")
    means = teams["mean"].to_numpy() - float(np.mean(teams["mean"].to_numpy()))
    noise = (1.25 * teams["sd"].fill_null(1.0).to_numpy()) ** 2 / teams["n"].to_numpy()
    between = max(float(np.var(means) - np.mean(noise)), 1e-3)
    keep = between / (between + noise)
    ses = np.sqrt(keep * noise)
    return {
        team: Figure(float(k * m), float(s), int(n)) for team, k, m, s, n in zip(teams["team"], keep, means, ses, teams["n"], strict=True)
    }
