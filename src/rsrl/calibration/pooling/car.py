"""Cars and drivers pooled: pace of a season's races about team and driver, form, noise, starts."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from rsrl.calibration.entry import RaceEntry
from rsrl.calibration.pooling.mixed_effects import Effect, Group, Mixed, fit_mixed
from rsrl.calibration.race.analysis import RaceAnalysis
from rsrl.season import Figure

REFERENCE_LAP_S: Final = 90.0  # paces are pooled as on a lap of this length
SE_FLOOR_S: Final = 0.03
GROUPS: Final[dict[str, Group]] = {"team": Group(0.8), "driver": Group(0.25), "team race": Group(0.2), "driver race": Group(0.15)}
NO_FORM: Final = (0.18, 0.08)
NO_SHARE: Final = (0.75, 60.0)  # of form's variance, common to team mates: dry races of 2018-2021; pairs of cars it counts as
PACE_NOISE_S: Final = 0.126  # error of a race's pace over two or three stints, each with a spread of its own
MIN_RACES: Final = 4  # of a driver's season, to know what pace is usual
LARGEST_S: Final = 1.5  # a car further from its usual pace was damaged
NOISE_STRENGTH: Final = 30.0  # differences' worth of prior at the field's level
MIN_STARTS: Final = 40
_Terms = dict[Effect, float]


@dataclass(frozen=True)
class CarPool:
    """Figures of cars and drivers, by season where they change."""

    seasons: dict[int, Mixed]
    counts: dict[tuple[int, str], int]  # (season, driver): races with a pace
    noise: dict[tuple[int, str], Figure]
    starts: dict[str, Figure]
    form_share: Figure  # share of the variance of form that team mates have in common

    def pace(self, entry: RaceEntry, base_lap_s: float) -> dict[str, Figure]:
        """Pace of every starter against their mean; in a race that was analysed its own, held together by team, driver and season."""
        model = self.seasons.get(self._nearest(entry.season))
        combos = [_terms(team, driver, f"{entry.season}/{entry.round}") for driver, team, _ in entry.starters]
        scale = base_lap_s / REFERENCE_LAP_S
        if model is None:
            return {d: Figure(0.0, 1.0 * scale, 0, "no race of any season given: the field's mean") for d, _, _ in entry.starters}
        means, cov = model.predict_all(combos)
        centre = np.eye(len(combos)) - 1.0 / len(combos)
        ses = np.sqrt(np.maximum(np.diag(centre @ cov @ centre.T), 0.0))
        found = {}
        for (driver, _, _), m, s in zip(entry.starters, centre @ means, ses, strict=True):
            n = self.counts.get((entry.season, driver), 0)
            note = f"pooled with the team and {n} dry races of the driver's season" if n else "no race of this driver's season: the team's"
            found[driver] = Figure(float(m * scale), float(s * scale), n, note)
        return found

    def form(self, season: int, base_lap_s: float) -> Figure:
        """Race-to-race spread of a car's pace, of car and driver together."""
        model = self.seasons.get(self._nearest(season))
        scale = base_lap_s / REFERENCE_LAP_S
        if model is None:
            return Figure(NO_FORM[0] * scale, NO_FORM[1] * scale, 0, "assumed")
        sd = float(np.hypot(model.sds["team race"], model.sds["driver race"])) * scale
        n = len(model.weights)
        car, driver = (model.sds[group] * scale for group in ("team race", "driver race"))
        note = f"race to race: the car {car:.2f} s, the driver {driver:.2f} s; one value for all"
        return Figure(sd, sd / float(np.sqrt(2 * n)), n, note)

    def noise_factor(self, season: int, driver: str) -> Figure:
        """A driver's lap noise against the field's."""
        return self.noise.get((season, driver), Figure(1.0, 0.2, 0, "too few laps: the field's"))

    def start_gain(self, driver: str) -> Figure:
        """Lap 1 against what the grid place gives."""
        return self.starts.get(driver, Figure(0.0, 0.4, 0, "no timed first lap: the field's"))

    def _nearest(self, season: int) -> int:
        """The season itself, else the last before it, else the first."""
        before = [s for s in self.seasons if s <= season]
        return max(before) if before else min(self.seasons, default=season)


def pool_cars(analyses: Sequence[RaceAnalysis]) -> CarPool:
    """Pool cars and drivers over the dry races."""
    dry = [a for a in analyses if a.pace is not None]
    seasons = sorted({a.entry.season for a in dry})
    counts: dict[tuple[int, str], int] = {}
    for a in dry:
        for driver in a.pace.cars if a.pace else ():
            counts[(a.entry.season, driver)] = counts.get((a.entry.season, driver), 0) + 1
    models = {s: _season([a for a in dry if a.entry.season == s]) for s in seasons}
    return CarPool(models, counts, _noise(dry), _starts(dry), _form_share(dry))


