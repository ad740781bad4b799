"""Incidents pooled: hazards per circuit, durations, lap times behind the safety car, retirements per team and season."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from rsrl.calibration.bounded import believable
from rsrl.calibration.history import EarlierRace
from rsrl.calibration.literature import SC_LAPS, SC_WEAR, VSC_LAPS, VSC_WEAR
from rsrl.calibration.pooling.hazards import Rates, pool_rates
from rsrl.calibration.race.analysis import RaceAnalysis
from rsrl.calibration.race.design import robust_sd
from rsrl.calibration.race.incidents import Deployment, IncidentAnalysis
from rsrl.season import SC, VSC, Figure, IncidentFigures

FIRST: Final = 2  # a safety car that is out by lap 2 is due to the start
MIN_RUNS: Final = 5
DURATION_PSEUDO: Final = 0.5  # added to each count of a duration up to the longest seen
VSC_CAME: Final = 2015  # since then some incidents that took a safety car take a virtual one
RED_PRIOR: Final = (0.15, 4.0)  # share, and the number of safety cars the guess counts as
USUAL_SC, USUAL_FIRST_SC, USUAL_VSC = 0.0097, 0.27, 0.0070  # dry races of 2018-2021, per green lap, per start and per green lap
USUAL_OUT, USUAL_FIRST_OUT = 0.0024, 0.022  # the same races, retirements per lap and car, and on lap 1 per start and car
USUAL_SC_BY_OUT, USUAL_VSC_BY_OUT, USUAL_SC_BY_FIRST_OUT = 0.152, 0.073, 0.60  # the same races, per car that retired on a racing lap
MOST_BY_OUT: Final = 0.6, 0.3, 0.9  # of those three: probabilities, where the rates of a circuit might exceed one
_Counts = dict[str, tuple[float, float]]


@dataclass(frozen=True)
class IncidentPool:
    """Hazards of any circuit, and what all races share."""

    sc: Rates  # per green lap after the first two
    sc_first: Rates  # per start
    vsc: Rates
    sc_by_out: Rates  # per car that retires on a racing lap after the first
    vsc_by_out: Rates
    sc_by_first_out: Rates  # per car out on lap 1
    red_share: Figure
    sc_laps: tuple[float, ...]
    vsc_laps: tuple[float, ...]
    factors: dict[str, Figure]  # against the median green lap
    green_over_base: float
    retire: Rates  # per lap after the first, by team and season
    retire_track: Rates  # the same by circuit
    retire_first: Rates  # per start, by circuit

    def figures(self, circuit: str) -> IncidentFigures:
        """Everything about neutralisations at a circuit."""
        first = self.sc_first.at(circuit, "safety cars from the start")
        return IncidentFigures(
            sc_lap1=_at_most(first, 0.9),
            sc_per_lap=self.sc.at(circuit, "safety cars after the start"),
            vsc_per_lap=self.vsc.at(circuit, "virtual safety cars"),
            red_share=self.red_share,
            sc_laps=self.sc_laps,
            vsc_laps=self.vsc_laps,
            sc_lap_factor=believable(self._against_base("leader"), "sc_lap_factor"),
            sc_catch_factor=believable(self._against_base("closing"), "sc_catch_factor"),
            vsc_lap_factor=believable(self._against_base("virtual"), "vsc_lap_factor"),
            sc_gap_s=believable(self.factors["queue"], "sc_gap_s"),
            sc_wear_factor=SC_WEAR,
            vsc_wear_factor=VSC_WEAR,
            sc_per_retirement=_at_most(self.sc_by_out.at(circuit, "safety cars that came with a retirement"), MOST_BY_OUT[0]),
            vsc_per_retirement=_at_most(self.vsc_by_out.at(circuit, "virtual safety cars that came with one"), MOST_BY_OUT[1]),
            sc_per_retirement_lap1=_at_most(self.sc_by_first_out.at(circuit, "safety cars with a car out on lap 1"), MOST_BY_OUT[2]),
        )

    def retirement(self, team: str, season: int, circuit: str) -> tuple[Figure, Figure]:
        """Hazard per lap after the first, and probability of not completing lap 1."""
        own = self.retire.at(f"{season} {team}", "retirements after lap 1, by team and season")
        factor, se = self.retire_track.factor(circuit)
        value = own.value * factor
        later = Figure(value, float(value * np.hypot(own.se / own.value, se / factor)), own.n, f"{own.note}; this circuit x{factor:.2f}")
        return later, self.retire_first.at(circuit, "cars out on lap 1")

    def _against_base(self, name: str) -> Figure:
        found = self.factors[name]
        return found._replace(value=found.value * self.green_over_base, se=found.se * self.green_over_base)


def pool_incidents(analyses: Sequence[RaceAnalysis], history: Sequence[EarlierRace] = ()) -> IncidentPool:
    """Pool. Wet races are left out; races of `history` that are among the analyses are too."""
    dry = [(a, a.incidents) for a in analyses if a.incidents is not None]
    known = {a.entry.season_round for a in analyses}
    past = [p for p in history if (p.season, p.round) not in known]
    eras = [[p for p in past if p.season < VSC_CAME], [p for p in past if p.season >= VSC_CAME]]
    usual = {status: _usual(dry, status) for status in (SC, VSC)}
    every = [d for _, i in dry for d in i.deployments]
    reds, cars = sum(d.red for d in every), sum(d.status == SC for d in every)
    before, weight = RED_PRIOR
    share = (reds + sum(p.red_flags for p in eras[1]) + before * weight) / (
        cars + sum(max(len(p.safety_cars), p.red_flags) for p in eras[1]) + weight
    )
    n = cars + sum(len(p.safety_cars) for p in eras[1])
    team, track, first = _retirements(analyses)
    return IncidentPool(
        sc=pool_rates(
            _counted(dry, lambda i: (_later(i.deployments, SC), _green_laps(i))),
            *(_counted_past(era, lambda p: (sum(lap > FIRST for lap in p.safety_cars), p.laps)) for era in eras),
            usual=USUAL_SC,
        ),
        sc_first=pool_rates(
            _counted(dry, lambda i: (any(d.status == SC and d.lap <= FIRST for d in i.deployments), 1.0)),
            *(_counted_past(era, lambda p: (any(lap <= FIRST for lap in p.safety_cars), 1.0)) for era in eras),
            usual=USUAL_FIRST_SC,
        ),
        vsc=pool_rates(_counted(dry, lambda i: (_later(i.deployments, VSC), _green_laps(i))), usual=USUAL_VSC),
        sc_by_out=pool_rates(_with_retirements(dry, SC), usual=USUAL_SC_BY_OUT),
        vsc_by_out=pool_rates(_with_retirements(dry, VSC), usual=USUAL_VSC_BY_OUT),
        sc_by_first_out=pool_rates(_from_lap1(dry), usual=USUAL_SC_BY_FIRST_OUT),
        red_share=Figure(
            share,
            float(np.sqrt(share * (1 - share) / (n + weight))),
            n,
            f"{reds} of {cars} safety cars of the dry races; earlier seasons counted",
        ),
        sc_laps=_durations([d for d in every if d.status == SC and not d.red], usual[SC], 10, SC_LAPS),
        vsc_laps=_durations([d for d in every if d.status == VSC], usual[VSC], 5, VSC_LAPS),
        factors=_factors([i for _, i in dry]),
        green_over_base=float(np.median([i.green_s / a.pace.base_lap_s.value for a, i in dry if a.pace])) if dry else 1.03,
        retire=team,
        retire_track=track,
        retire_first=first,
    )


def _at_most(figure: Figure, most: float) -> Figure:
    return figure._replace(value=min(figure.value, most))


def _with_retirements(dry: Sequence[tuple[RaceAnalysis, IncidentAnalysis]], status: int) -> _Counts:
    """Deployments after the start that came with a retirement, and cars that retired on racing laps after the first, by circuit.

    A car that stops on a lap brings it out on this lap or the next, by the laps of the field's median car.
    """
    rows = []
    for a, incidents in dry:
        slow = {lap for d in incidents.deployments for lap in range(d.lap + 1, d.lap + len(d.excess))}
        out = [lap for lap in _out_laps(a) if lap > 1 and lap not in slow]
        came = [d for d in incidents.deployments if d.status == status and d.lap > FIRST and any(d.lap - lap in (0, 1) for lap in out)]
        rows.append((a.entry.circuit, float(len(came)), float(len(out))))
    return _summed(rows)


def _from_lap1(dry: Sequence[tuple[RaceAnalysis, IncidentAnalysis]]) -> _Counts:
    """Starts with cars out on lap 1 and a safety car, and cars out on lap 1, by circuit."""
    rows = []
    for a, incidents in dry:
        out = sum(lap == 1 for lap in _out_laps(a))
        came = out > 0 and any(d.status == SC and d.lap <= FIRST for d in incidents.deployments)
        rows.append((a.entry.circuit, float(came), float(out)))
    return _summed(rows)


def _out_laps(analysis: RaceAnalysis) -> list[int]:
    """Laps on which cars stopped for good."""
    return [done + 1 for _, done in analysis.retired if done < analysis.entry.laps]


def _later(deployments: Iterable[Deployment], status: int) -> int:
    return sum(d.status == status and d.lap > FIRST for d in deployments)


def _green_laps(incidents: IncidentAnalysis) -> float:
    return float(incidents.laps - FIRST - sum(len(d.excess) for d in incidents.deployments if d.lap > FIRST))


def _counted(dry: Sequence[tuple[RaceAnalysis, IncidentAnalysis]], count: Callable[[IncidentAnalysis], tuple[float, float]]) -> _Counts:
    return _summed((a.entry.circuit, *count(i)) for a, i in dry)


def _counted_past(past: Sequence[EarlierRace], count: Callable[[EarlierRace], tuple[float, float]]) -> _Counts:
    return _summed((p.circuit, *count(p)) for p in past)


def _summed(rows: Iterable[tuple[str, float, float]]) -> _Counts:
    found: _Counts = {}
    for group, events, exposure in rows:
        before = found.get(group, (0.0, 0.0))
        found[group] = (before[0] + float(events), before[1] + float(exposure))
    return found


def _usual(dry: Sequence[tuple[RaceAnalysis, IncidentAnalysis]], status: int) -> float:
    """Excess of a lap wholly under a status: upper quartile, as laps at either end are slow in part."""
    excess = [x for _, i in dry for d in i.deployments if d.status == status for x in d.excess]
    return float(np.quantile(excess, 0.75)) if excess else 0.4


def _durations(runs: Sequence[Deployment], usual: float, longest: int, published: tuple[float, ...]) -> tuple[float, ...]:
    """Shares of 1, 2, ... laps, a partly slow lap counted in part; the published shares with fewer than `MIN_RUNS` deployments."""
    if len(runs) < MIN_RUNS:
        return published
    laps = np.clip(np.rint([sum(d.excess) / usual for d in runs]), 1, longest).astype(int)
    counts = np.bincount(laps, minlength=2)[1:] + DURATION_PSEUDO
    shares = np.round(counts / counts.sum(), 4)
    shares[-1] = round(1.0 - float(shares[:-1].sum()), 4)
    return tuple(float(s) for s in shares)


def _factors(dry: Sequence[IncidentAnalysis]) -> dict[str, Figure]:
    """Lap times under neutralisation and the gap in the queue; a VSC's upper quartile, as most laps are under it for a part only."""
    return {
        "leader": _quantile([v for i in dry for v in i.leader], 0.5, "leader's laps behind the SC", 1.6),
        "closing": _quantile([v for i in dry for v in i.closing], 0.5, "cars closing up to the queue", 1.4),
        "virtual": _quantile([v for i in dry for v in i.virtual], 0.75, "whole laps of VSC", 1.4),
        "queue": _quantile([v for i in dry for v in i.queue_gap_s], 0.5, "queuing cars at the line", 0.8),
    }


