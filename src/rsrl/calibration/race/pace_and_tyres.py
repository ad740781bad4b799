"""The pace model of one race: lap time in free air from car, driver, tyre and fuel.

lap time = team + driver + compound offset + wear x age + gain x share of the race left + stint (random) + traffic (nuisance) + noise

`gain` is what makes laps quicker over the race: fuel burned and an improving track. Within a stint it looks like negative wear; stops
separate the two, since tyre age starts again at a stop and the gain does not. One race says little about it, so the figures that races
share are fitted twice: with the priors below, for what needs a whole model of this race (pace, traffic, stops), and almost without
priors, as a vector with its covariance, for pooling (`rsrl.calibration.pooling.tyre`).
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
import polars as pl

from rsrl.calibration.compounds import REFERENCE_KM, hardness, lap_km
from rsrl.calibration.race.design import Array, Design, LinearFit, fit
from rsrl.season import COMPOUNDS, Figure

GAIN_PRIOR_S: Final = (3.4, 1.2)  # 110 kg x 0.031 s at 5.2 km a lap; what the track gains may go either way
OFFSET_STEP_S: Final = 0.5  # per C-number, softer is quicker: Pirelli's usual estimate between neighbours
OFFSET_SD_S: Final = 0.35
WEAR_PRIOR: Final = (0.06, 0.04)  # medium, s per lap: wear after 15 laps is 0.73 / 1.26 / 1.28 s (hard, medium, soft) in the literature
WEAR_STEP_S: Final = 0.015  # per C-number softer, same source
WEAR_SD_S: Final = 0.03  # a compound off that line
WEAK: Final = 20.0  # how much wider the priors are for what is pooled later
TEAM_SD_S: Final = 1.5
DRIVER_SD_S: Final = 0.3  # driver against his team mate
STINT_SD_S: Final = 0.2  # where the estimate begins
FREE_AIR_S: Final = 2.5
TRAFFIC_WEIGHT: Final = 0.15  # of a lap behind another car, which shows little of the car's own pace
GAP_BINS_S: Final = ((0.0, 1.0), (1.0, 1.5), (1.5, 2.0), (2.0, 2.5), (2.5, 3.5))
MAX_INFLATION: Final = 4.0
NORMAL_RANGE: Final = 3.29  # between the 5 and 95 % quantiles of a standard normal
FREE_AIR: Final = (
    (pl.col("gap_start_s").fill_null(99.0) > FREE_AIR_S)
    & ((pl.col("driver_ahead") == pl.col("driver_ahead_start")) | (pl.col("gap_ahead_s") > FREE_AIR_S)).fill_null(True)
).alias("free")
"""Laps in free air: nobody close ahead at the start, and nobody came past, since letting a car by costs time too."""

_STINT: Final = pl.format("stint {} {}", "driver", "stint_number")


@dataclass(frozen=True)
class PaceModel:
    """Fitted pace model of one race."""

    fit: LinearFit
    race_laps: int
    c_numbers: dict[str, str]  # colour letter to C-number
    season: int
    stint_sd_s: float
    inflation: float  # of variances, for the correlation of neighbouring residuals
    laps: pl.DataFrame  # the laps fitted, with `residual_s`

    def predict(self, frame: pl.DataFrame) -> Array:
        """Free-air lap time of each row (team, driver, lap, compound, age_laps); cold tyres, stint and start left out."""
        design = _design(frame, self.race_laps, self.c_numbers, self.season, 1.0)
        return np.column_stack([self.fit.value(n) * c for n, c in zip(design.names, design.columns, strict=True)]).sum(axis=1)

    def traffic(self, frame: pl.DataFrame) -> Array:
        """What the car ahead costs on average, by `gap_start_s`."""
        gap = frame["gap_start_s"].fill_null(99.0).to_numpy()
        costs = [self.fit.value(f"gap {low}") * ((gap >= low) & (gap < high)) for low, high in GAP_BINS_S]
        return np.asarray(np.sum(costs, axis=0), dtype=np.float64)

    def stint_effects(self, frame: pl.DataFrame) -> Array:
        """Stint effect of each row, s; zero for a stint not in the fit."""
        effect = dict(zip(self.fit.names, self.fit.beta.tolist(), strict=True))
        names = frame.select(_STINT.alias("stint"))["stint"]
        return np.array([effect.get(name, 0.0) for name in names], dtype=np.float64)

    def figure(self, terms: dict[str, float], n: int) -> Figure:
        """A combination of coefficients."""
        value, se = self.fit.combine(terms)
        return Figure(value, se, n)


def fit_pace(
    laps: pl.DataFrame, race_laps: int, c_numbers: dict[str, str], weak: bool = False, stint_sd_s: float | None = None
) -> PaceModel:
    """Fit the pace model.

    Args:
        laps: kept laps of `rsrl.laps.clean` of one race, of compounds S, M and H.
        race_laps: its distance.
        c_numbers: C-number by colour letter.
        weak: leave the priors of tyres and gain out, but for `WEAK` times their width.
        stint_sd_s: spread of stints; None: estimated, by alternating with the fit.
    """
    season = int(laps["season"][0])
    sd = STINT_SD_S if stint_sd_s is None else stint_sd_s
    y = laps["lap_time_s"].to_numpy()
    free = laps.select(FREE_AIR)["free"].to_numpy()
    weights = np.where(free, 1.0, TRAFFIC_WEIGHT)
    stints = laps.select(_STINT.alias("stint"))["stint"]
    for _ in range(1 if stint_sd_s is not None else 6):
        design = _design(laps, race_laps, c_numbers, season, WEAK if weak else 1.0)
        _add_nuisance(design, laps, stints, sd)
        fitted = fit(design, y, stints.to_numpy(), weights, iterations=6)
        at = [i for i, name in enumerate(fitted.names) if name.startswith("stint ")]
        used = sd
        if stint_sd_s is None:  # one step of expectation-maximisation, clipped for the odd damaged car
            step = float(np.mean(np.clip(fitted.beta[at] ** 2, 0.0, 0.6) + np.diag(fitted.model_cov)[at]))
            sd = float(np.sqrt(max(step, 1e-3)))
    inflation = _inflation(laps, fitted.residuals, free)
    fitted = fitted.with_cov(fitted.model_cov * inflation)
    residual = pl.Series("residual_s", fitted.residuals)
    return PaceModel(fitted, race_laps, c_numbers, season, used, inflation, laps.with_columns(residual))


def _inflation(laps: pl.DataFrame, residuals: Array, free: Array) -> float:
    """(1 + r) / (1 - r) of the correlation r of neighbouring free-air residuals: what a mean's variance is multiplied by."""
    keys = ["driver", "stint_number"]
    steps = (
        laps.select(*keys, "lap", left=pl.Series(residuals), free=pl.Series(free))
        .sort(*keys, "lap")
        .with_columns(
            before=pl.col("left").shift(1).over(keys), apart=pl.col("lap").diff().over(keys), both=pl.col("free").shift(1).over(keys)
        )
        .filter((pl.col("apart") == 1) & pl.col("free") & pl.col("both"))
    )
    if steps.height < 50:
        return 2.0
    a, b = np.clip(steps["left"].to_numpy(), -1, 1), np.clip(steps["before"].to_numpy(), -1, 1)
    r = float(np.clip(np.mean(a * b) / max(float(np.mean(a * a)), 1e-9), 0.0, 0.9))
    return min((1 + r) / (1 - r), MAX_INFLATION)


