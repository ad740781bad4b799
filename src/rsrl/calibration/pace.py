"""The pace model of one Grand Prix: lap time in free air from car, driver, tyre and fuel, over one or more seasons of it.

lap time = season + team + driver + compound offset + wear x age + curvature x age^2 + fuel
           + stint (random) + traffic (nuisance) + noise

Wear and fuel are confounded within a stint. They are told apart by stints: tyre age starts anew at every stop, the fuel load
does not, and cars stop on different laps; a prior on the fuel effect settles what is left. The fuel term also takes up what the
track gains over the race, which looks the same.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
import polars as pl

from rsrl.calibration.design import Array, Design, LinearFit, fit
from rsrl.season import Figure

FUEL_START_KG: Final = 110.0  # FIA limit, which all but a few cars use
FUEL_PRIOR: Final = (0.031, 0.005)  # s per kg and lap: Bayesian fit of 2022-24 in the literature
OFFSET_STEP_S: Final = 0.5  # per C-number, softer is quicker: Pirelli's usual estimate between neighbours
OFFSET_SD_S: Final = 0.35
WEAR_PRIOR: Final = (0.07, 0.06)  # medium, s per lap: wear after 15 laps is 0.73 / 1.26 / 1.28 s (hard, medium, soft) in the literature
WEAR_STEP_PRIOR: Final = (0.02, 0.015)  # per C-number softer, same source
WEAR_SD: Final = 0.015  # a compound off that line
CURVATURE_SD: Final = 0.002
SEASON_OFFSET_SD_S: Final = 0.2  # the same C-number from one season to the next
SEASON_WEAR_SD: Final = 0.03  # all compounds together
SEASON_COMPOUND_WEAR_SD: Final = 0.015  # one compound beyond that
RENAMED_SD_FACTOR: Final = 2.0  # C1 before 2023 is another tyre: a new C1 came in above it
TEAM_SD_S: Final = 1.5
DRIVER_SD_S: Final = 0.25  # driver against his team mate
STINT_SD_S: Final = 0.2  # one stint against the car's pace: tyre management, a set that is not like the others
FREE_AIR_S: Final = 2.5
TRAFFIC_WEIGHT: Final = 0.15  # a lap behind another car says little of what the car can do
GAP_BINS_S: Final = ((0.0, 1.0), (1.0, 1.5), (1.5, 2.0), (2.0, 2.5), (2.5, 3.5))
_STINT: Final = pl.format("stint {} {} {}", "season", "driver", "stint_number")


@dataclass(frozen=True)
class PaceModel:
    """A fitted pace model and what is needed to predict with it."""

    fit: LinearFit
    season: int  # the target season
    race_laps: dict[int, int]  # season to distance
    c_numbers: dict[str, str]  # colour letter to C-number in the target season
    curved: tuple[str, ...]  # C-numbers with a curvature term
    laps: pl.DataFrame  # the laps fitted, with `residual_s`

    def predict(self, frame: pl.DataFrame) -> Array:
        """Free-air lap time of each row of `frame` (season, team, driver, lap, compound_c, age_laps), cold tyres and start left out."""
        design = _design(frame, self, traffic=False)
        return np.column_stack([self.fit.value(n) * c for n, c in zip(design.names, design.columns, strict=True)]).sum(axis=1)

    def traffic(self, frame: pl.DataFrame) -> Array:
        """What the car ahead costs on average, by `gap_start_s`."""
        gap = frame["gap_start_s"].fill_null(99.0).to_numpy()
        costs = [self.fit.value(f"gap {low}") * ((gap >= low) & (gap < high)) for low, high in GAP_BINS_S]
        return np.asarray(np.sum(costs, axis=0), dtype=np.float64)

    def stint_effects(self, frame: pl.DataFrame) -> Array:
        """How much slower than the model each row's stint was; zero for a stint not in the fit."""
        effect = dict(zip(self.fit.names, self.fit.beta.tolist(), strict=True))
        names = frame.select(_STINT.alias("stint"))["stint"]
        return np.array([effect.get(name, 0.0) for name in names], dtype=np.float64)

    def car_terms(self, season: int, team: str, driver: str) -> dict[str, float]:
        """Coefficients that make a car's pace."""
        return {f"team {season} {team}": 1.0, f"driver {season} {driver}": 1.0}

    def tyre_terms(self, kind: str, letter: str) -> dict[str, float]:
        """Coefficients that make `offset`, `wear` or `curvature` of a compound in the target season."""
        c = self.c_numbers[letter]
        terms = {f"{kind} {c}": 1.0}
        if kind == "wear":
            terms |= {"wear": 1.0, f"wear {self.season}": 1.0, "wear step": float(int(c[1]) - int(self.c_numbers["M"][1]))}
        return terms if kind == "curvature" else terms | {f"{kind} {c} {self.season}": 1.0}


