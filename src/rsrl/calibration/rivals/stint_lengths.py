"""What to expect of a race from other races: usual stint lengths, number of stops, compounds.

Stint lengths: a Gaussian process (best linear unbiased prediction with random effects) on log(usual stint / race distance) of each race,
compound and kind of stint (first or later), over circuits (fading over the years), season, era of the cars and Pirelli C-number. Number
of stops: the same without the compound. The variances were fitted once by maximum likelihood on the dry races of 2018-2023 and are fixed
here, so that predictions from any set of races are quick.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import polars as pl
from numpy.typing import NDArray

from rsrl.calibration.entry import RaceKey
from rsrl.season import COMPOUNDS

Matrix = NDArray[np.float64]

ERA_START: Final = 2022  # ground-effect cars on 18-inch tyres: stints of earlier seasons say less
SHORT_STINT_LAPS: Final = 4
SPREAD: Final = 0.3  # of log stint lengths within a race, compound and kind
WEIBULL_SHAPE: Final = 4.0  # of stint lengths, where too few stints ended in a stop to have a median
PRIOR_SHARE: Final = 0.38  # stint over distance: prior of that fit, worth half a stint
NO_DATA_VARIANCE: Final = 1.0e3  # of a compound and kind of stint nobody drove
STINT_MEAN: Final = -1.1  # of log(stint / distance)
STOPS_MEAN: Final = 0.45  # of log(stops + 0.1)
STINT_SD: Final = {
    "track": 0.12, "track_compound": 0.19, "track_era": 0.073, "season": 0.05, "era": 0.146, "c_number": 0.10,
    "race": 0.07, "race_kind": 0.095, "cell": 0.096,
}  # fmt: skip
STINT_MEMORY_YEARS: Final = 1.8  # over which a track's effect fades
STOPS_SD: Final = {"track": 0.25, "track_era": 0.1, "season": 0.15, "era": 0.25, "race": 0.35}
STOPS_MEMORY_YEARS: Final = 2.5
TRACK_CARS: Final = 20.0  # cars of the season's other races that weigh as much as one race here a year ago, for shares of compounds
SEASON_CARS: Final = 40.0


@dataclass(frozen=True)
class RaceSummary:
    """Stints and stops of one race.

    Attributes:
        log_stint_share, variance: log(usual stint / distance) and its variance [2, 3]: first and later stints, by compound.
        stops: mean of the finishers; NaN where there are too few.
        starts: cars by starting compound [3].
        fitted: stops by compound fitted [3].
    """

    log_stint_share: Matrix
    variance: Matrix
    stops: float
    starts: Matrix
    fitted: Matrix


@dataclass(frozen=True)
class Outlook:
    """What a pit wall expects of a race before the start.

    Attributes:
        stint_laps, stint_log_se: usual stints [2, 3] (first and later, by compound) and the standard error of their logarithm.
        stops, stops_se: mean number of stops and its relative standard error.
        starts, fitted: shares of compounds at the start and at stops [3].
    """

    stint_laps: Matrix
    stint_log_se: Matrix
    stops: float
    stops_se: float
    starts: Matrix
    fitted: Matrix


def summarise_race(stints: pl.DataFrame, laps: int) -> RaceSummary:
    """Summary of a race's stints (`RaceDecisions.stints`)."""
    share, variance = np.zeros((2, 3)), np.full((2, 3), NO_DATA_VARIANCE)
    counted = stints.filter(pl.col("laps") > SHORT_STINT_LAPS)
    for later in (0, 1):
        for compound in range(3):
            own = counted.filter((pl.col("compound") == compound) & (pl.col("first") == (later == 0)))
            if own.height:
                ended = (own["ended"] == "box").to_numpy()
                share[later, compound], variance[later, compound] = _usual(own["laps"].to_numpy() / laps, ended)
    done = stints.group_by("driver").agg(stops=pl.col("ended").is_in(["box", "slow"]).sum(), flag=(pl.col("ended") == "flag").any())
    stops = done.filter("flag")["stops"]
    first = stints.filter("first")["compound"].to_list()
    later_sets = stints.filter(~pl.col("first"))["compound"].to_list()
    return RaceSummary(
        share, variance, float(np.mean(stops.to_numpy())) if len(stops) > 4 else float("nan"),
        np.bincount(first, minlength=3).astype(np.float64), np.bincount(later_sets, minlength=3).astype(np.float64),
    )  # fmt: skip


def _usual(shares: Matrix, ended: NDArray[np.bool_]) -> tuple[float, float]:
    """Log of the median stint and its variance. Stints that did not end in a stop are censored (Kaplan-Meier); a Weibull fit where there
    is no median."""
    survival, left = 1.0, len(shares)
    for i in np.lexsort((~ended, shares)):
        if ended[i]:
            survival *= 1 - 1 / left
            if survival <= 0.5:
                return float(np.log(shares[i])), SPREAD**2 / float(ended.sum())
        left -= 1
    events = float(ended.sum()) + 0.5
    scale = (float((shares**WEIBULL_SHAPE).sum()) + 0.5 * PRIOR_SHARE**WEIBULL_SHAPE) / events
    return float(np.log(scale * np.log(2))) / WEIBULL_SHAPE, 2 / (WEIBULL_SHAPE**2 * events)