def _design(laps: pl.DataFrame, race_laps: int, c_numbers: dict[str, str], season: int, width: float) -> Design:
    d = Design(laps.height)
    d.add("level", np.ones(laps.height))
    for kind, sd in (("team", TEAM_SD_S), ("driver", DRIVER_SD_S)):
        for name in laps[kind].unique().sort():
            d.add(f"{kind} {name}", (laps[kind] == name).to_numpy(), 0.0, sd)
    km = lap_km(race_laps) / REFERENCE_KM
    d.add("gain", share_left(laps, race_laps), GAIN_PRIOR_S[0] * km, GAIN_PRIOR_S[1] * km * width)
    age = laps["age_laps"].to_numpy().astype(np.float64)
    middle = hardness(c_numbers["M"], season)
    for letter in COMPOUNDS:
        on = (laps["compound"] == letter).to_numpy().astype(np.float64)
        step = hardness(c_numbers[letter], season) - middle
        d.add(f"wear {letter}", on * age, WEAR_PRIOR[0] + WEAR_STEP_S * step, np.hypot(WEAR_PRIOR[1], WEAR_SD_S) * width)
        if letter != "M":
            d.add(f"offset {letter}", on, -OFFSET_STEP_S * step, OFFSET_SD_S * width)
    return d


def _add_nuisance(d: Design, laps: pl.DataFrame, stints: pl.Series, stint_sd_s: float) -> None:
    """Effects of the stint and of the car ahead, which a prediction leaves out."""
    for name in stints.unique().sort():
        d.add(name, (stints == name).to_numpy(), 0.0, stint_sd_s)
    gap = laps["gap_start_s"].fill_null(99.0).to_numpy()
    for low, high in GAP_BINS_S:
        d.add(f"gap {low}", (gap >= low) & (gap < high), 0.3, 1.0)