def fit_pace(laps: pl.DataFrame, season: int, race_laps: dict[int, int], c_numbers: dict[str, str]) -> PaceModel:
    """Fit the pace model.

    Args:
        laps: kept laps of `rsrl.laps.clean`, of this Grand Prix only, any number of seasons.
        season: the season whose race is described.
        race_laps: distance of the race by season.
        c_numbers: C-number by colour letter in the target season.
    """
    known = laps.filter(pl.col("compound_c").is_not_null())
    present = tuple(sorted(known["compound_c"].unique()))
    curved = tuple(c for c in present if c in c_numbers.values())
    blank = LinearFit((), np.zeros(0), np.zeros((0, 0)), 0.0, np.zeros(0), np.zeros(0))
    while True:
        model = PaceModel(blank, season, race_laps, c_numbers, curved, known)
        fitted = _fit(known, model)
        shown = tuple(c for c in curved if _shows(fitted, f"curvature {c}"))
        if shown == curved:
            break
        curved = shown
    residual = pl.Series("residual_s", fitted.residuals)
    return PaceModel(fitted, season, race_laps, c_numbers, curved, known.with_columns(residual))


def _shows(fitted: LinearFit, name: str) -> bool:
    """Whether the data show wear that grows with age: two and a half standard errors above zero."""
    value, se = fitted.combine({name: 1.0})
    return value > 2.5 * se


def _fit(laps: pl.DataFrame, model: PaceModel) -> LinearFit:
    free = laps["gap_start_s"].fill_null(99.0).to_numpy() > FREE_AIR_S
    weights = np.where(free, 1.0, TRAFFIC_WEIGHT)
    clusters = (laps["season"].cast(pl.String) + laps["driver"]).to_numpy()
    return fit(_design(laps, model, traffic=True), laps["lap_time_s"].to_numpy(), clusters, weights)


def _design(laps: pl.DataFrame, model: PaceModel, traffic: bool) -> Design:
    d = Design(laps.height)
    season = laps["season"].to_numpy()
    for y in sorted(set(season.tolist())):
        d.add(f"season {y}", season == y)
    for kind, sd in (("team", TEAM_SD_S), ("driver", DRIVER_SD_S)):
        for y, name in laps.select("season", kind).unique().sort("season", kind).iter_rows():
            d.add(f"{kind} {y} {name}", (season == y) & (laps[kind] == name).to_numpy(), 0.0, sd)
    d.add("fuel", fuel_kg(laps, model.race_laps), *FUEL_PRIOR)
    _add_tyres(d, laps, model)
    if traffic:  # what only a lap that was driven has
        names = laps.select(_STINT.alias("stint"))["stint"]
        for name in names.unique().sort():
            d.add(name, (names == name).to_numpy(), 0.0, STINT_SD_S)
        gap = laps["gap_start_s"].fill_null(99.0).to_numpy()
        for low, high in GAP_BINS_S:
            d.add(f"gap {low}", (gap >= low) & (gap < high))
    return d


def fuel_kg(laps: pl.DataFrame, race_laps: dict[int, int]) -> Array:
    """Fuel on board half-way through each lap: `FUEL_START_KG` at the start, burned evenly to nothing at the flag."""
    distance = np.array([race_laps[s] for s in laps["season"].to_list()], dtype=np.float64)
    done = (laps["lap"].to_numpy() - 0.5) / distance
    return np.asarray(FUEL_START_KG * (1.0 - done), dtype=np.float64)


