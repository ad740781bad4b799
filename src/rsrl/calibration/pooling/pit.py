"""Pit stops pooled: time loss by track, cold tyres, slow stops by team, loss under SC and VSC, double stacks."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import gamma
from typing import Final

import numpy as np
from scipy.optimize import minimize

from rsrl.calibration.bounded import believable, truncated
from rsrl.calibration.compounds import hardness
from rsrl.calibration.entry import RaceEntry, RaceKey
from rsrl.calibration.literature import COLD_S, RATIO_SC, RATIO_VSC
from rsrl.calibration.pooling.mixed_effects import Effect, Group, Mixed, fit_mixed
from rsrl.calibration.pooling.scalars import PooledScalar, Spread, pool_scalar
from rsrl.calibration.race.analysis import RaceAnalysis
from rsrl.calibration.race.design import Array, robust_sd
from rsrl.calibration.race.pit import PitAnalysis
from rsrl.season import SC, VSC, Figure, PitFigures

TAIL_PRIOR: Final = ((1.1, 0.4), (2.3, 0.5))  # scale and shape of slow stops, log-normal
TAIL_MAX: Final = Figure(40.0, 10.0, 0, "longer stops are repairs, which no plan foresees")
RATIO_RANGE: Final = (0.1, 1.0)  # of the loss under a neutralisation to that under green
EVENT_SD: Final = {VSC: 0.25, SC: 0.6}  # spread of that ratio between events of 2018-2021
EVENT_WEIGHT: Final = 4  # events that this spread counts as
USUAL_LANE_S: Final = 23.0
LANE: Final = Spread(USUAL_LANE_S, 3.0, 2.5, 0.3, 0.4)
STACK_PRIOR: Final = (3.0, 1.5, 4)  # s, error, and how many double stacks that guess weighs
GROUPS: Final[dict[str, Group]] = {
    "loss": Group(5.0, 21.0, learned=False),
    "loss lane": Group(0.3, 0.9, learned=False),  # per second at the speed limit, which is driven in a third of that on the track
    "loss track": Group(2.5),
    "loss season": Group(0.3),
    "loss race": Group(0.5),
    "cold": Group(COLD_S[1], COLD_S[0], learned=False),
    "cold hardness": Group(0.25, learned=False),
}
_Terms = dict[Effect, float]


@dataclass(frozen=True)
class PitPool:
    """Pit-stop figures of any track."""

    model: Mixed | None
    races: tuple[RaceKey, ...]
    lane: PooledScalar  # pit-lane time of a quick stop
    tail: tuple[Figure, Figure]  # scale, shape
    teams: dict[str, Figure]  # `season team` to the team's excess against the field's
    share: PooledScalar
    vsc: tuple[float, float, int]
    sc: tuple[float, float, int]
    stack: Figure

    def figures(self, entry: RaceEntry) -> PitFigures:
        """Pit figures of an entry."""
        loss = self._loss(entry)
        return PitFigures(
            loss_green_s=loss,
            loss_vsc_s=believable(_scaled(loss, self.vsc, "VSC"), "loss_vsc_s"),
            loss_sc_s=believable(_scaled(loss, self.sc, "SC"), "loss_sc_s"),
            in_lap_share=self.share.at(entry, 0.0, 1.0),
            stack_s=believable(self.stack, "stack_s"),
            tail_scale_s=believable(self.tail[0], "tail_scale_s"),
            tail_shape=believable(self.tail[1], "tail_shape"),
            tail_max_s=TAIL_MAX,
        )

    def cold(self, entry: RaceEntry, letter: str) -> Figure:
        """Cold lap of a compound."""
        if self.model is None:
            return Figure(*COLD_S, 0, "literature")
        k = hardness(entry.c_numbers[letter], entry.season)
        value, se = self.model.predict(_cold(k))
        return believable(
            Figure(value, se, len(self.races), "level from literature (1.0 +- 0.3 s), contrasts between C-numbers from out-laps"),
            "cold_loss_s",
        )

    def team_factor(self, team: str, season: int) -> Figure:
        """A team's excess over the quickest stop against the field's."""
        return self.teams.get(f"{season} {team}", Figure(1.0, 0.25, 0, "no stops of this team in this season: the field's"))

    def _loss(self, entry: RaceEntry) -> Figure:
        if self.model is None:
            return Figure(21.0, 3.0, 0, "no green stop in the races given: assumed")
        lane = self.lane.at(entry)
        value, se = self.model.predict(_loss(entry, lane.value))
        here = sum(race.circuit == entry.circuit for race in self.races)
        if not here:  # the length of the pit lane is all that is known of the track
            se = float(np.hypot(se, lane.se * self.model.predict({("loss lane", "all"): 1.0})[0]))
        note = f"in-lap and out-lap against the pace model, less each stop's excess and the cold lap; {len(self.races)} races, {here} here"
        return believable(Figure(value, se, len(self.races), note), "loss_green_s")


def pool_pit(analyses: Sequence[RaceAnalysis]) -> PitPool:
    """Pool the stops of dry races."""
    dry = [(a, a.pit) for a in analyses if a.pit is not None]
    tail = _tail([p for _, p in dry])
    scale, shape = tail[0].value, tail[1].value
    lane = pool_scalar([(a.entry, a.lane_s) for a in analyses if a.lane_s is not None], LANE, 0.1)
    model, races = _losses(dry, lane, scale, shape)
    shares = [(a.entry, p.in_share) for a, p in dry if p.in_share is not None]
    waits = np.array([w for _, p in dry for w in p.waits_s])
    return PitPool(
        model=model,
        races=races,
        lane=lane,
        tail=tail,
        teams=_team_factors(dry, scale, shape),
        share=pool_scalar(shares, Spread(0.3, 0.3, 0.2, 0.03, 0.05), 0.02),
        vsc=_combine([r for _, p in dry for r in p.ratios_vsc], RATIO_VSC, EVENT_SD[VSC]),
        sc=_combine([r for _, p in dry for r in p.ratios_sc], RATIO_SC, EVENT_SD[SC]),
        stack=_stack(waits),
    )


def quickest_shift(scale: float, shape: float, stops: float) -> float:
    """How far the quickest of some stops is above the quickest possible: mean of the Weibull law that minima follow."""
    return float(scale * stops ** (-1 / shape) * gamma(1 + 1 / shape))


def _tail(races: Sequence[PitAnalysis]) -> tuple[Figure, Figure]:
    excess = [np.array([x for _, x in p.excess_s]) for p in races]
    return fit_tail(np.concatenate([*excess, []]), np.concatenate([*(np.full(len(x), float(len(x))) for x in excess), []]))


def fit_tail(excess: Array, stops: Array) -> tuple[Figure, Figure]:
    """Scale and shape of a log-logistic distribution of the time beyond the quickest stop possible: most probable values.

    Args:
        excess: pit-lane time of each stop beyond the quickest of its race.
        stops: how many stops that race had. Their quickest is itself above the quickest possible (`quickest_shift`),
            which is added back; figures and shift are found together.

    The prior is `TAIL_PRIOR`, of little weight beside some hundred stops; standard errors are from the law's Fisher information and it.
    """
    (scale, scale_sd), (shape, shape_sd) = TAIL_PRIOR
    centre, precision = np.log([scale, shape]), np.array([(scale / scale_sd) ** 2, (shape / shape_sd) ** 2])
    for _ in range(12):
        shift = {n: quickest_shift(scale, shape, n) for n in np.unique(stops).tolist()}
        logs = np.log(excess + np.array([shift[n] for n in stops.tolist()]))

        def loss(p: Array, logs: Array = logs) -> float:
            z = (logs - p[0]) * np.exp(p[1])
            prior = 0.5 * float(precision @ (p - centre) ** 2)
            return prior - float(np.sum(p[1] + z - logs - 2 * np.logaddexp(0.0, z)))

        best = minimize(loss, np.array([np.log(scale), np.log(shape)]), method="BFGS")
        scale, shape = float(np.exp(best.x[0])), float(np.exp(best.x[1]))
    note = "green stops of all dry races given, beyond each race's quickest"
    n = len(excess)
    scale_se, shape_se = scale / np.sqrt(n * shape**2 / 3 + precision[0]), shape / np.sqrt(n * (3 + np.pi**2) / 9 + precision[1])
    return Figure(scale, float(scale_se), n, note), Figure(shape, float(shape_se), n, note)


def _losses(
    dry: Sequence[tuple[RaceAnalysis, PitAnalysis]], lane: PooledScalar, scale: float, shape: float
) -> tuple[Mixed | None, tuple[RaceKey, ...]]:
    """Loss of the quickest stop possible, and cold laps: only their sum is measured, its split rests on the literature."""
    values, variances, rows, races = [], [], [], []
    for a, p in dry:
        shift = quickest_shift(scale, shape, max(len(p.excess_s), 1))
        for letter, cost in p.cost_s.items():
            values.append(cost.value - shift)
            variances.append(cost.se**2)
            rows.append(_loss(a.entry, lane.at(a.entry).value) | _cold(hardness(a.entry.c_numbers[letter], a.entry.season)))
        if p.cost_s:
            races.append(a.entry)
    return (fit_mixed(values, variances, rows, GROUPS) if values else None), tuple(races)


def _loss(race: RaceKey, lane_s: float) -> _Terms:
    """Effects of a race's pit loss; the time in the pit lane stands in for tracks without a green stop."""
    return {
        ("loss", "all"): 1.0,
        ("loss lane", "all"): lane_s - USUAL_LANE_S,
        ("loss track", race.circuit): 1.0,
        ("loss season", str(race.season)): 1.0,
        ("loss race", race.label): 1.0,
    }


