"""The best plan before the race, by brute force: rank every legal plan in clean air, then race those within reach.

1. All legal plans with 1 to 3 stops are ranked by their exact race time on an empty track.
2. Those within REACH_S of the best go on, thinned to a grid of stop laps.
3. Rounds of Monte Carlo on the same races for all: the better part goes on, joined by neighbours of the best (a stop a
   few laps earlier or later, all stops moved, safety-car windows wider or narrower), on ever more races.
4. The last few dozen meet on races none of the rounds has used. Means and intervals told are from those alone.

The races are those of seed SEARCH_SEED + seed. The command line allows evaluation seeds up to 2**32 - 1, and training
adds one million to such a seed, so a search never meets a race that anything is evaluated or trained on.
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
from rsrl.statistics import Interval, chance_of_best, mean_estimate, paired_difference
from rsrl.strategists.plan_search.clean_air import CleanAir
from rsrl.strategists.plan_search.evaluator import PlanEvaluator, Progress, RaceBudget
from rsrl.strategists.plan_search.neighbours import grid_of_plans, neighbours, with_first_windows

SEARCH_SEED: Final = 2**40
FINAL_RACE: Final = 1_000_000
"""Number of the first race of the final; the rounds use races from 0."""

REACH_S: Final = 8.0
"""Plans slower than the best by more in clean air do not race. At Bahrain 2 s of it cost half a place."""

FIRST_PLANS: Final = 320
SEQUENCES: Final = 8
"""Sequences of compounds of which at least one plan is kept, so that the final compares real alternatives."""


class _Round(NamedTuple):
    """After `races` races `plans` go on; the first `parents` send neighbours `moves` laps away."""

    races: int
    plans: int
    parents: int
    moves: tuple[int, ...]


ROUNDS: Final = (_Round(40, 80, 16, (2,)), _Round(120, 40, 6, (1, 3)), _Round(300, 24, 4, (1,)), _Round(700, 16, 0, ()))
FINAL_RACES: Final = 2000
DEFAULT_BUDGET: Final = 150_000
SC_BUDGET: Final = 210_000
"""Races that ROUNDS and FINAL_RACES take, about, without and with a safety-car rule; another budget scales them."""

LEAST_BUDGET: Final = 500


@dataclass(frozen=True)
class RankedPlan:
    """A plan of the final, with figures from races that chose nothing.

    Attributes:
        mean_position, position_ci95: over the races of the final; all intervals are 95 % ones by Student's t.
        behind_best, behind_best_ci95: places behind the first of the ranking on the same races, a far sharper comparison.
        mean_points, points_ci95: championship points a race.
        p_best: chance that its mean is the best of the plans ranked with it (Bayesian bootstrap over races).
        clean_air_loss_s: race time on an empty track against the quickest legal plan.
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
class PlanSearch:
    """What a search found.

    Attributes:
        ranked: plans of the final, best first.
        by_compounds: the best of them on each sequence of compounds, best first; `p_best` is among these.
        legal_plans: how many plans there were in all.
        races: how many races were simulated, and `final_races` how many each plan of the final ran.
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
        """The plan of the best mean position."""
        return self.ranked[0].plan


_FOUND: dict[tuple[object, ...], PlanSearch] = {}


def search_plans(
    record: RaceRecord,
    car: int,
    start: int | None = None,
    *,
    seed: int = 0,
    budget: int = DEFAULT_BUDGET,
    sc_rule: bool = False,
    progress: Progress | None = None,
) -> PlanSearch:
    """Find the plan of the best mean finishing position for one car against rivals that drive as teams did.

    Args:
        start: compound code of the starting tyre; None compares all there are sets of.
        seed: names the search's own races.
        budget: races to simulate, about.
        sc_rule: plans may take their next stop at once under a safety car, within windows that are searched as well.

    The result is kept and given again in this process.

    Raises:
        RsrlError: too small a budget, or no legal plan.
    """
    if budget < LEAST_BUDGET:
        raise RsrlError(f"a plan search on {budget} races finds nothing; allow {LEAST_BUDGET} at least")
    key = (race_hash(record), car, start, seed, budget, sc_rule)
    if key not in _FOUND:
        scale = budget / (SC_BUDGET if sc_rule else DEFAULT_BUDGET)
        _FOUND[key] = _search(record, car, start, SEARCH_SEED + seed, scale, sc_rule, RaceBudget(budget, progress))
    return _FOUND[key]


def _search(record: RaceRecord, car: int, start: int | None, seed: int, scale: float, sc_rule: bool, bill: RaceBudget) -> PlanSearch:
    begun = time.perf_counter()
    figures, clean_air = compile_figures(record), CleanAir(record, car)
    starts = tuple(c for c in range(3) if record.sets[c] > 0) if start is None else (start,)
    families = clean_air.families(starts)
    if not families:
        raise RsrlError(f"{record.name}: no legal plan of 1 to 3 stops starts on {' or '.join(COMPOUND_NAMES[s] for s in starts)}")
    plans = grid_of_plans(families, REACH_S, FIRST_PLANS)
    if sc_rule:
        plans = with_first_windows(plans)
    pool = PlanEvaluator(figures, car, seed, 0, bill)
    for stage in ROUNDS:
        plans = pool.best(plans, max(round(stage.races * scale), 8), stage.plans, SEQUENCES)
        leaders = {plan.compounds: plan for plan in reversed(plans)}  # of each sequence, so that its best is found too
        parents = dict.fromkeys([*plans[: stage.parents], *leaders.values()])
        joining = [n for plan in parents for move in stage.moves for n in neighbours(plan, record, move, sc_rule)]
        plans = list(dict.fromkeys([*plans, *joining]))
    final = PlanEvaluator(figures, car, seed, FINAL_RACE, bill)
    races = max(round(FINAL_RACES * scale), 32)
    quickest_s = min(float(f.time_s.min()) for f in families)
    losses_s = {plan: clean_air.time_s(plan) - quickest_s for plan in plans}
    ranked = rank_plans(final, plans, races, losses_s)
    firsts = {entry.plan.compounds: entry.plan for entry in reversed(ranked)}
    by_compounds = rank_plans(final, list(firsts.values()), races, losses_s)
    legal = sum(len(f.laps) for f in families)
    return PlanSearch(ranked, by_compounds, legal, bill.spent, races, time.perf_counter() - begun)


def rank_plans(pool: PlanEvaluator, plans: Sequence[Plan], races: int, losses_s: dict[Plan, float]) -> tuple[RankedPlan, ...]:
    """Plans by mean position on the first `races` races of a pool, best first."""
    positions = pool.positions(plans, races).astype(np.int64)
    order = sorted(range(len(plans)), key=lambda i: (positions[i].mean(), plans[i]))
    chances = chance_of_best(positions)
    return tuple(_ranked(plans[i], positions[i], positions[order[0]], float(chances[i]), losses_s[plans[i]]) for i in order)


def _ranked(plan: Plan, positions: NDArray[np.int64], best: NDArray[np.int64], chance: float, loss_s: float) -> RankedPlan:
    position, behind, points = mean_estimate(positions), paired_difference(positions, best), mean_estimate(POINTS_BY_POSITION[positions])
    return RankedPlan(plan, position.value, position.ci95, behind.value, behind.ci95, points.value, points.ci95, chance, loss_s)