def outlooks(past: Sequence[tuple[RaceKey, RaceSummary]], races: Sequence[RaceKey]) -> list[Outlook]:
    """Outlooks of `races` from `past` ones; a race that is in both is described, not forecast."""
    known = _cells([key for key, _ in past])
    summaries = [s for _, s in past]
    y = np.concatenate([s.log_stint_share.ravel() for s in summaries]) - STINT_MEAN
    noise = np.concatenate([s.variance.ravel() for s in summaries])
    kernel = _stint_kernel(known, known)
    inverse = np.linalg.inv(kernel + np.diag(noise))
    weighted = inverse @ y
    stops_of = _stops_predictor(past)
    found = []
    for race in races:
        new = _cells([race])
        cross = _stint_kernel(new, known)
        mean = STINT_MEAN + cross @ weighted
        variance = np.diag(_stint_kernel(new, new)) - np.einsum("ij,jk,ik->i", cross, inverse, cross)
        found.append(_outlook(race, mean, variance, *stops_of(race), past))
    return found


def _outlook(
    race: RaceKey, mean: Matrix, variance: Matrix, stops: float, stops_se: float, past: Sequence[tuple[RaceKey, RaceSummary]]
) -> Outlook:
    se = np.sqrt(np.maximum(variance, 0.0)).reshape(2, 3)
    stint_laps = np.exp(mean).reshape(2, 3) * race.laps
    return Outlook(stint_laps, se, stops, stops_se, _shares(race, past, "starts"), _shares(race, past, "fitted"))


def _cells(races: Sequence[RaceKey]) -> list[NDArray[np.generic]]:
    """Season, round, circuit, C-number, compound and kind of stint of each cell, six a race."""
    rows = [
        (r.season, f"{r.season}/{r.round}", r.circuit, r.c_numbers.get(c, f"{r.season}/{r.round}/{c}"), i, later)
        for r in races
        for later in (0, 1)
        for i, c in enumerate(COMPOUNDS)
    ]
    return [np.array(column) for column in zip(*rows, strict=True)]


def _same(a: NDArray[np.generic], b: NDArray[np.generic]) -> Matrix:
    return np.asarray(a[:, None] == b[None, :], np.float64)


def _stint_kernel(a: list[NDArray[np.generic]], b: list[NDArray[np.generic]]) -> Matrix:
    """Prior covariance of log stint lengths between cells."""
    v = {name: sd**2 for name, sd in STINT_SD.items()}
    season, race, track, number, compound, kind = (_same(x, y) for x, y in zip(a, b, strict=True))
    years = np.abs(a[0].astype(float)[:, None] - b[0].astype(float)[None, :])
    era = _same(a[0].astype(int) >= ERA_START, b[0].astype(int) >= ERA_START)
    fading = np.exp(-years / STINT_MEMORY_YEARS)
    here = track * (fading * (v["track"] + v["track_compound"] * compound) + era * v["track_era"])
    own = race * (v["race"] + kind * v["race_kind"] + kind * compound * v["cell"])
    wide: Matrix = 1.0 + compound * kind + season * v["season"] + era * v["era"] + number * kind * v["c_number"]
    return wide + here + own


def _stops_kernel(a: Sequence[RaceKey], b: Sequence[RaceKey]) -> Matrix:
    v = {name: sd**2 for name, sd in STOPS_SD.items()}
    years_a, years_b = np.array([r.season for r in a]), np.array([r.season for r in b])
    track = _same(np.array([r.circuit for r in a]), np.array([r.circuit for r in b]))
    era = _same(years_a >= ERA_START, years_b >= ERA_START)
    fading = np.exp(-np.abs(years_a[:, None] - years_b[None, :]) / STOPS_MEMORY_YEARS)
    wide: Matrix = 1.0 + _same(years_a, years_b) * v["season"] + era * v["era"]
    return wide + track * (fading * v["track"] + era * v["track_era"])


def _stops_data(past: Sequence[tuple[RaceKey, RaceSummary]]) -> tuple[list[RaceKey], Matrix, Matrix]:
    keys = [k for k, _ in past]
    stops = np.array([s.stops for _, s in past])
    known = np.isfinite(stops)
    y = np.where(known, np.log(np.where(known, stops, 1.0) + 0.1) - STOPS_MEAN, 0.0)
    return keys, y, _stops_kernel(keys, keys) + np.diag(np.where(known, STOPS_SD["race"] ** 2, NO_DATA_VARIANCE))


def _stops_predictor(past: Sequence[tuple[RaceKey, RaceSummary]]) -> Callable[[RaceKey], tuple[float, float]]:
    keys, y, kernel = _stops_data(past)
    inverse = np.linalg.inv(kernel)

    def predict(race: RaceKey) -> tuple[float, float]:
        cross = _stops_kernel([race], keys)[0]
        variance = float(_stops_kernel([race], [race])[0, 0] - cross @ inverse @ cross)
        return float(np.exp(STOPS_MEAN + cross @ inverse @ y)), max(variance, 0.0) ** 0.5

    return predict


def _shares(race: RaceKey, past: Sequence[tuple[RaceKey, RaceSummary]], what: str) -> Matrix:
    """Shares of compounds at this circuit in its era, shrunk to those of the season, these to the era's, these to those of all races."""
    every, era, season, here = np.ones(3), np.zeros(3), np.zeros(3), np.zeros(3)
    for key, summary in past:
        counts = getattr(summary, what)
        every += counts / 20.0
        if (key.season >= ERA_START) == (race.season >= ERA_START):
            era += counts
            if key.circuit == race.circuit:
                here += counts * np.exp(-abs(key.season - race.season) / STINT_MEMORY_YEARS)
        season += counts * (key.season == race.season)
    share = every / every.sum()
    share = (era + SEASON_CARS * share) / (era.sum() + SEASON_CARS)
    share = (season + SEASON_CARS * share) / (season.sum() + SEASON_CARS)
    result: Matrix = (here + TRACK_CARS * share) / (here.sum() + TRACK_CARS)
    return result