def _cold(k: int) -> _Terms:
    return {("cold", "all"): 1.0, ("cold hardness", str(k)): 1.0}


def _team_factors(dry: Sequence[tuple[RaceAnalysis, PitAnalysis]], scale: float, shape: float) -> dict[str, Figure]:
    """Each team's typical excess over a season against the field's in the same races, shrunk by its reliability (on the log scale)."""
    logs: dict[str, list[float]] = {}
    for a, p in dry:
        if not p.excess_s:
            continue
        shift = quickest_shift(scale, shape, len(p.excess_s))
        own = [(team, float(np.log(x + shift))) for team, x in p.excess_s]
        field = float(np.mean([v for _, v in own]))
        for team, log in own:
            logs.setdefault(f"{a.entry.season} {team}", []).append(log - field)
    if len(logs) < 3:
        return {}
    mean = np.array([np.mean(v) for v in logs.values()])
    noise = np.array([np.pi**2 / 3 / shape**2 / len(v) for v in logs.values()])  # variance of a log-logistic's logarithm
    between = max(float(np.var(mean) - np.mean(noise)), 1e-4)
    keep = between / (between + noise)
    found = {}
    for (name, v), m, k, e in zip(logs.items(), mean, keep, noise, strict=True):
        factor = float(np.exp(k * m))
        found[name] = Figure(
            factor, float(factor * np.sqrt(k * e)), len(v), "the team's green stops of the season against the field's, shrunk"
        )
    return found