def _season(races: Sequence[RaceAnalysis]) -> Mixed:
    values, variances, rows = [], [], []
    for a in races:
        assert a.pace is not None
        scale = REFERENCE_LAP_S / a.pace.base_lap_s.value
        teams = {driver: team for driver, team, _ in a.entry.starters}
        for driver, figure in a.pace.cars.items():
            values.append(figure.value * scale)
            variances.append((figure.se * scale) ** 2 + SE_FLOOR_S**2)
            rows.append(_terms(teams[driver], driver, f"{a.entry.season}/{a.entry.round}"))
    return fit_mixed(values, variances, rows, GROUPS)


def _terms(team: str, driver: str, race: str) -> _Terms:
    return {("team", team): 1.0, ("driver", driver): 1.0, ("team race", f"{race} {team}"): 1.0, ("driver race", f"{race} {driver}"): 1.0}


def _form_share(dry: Sequence[RaceAnalysis]) -> Figure:
    """Covariance of team mates' deviations from their own pace of the season, over the variance of one that its own error leaves.

    The mixed model's split is not used: it knows the errors of two cars' paces as independent and too large, and so leaves the driver none.
    """
    own: dict[tuple[int, str, str], dict[int, float]] = {}
    for a in dry:
        assert a.pace is not None
        for driver, team, _ in a.entry.starters:
            if driver in a.pace.cars:
                pace = a.pace.cars[driver].value * REFERENCE_LAP_S / a.pace.base_lap_s.value
                own.setdefault((a.entry.season, team, driver), {})[a.entry.round] = pace
    teams: dict[tuple[int, str, int], list[float]] = {}
    for (season, team, _), paces in own.items():
        if len(paces) >= MIN_RACES:
            usual = float(np.median(list(paces.values())))
            for number, pace in paces.items():
                teams.setdefault((season, team, number), []).append(float(np.clip(pace - usual, -LARGEST_S, LARGEST_S)))
    pairs = np.array([both for both in teams.values() if len(both) == 2]).reshape(-1, 2)
    share, weight = NO_SHARE
    own_variance = float(np.mean(pairs**2)) - PACE_NOISE_S**2 if len(pairs) else 0.0
    seen = float(np.clip(np.mean(pairs.prod(axis=1)) / own_variance, 0.0, 1.0)) if own_variance > 0 else share
    value = (len(pairs) * seen + weight * share) / (len(pairs) + weight)
    note = "team mates' paces about their own of the season; counts with 60 pairs of 2018-2021"
    return Figure(value, float((1 - value**2) / np.sqrt(len(pairs) + weight)), len(pairs), note)


def _noise(dry: Sequence[RaceAnalysis]) -> dict[tuple[int, str], Figure]:
    """Own noise over the field's, over a season's races, shrunk towards 1."""
    sums: dict[tuple[int, str], tuple[float, int]] = {}
    for a in dry:
        assert a.pace is not None
        for driver, (own, n) in a.pace.noise_by_driver.items():
            total, seen = sums.get((a.entry.season, driver), (0.0, 0))
            sums[(a.entry.season, driver)] = (total + n * (own / a.pace.noise_s.value) ** 2, seen + n)
    found = {}
    for key, (total, n) in sums.items():
        value = float(np.sqrt((total + NOISE_STRENGTH) / (n + NOISE_STRENGTH)))
        found[key] = Figure(
            value, value / float(np.sqrt(2 * (n + NOISE_STRENGTH))), n, "differences of neighbouring free-air laps of the season"
        )
    return found


def _starts(dry: Sequence[RaceAnalysis]) -> dict[str, Figure]:
    """Each driver's first laps against the line through the field, shrunk by how reliable they are."""
    own: dict[str, list[float]] = {}
    for a in dry:
        for driver, left in (a.start.left_s if a.start else {}).items():
            own.setdefault(driver, []).append(left)
    every = np.array([v for values in own.values() for v in values])
    if len(every) < MIN_STARTS:
        return {}
    within = float(1.4826 * np.median(np.abs(every - np.median(every))))
    means = np.array([np.median(v) for v in own.values()])
    noise = np.array([1.57 * within**2 / len(v) for v in own.values()])  # variance of a median
    weights = 1 / noise
    between = max(float(np.average((means - np.average(means, weights=weights)) ** 2, weights=weights) - 1 / np.mean(weights)), 1e-3)
    keep = between / (between + noise)
    note = "first laps of all races given against the line through the field, shrunk"
    return {
        d: Figure(float(k * m), float(np.sqrt(k * e)), len(v), note)
        for (d, v), k, m, e in zip(own.items(), keep, means, noise, strict=True)
    }


def centred(pace: Mapping[str, Figure], entry: RaceEntry) -> dict[str, Figure]:
    """Given paces with their mean taken off."""
    mean = float(np.mean([pace[d].value for d, _, _ in entry.starters]))
    return {d: pace[d]._replace(value=pace[d].value - mean) for d, _, _ in entry.starters}
