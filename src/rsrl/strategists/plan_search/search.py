"""The best plan before the race, by search: rank every legal plan in clean air, then simulate the promising ones.

1. All legal plans with 1 to 3 stops are ranked by their expected race time on an empty track.
2. Those within MAX_LOSS_S of the best are kept, thinned to a grid of stop laps.
3. In rounds of Monte Carlo simulation, on the same races for all plans, the better plans survive and are joined by neighbours of the
   best (one stop or all stops moved by a few laps, safety-car windows wider or narrower); each round simulates more races than the last.
4. The last few dozen plans are simulated on races that no round has used; reported means and intervals come from those races only.

The races are those of seed SEARCH_SEED + seed. The command line allows evaluation seeds up to 2**32 - 1, and training adds one million to
such a seed, so a search never meets a race that anything is evaluated or trained on.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.season import COMPOUND_NAMES, RaceRecord, race_hash
from rsrl.simulator import POINTS_BY_POSITION, Plan, compile_figures
from rsrl.statistics import Interval, mean_estimate, paired_difference, probability_of_best
from rsrl.strategists.plan_search.clean_air import CleanAir
from rsrl.strategists.plan_search.evaluator import PlanEvaluator, Progress, RaceBudget
from rsrl.strategists.plan_search.neighbours import grid_of_plans, neighbours, with_initial_windows

SEARCH_SEED: Final = 2**40
FINAL_RACE: Final = 1_000_000
"""Number of the first race of the final comparison; the rounds use races from 0."""

MAX_LOSS_S: Final = 8.0
"""Plans that lose more than this to the best in clean air are not simulated. At Bahrain a loss of 2 s costs half a place."""

INITIAL_PLANS: Final = 320
SEQUENCES: Final = 8
"""Compound sequences of which at least one plan is kept, so that the final compares real alternatives."""


class _Round(NamedTuple):
    """After `races` races `plans` plans survive, and the best `parents` of them add neighbours `moves` laps away."""

    races: int
    plans: int
    parents: int
    moves: tuple[int, ...]


ROUNDS: Final = (_Round(40, 80, 16, (2,)), _Round(120, 40, 6, (1, 3)), _Round(300, 24, 4, (1,)), _Round(700, 16, 0, ()))
FINAL_RACES: Final = 2000
DEFAULT_BUDGET: Final = 150_000
SC_BUDGET: Final = 210_000
"""Approximate number of races that ROUNDS and FINAL_RACES take, without and with a safety-car rule; another budget scales both."""

MIN_BUDGET: Final = 500


@dataclass(frozen=True)
class RankedPlan:
    """A plan of the final comparison, with figures from races that no plan was selected on.

    Attributes:
        mean_position, position_ci95: over the final races, with a 95 % interval (Student's t).
        behind_best, behind_best_ci95: paired difference to the best-ranked plan, in places; its interval is far narrower.
        mean_points, points_ci95: championship points a race.
        p_best: probability that its mean is the best of the plans ranked with it (Bayesian bootstrap over races).
        clean_air_loss_s: race time on an empty track beyond that of the quickest legal plan.
    """

    plan: Plan
    mean_position: float
    position_ci95: Interval
    behind_best: float
    behind_best_ci95: Interval
    mean_points: float
    points_ci95: Interval
    p_best: float
    clean_air_loss_s: float


@dataclass(frozen=True)
class PlanSearchResult:
    """The result of a plan search.

    Attributes:
        ranked: plans of the final comparison, best first.
        by_compounds: the best plan of each compound sequence, best first; their `p_best` is among these plans only.
        legal_plans: number of legal plans.
        races: number of simulated races.
        final_races: races of the final comparison, for each plan.
        seconds: wall-clock time.
    """

    ranked: tuple[RankedPlan, ...]
    by_compounds: tuple[RankedPlan, ...]
    legal_plans: int
    races: int
    final_races: int
    seconds: float

    @property
    def best(self) -> Plan:
        """The plan of the best mean finishing position."""
        return self.ranked[0].plan


_CACHE: dict[tuple[object, ...], PlanSearchResult] = {}


def search_plans(
    record: RaceRecord,
    car: int,
    start: int | None = None,
    *,
    seed: int = 0,
    budget: int = DEFAULT_BUDGET,
    sc_rule: bool = False,
    progress: Progress | None = None,
) -> PlanSearchResult:
    """Find the plan of the best mean finishing position for one car against rivals that drive as teams did.

    Args:
        start: compound code of the starting tyre; None compares all compounds that the car has a set of.
        seed: of the search's own races.
        budget: approximate number of races to simulate.
        sc_rule: plans may bring their next stop forward under a safety car, within windows that are searched as well.

    Results are cached for the life of the process.

    Raises:
        RsrlError: the budget is too small, or there is no legal plan.
    """
    if budget < MIN_BUDGET:
        raise RsrlError(f"a plan search on {budget} races finds nothing; allow at least {MIN_BUDGET}")
    key = (race_hash(record), car, start, seed, budget, sc_rule)
    if key not in _CACHE:
        scale = budget / (SC_BUDGET if sc_rule else DEFAULT_BUDGET)
        _CACHE[key] = _search(record, car, start, SEARCH_SEED + seed, scale, sc_rule, RaceBudget(budget, progress))
    return _CACHE[key]


def _search(record: RaceRecord, car: int, start: int | None, seed: int, scale: float, sc_rule: bool, spent: RaceBudget) -> PlanSearchResult:
    begun = time.perf_counter()
    figures, clean_air = compile_figures(record), CleanAir(record, car)
    starts = tuple(c for c in range(3) if record.sets_of(car)[c]) if start is None else (start,)
    families = clean_air.families(starts)
    if not families:
        raise RsrlError(f"{record.name}: no legal plan of 1 to 3 stops starts on {' or '.join(COMPOUND_NAMES[s] for s in starts)}")
    plans = grid_of_plans(families, MAX_LOSS_S, INITIAL_PLANS)
    if sc_rule:
        plans = with_initial_windows(plans)
    evaluator = PlanEvaluator(figures, car, seed, 0, spent)
    for stage in ROUNDS:
        plans = evaluator.best(plans, max(round(stage.races * scale), 8), stage.plans, SEQUENCES)
        leaders = {plan.compounds: plan for plan in reversed(plans)}  # the best of each sequence is improved as well
        parents = dict.fromkeys([*plans[: stage.parents], *leaders.values()])
        joining = [n for plan in parents for move in stage.moves for n in neighbours(plan, record, car, move, sc_rule)]
        plans = list(dict.fromkeys([*plans, *joining]))
    final = PlanEvaluator(figures, car, seed, FINAL_RACE, spent)
    races = max(round(FINAL_RACES * scale), 32)
    quickest_s = min(float(f.time_s.min()) for f in families)
    losses_s = {plan: clean_air.time_s(plan) - quickest_s for plan in plans}
    ranked = rank_plans(final, plans, races, losses_s)
    firsts = {entry.plan.compounds: entry.plan for entry in reversed(ranked)}
    by_compounds = rank_plans(final, list(firsts.values()), races, losses_s)
    legal = sum(len(f.laps) for f in families)
    return PlanSearchResult(ranked, by_compounds, legal, spent.spent, races, time.perf_counter() - begun)


def rank_plans(evaluator: PlanEvaluator, plans: Sequence[Plan], races: int, losses_s: dict[Plan, float]) -> tuple[RankedPlan, ...]:
    """Plans by mean position on the first `races` races of an evaluator, best first."""
    positions = evaluator.positions(plans, races).astype(np.int64)
    order = sorted(range(len(plans)), key=lambda i: (positions[i].mean(), plans[i]))
    p_best = probability_of_best(positions)
    return tuple(_ranked(plans[i], positions[i], positions[order[0]], float(p_best[i]), losses_s[plans[i]]) for i in order)


def _ranked(plan: Plan, positions: NDArray[np.int64], best: NDArray[np.int64], p_best: float, loss_s: float) -> RankedPlan:
    position, behind, points = mean_estimate(positions), paired_difference(positions, best), mean_estimate(POINTS_BY_POSITION[positions])
    return RankedPlan(plan, position.value, position.ci95, behind.value, behind.ci95, points.value, points.ci95, p_best, loss_s)