def share_left(laps: pl.DataFrame, race_laps: int) -> Array:
    """Share of the distance left half-way through each lap."""
    return np.asarray(1.0 - (laps["lap"].to_numpy() - 0.5) / race_laps, dtype=np.float64)


def mean_car(cars: list[tuple[str, str]]) -> dict[str, float]:
    """Coefficients of the average car of (team, driver)."""
    terms: dict[str, float] = {}
    for team, driver in cars:
        for name in (f"team {team}", f"driver {driver}"):
            terms[name] = terms.get(name, 0.0) + 1.0 / len(cars)
    return terms


def car_paces(model: PaceModel, cars: list[tuple[str, str]]) -> dict[str, Figure]:
    """Each car's lap time against the mean of `cars`; one with few laps leans on his team mate."""
    mean = mean_car(cars)
    counts = dict(model.laps.group_by("driver").len().iter_rows())
    found: dict[str, Figure] = {}
    for team, driver in cars:
        terms = {name: -factor for name, factor in mean.items()}
        for name in (f"team {team}", f"driver {driver}"):
            terms[name] = terms.get(name, 0.0) + 1.0
        found[driver] = model.figure(terms, int(counts.get(driver, 0)))
    return found


def shared_figures(model: PaceModel, cars: list[tuple[str, str]]) -> tuple[tuple[str, ...], Array, Array]:
    """Names, values and covariance of what races share: `base` (average car, medium, empty tank), `gain`, `wear S`, `offset S` ...

    A compound that was not raced is left out; where that is the medium, offsets and base are against the medium's prior.
    """
    names = [n for n in ("gain", *(f"{kind} {c}" for kind in ("wear", "offset") for c in COMPOUNDS)) if n in model.fit]
    raced = set(model.laps["compound"])
    names = [n for n in names if n == "gain" or n[-1] in raced]
    rows = [{"level": 1.0, **mean_car(cars)}, *({n: 1.0} for n in names)]
    c = np.zeros((len(rows), len(model.fit.names)))
    for i, terms in enumerate(rows):
        for name, factor in terms.items():
            c[i, model.fit.names.index(name)] = factor
    return ("base", *names), c @ model.fit.beta, c @ model.fit.cov @ c.T


def lap_noise(model: PaceModel) -> tuple[Figure, dict[str, tuple[float, int]]]:
    """Independent lap noise in free air; and (noise, differences) of each driver.

    Taken from differences of neighbouring laps of a stint over the square root of two, so that slow drifts of pace do not count as noise.
    """
    steps = noise_steps(model)
    field = spread(steps["step"].to_numpy()) if steps.height > 20 else model.fit.sigma
    noise = Figure(field, 1.2 * field / float(np.sqrt(max(steps.height, 4))), steps.height)
    own = {str(d): (spread(part["step"].to_numpy()), part.height) for (d,), part in steps.group_by("driver") if part.height >= 5}
    return noise, dict(sorted(own.items()))


def spread(values: Array) -> float:
    """Standard deviation of the normal distribution with the same 5-95 % range: between a median deviation and a variance."""
    low, high = np.quantile(values, [0.05, 0.95])
    return float((high - low) / NORMAL_RANGE)


def noise_steps(model: PaceModel) -> pl.DataFrame:
    """Differences of the residuals of neighbouring free-air laps of a stint, over sqrt(2): `driver, step`."""
    keys = ["driver", "stint_number"]
    return (
        model.laps.filter(FREE_AIR)
        .sort(*keys, "lap")
        .with_columns(step=(pl.col("residual_s").diff() / np.sqrt(2.0)).over(keys), apart=pl.col("lap").diff().over(keys))
        .filter(pl.col("apart") == 1)
        .select("driver", "step")
    )