def _quantile(values: Sequence[float], q: float, what: str, assumed: float) -> Figure:
    """Quantile with its standard error; laps of one deployment are correlated, so about ten of them count as one."""
    if len(values) < 10:
        return Figure(assumed, 0.15, 0, f"{what}: too few, Heilmeier et al. 2020 taken")
    se = 1.36 * robust_sd(values) / np.sqrt(max(len(values) / 10, 1))
    return Figure(float(np.quantile(values, q)), float(se), len(values), f"{what}, all races given")


def _retirements(analyses: Sequence[RaceAnalysis]) -> tuple[Rates, Rates, Rates]:
    """Later retirements by team and season, the same by circuit, cars out on lap 1 by circuit; dry races only."""
    team: list[tuple[str, float, float]] = []
    track: list[tuple[str, float, float]] = []
    first: list[tuple[str, float, float]] = []
    for a in analyses:
        if not a.dry:
            continue
        out = dict(a.retired)
        for driver, name, _ in a.entry.starters:
            done = out.get(driver, a.entry.laps)
            later = float(driver in out and done >= 1)
            team.append((f"{a.entry.season} {name}", later, max(done - 1.0, 0.0) + later))
            track.append((a.entry.circuit, later, max(done - 1.0, 0.0) + later))
            first.append((a.entry.circuit, float(driver in out and done < 1), 1.0))
    later, lap1 = USUAL_OUT, USUAL_FIRST_OUT
    return pool_rates(_summed(team), usual=later), pool_rates(_summed(track), usual=later), pool_rates(_summed(first), usual=lap1)