def _combine(ratios: Sequence[float], prior: tuple[float, float], event_sd: float) -> tuple[float, float, int]:
    """Precision-weighted mean of the events' median ratio and the published one, within `RATIO_RANGE`.

    Events differ a lot: where the car stood in the queue, and where on the lap the safety car came out, decides what a stop costs. A few
    that happen to agree must not count for more.
    """
    n = len(ratios)
    if not n:
        return *prior, n
    sd = float(np.sqrt((n * np.var(ratios) + EVENT_WEIGHT * event_sd**2) / (n + EVENT_WEIGHT)))
    precision = np.array([n / (1.25 * sd) ** 2, prior[1] ** -2])
    value = float(precision @ [float(np.median(ratios)), prior[0]] / precision.sum())
    found = truncated(Figure(value, float(precision.sum() ** -0.5), n), *RATIO_RANGE)
    return found.value, found.se, n


def _scaled(loss: Figure, ratio: tuple[float, float, int], what: str) -> Figure:
    note = f"green loss x {ratio[0]:.2f}: {what} stops of {ratio[2]} laps in all races given, and the ratio published for Singapore"
    return Figure(loss.value * ratio[0], float(np.hypot(loss.se * ratio[0], loss.value * ratio[1])), ratio[2], note)


def _stack(waits: Array) -> Figure:
    """Time between a team's two cars being served, from double stacks."""
    value, se, weight = STACK_PRIOR
    n = len(waits)
    if n < 3:
        return Figure(value, se, n, "too few double stacks: assumed")
    pooled = float((np.median(waits) * n + value * weight) / (n + weight))
    return Figure(pooled, float(1.25 * max(robust_sd(waits), 0.5) / np.sqrt(n + weight)), n, f"{n} double stacks of all races given")