def _add_tyres(d: Design, laps: pl.DataFrame, model: PaceModel) -> None:
    compound = laps["compound_c"].to_numpy()
    age = laps["age_laps"].to_numpy().astype(np.float64)
    season = laps["season"].to_numpy()
    medium = model.c_numbers["M"]
    seasons = sorted(set(season.tolist()))
    d.add("wear", age, *WEAR_PRIOR)
    d.add("wear step", age * np.array([int(c[1]) - int(medium[1]) for c in compound]), *WEAR_STEP_PRIOR)
    for y in seasons:
        d.add(f"wear {y}", age * (season == y), 0.0, SEASON_WEAR_SD)
    for c in sorted(set(compound.tolist()) | set(model.c_numbers.values())):
        on = (compound == c).astype(np.float64)
        if c != medium:
            d.add(f"offset {c}", on, -OFFSET_STEP_S * (int(c[1]) - int(medium[1])), OFFSET_SD_S)
        d.add(f"wear {c}", on * age, 0.0, WEAR_SD)
        if c in model.curved:
            d.add(f"curvature {c}", on * age**2, 0.0, CURVATURE_SD)
        for y in seasons:
            factor = RENAMED_SD_FACTOR if c == "C1" and y < 2023 <= model.season else 1.0
            d.add(f"offset {c} {y}", on * (season == y), 0.0, factor * SEASON_OFFSET_SD_S)
            d.add(f"wear {c} {y}", on * age * (season == y), 0.0, factor * SEASON_COMPOUND_WEAR_SD)


def starters_mean(model: PaceModel, starters: list[tuple[str, str]]) -> dict[str, float]:
    """Coefficient terms of the average car of the target season; starters are (team, driver)."""
    terms: dict[str, float] = {}
    for team, driver in starters:
        for name, factor in model.car_terms(model.season, team, driver).items():
            terms[name] = terms.get(name, 0.0) + factor / len(starters)
    return terms


def base_lap(model: PaceModel, starters: list[tuple[str, str]]) -> Figure:
    """Lap of the average car of the target season: free air, fresh medium, empty tank."""
    medium = model.c_numbers["M"]
    terms = {f"season {model.season}": 1.0, f"offset {medium} {model.season}": 1.0} | starters_mean(model, starters)
    value, se = model.fit.combine(terms)
    return Figure(value, se, _count(model, "season", model.season))


def car_pace(model: PaceModel, starters: list[tuple[str, str]], team: str, driver: str) -> Figure:
    """A car's lap time against the mean of the starters, pooled partially towards its team."""
    terms = {name: -factor for name, factor in starters_mean(model, starters).items()}
    for name, factor in model.car_terms(model.season, team, driver).items():
        terms[name] = terms.get(name, 0.0) + factor
    value, se = model.fit.combine(terms)
    mine = model.laps.filter((pl.col("season") == model.season) & (pl.col("driver") == driver))
    note = "" if mine.height >= 25 else "few laps: mostly the team's pace"
    return Figure(value, se, mine.height, note)


def _count(model: PaceModel, column: str, value: int) -> int:
    return model.laps.filter(pl.col(column) == value).height


def lap_noise(model: PaceModel) -> tuple[Figure, dict[str, Figure]]:
    """Independent lap noise in free air, and each driver's share of it (shrunk towards 1).

    Taken from differences of neighbouring laps of a stint over the square root of two, so that slow drifts of pace within
    a race do not count as noise.
    """
    steps = noise_steps(model)
    field = spread(steps["step"].to_numpy())
    noise = Figure(field, 1.2 * field / float(np.sqrt(steps.height)), steps.height, "differences of neighbouring free-air laps / sqrt(2)")
    factors: dict[str, Figure] = {}
    strength = 30.0  # differences' worth of prior at the field's level
    for (driver,), part in steps.filter(pl.col("season") == model.season).group_by("driver"):
        own = spread(part["step"].to_numpy()) / field
        value = np.sqrt((part.height * own**2 + strength) / (part.height + strength))
        factors[str(driver)] = Figure(float(value), float(value / np.sqrt(2 * (part.height + strength))), part.height)
    return noise, factors


def spread(values: Array) -> float:
    """Standard deviation of the normal distribution with the same 5-95 % range: between a median deviation and a variance."""
    low, high = np.quantile(values, [0.05, 0.95])
    return float((high - low) / 3.29)


def noise_steps(model: PaceModel) -> pl.DataFrame:
    """Differences of the residuals of neighbouring free-air laps of a stint, over sqrt(2): `season, driver, step`."""
    keys = ["season", "round", "driver", "stint_number"]
    return (
        model.laps.filter(pl.col("gap_start_s").fill_null(99.0) > FREE_AIR_S)
        .sort(*keys, "lap")
        .with_columns(
            step=(pl.col("residual_s").diff() / np.sqrt(2.0)).over(keys),
            apart=pl.col("lap").diff().over(keys),
        )
        .filter(pl.col("apart") == 1)
        .select("season", "driver", "step")
    )
