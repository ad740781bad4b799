"""Hindsight: the best plan for each race with full knowledge of its random draws, safety cars included.

An upper bound, not a competitor: no strategist can do better, except for plans that the search misses. It simulates many plans on the very
races that it will call. A plan finishes there where it finishes in the environment, since everything random is a pure function of (seed,
race, lap, car, purpose).

1. Initial plans: the quickest in clean air, the published ones, the best of a plan search, and what `dp` and `heuristic` drive on the race.
2. Best-first search, race by race: the best plans not yet expanded add their neighbours, and variants that stop on the race's slow laps.
"""

import heapq
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.season import GREEN, RaceRecord
from rsrl.simulator import Plan, RaceBatch, run_rows
from rsrl.simulator import layout as at
from rsrl.strategists.dp import DpStrategist
from rsrl.strategists.heuristic import HeuristicStrategist
from rsrl.strategists.interface import Strategist, column
from rsrl.strategists.plan_search.best_plan import BestPlanStrategist
from rsrl.strategists.plan_search.clean_air import CleanAir
from rsrl.strategists.plan_search.evaluator import Progress
from rsrl.strategists.plan_search.neighbours import grid_of_plans
from rsrl.strategists.plan_search.plan_table import PlanTable
from rsrl.strategists.plan_search.planned import PlannedStrategist, published_by_start

PLANS_PER_RACE: Final = 1000
INITIAL_PLANS: Final = 150
MAX_LOSS_S: Final = 10.0
"""Plans that lose more than this to the best in clean air are not among the initial plans."""

PARENTS: Final = 3
"""Plans of a race that are expanded at a time."""

SLICE_RACES: Final = 128
"""Races searched side by side; their plans take about 35 MB."""

SLICE_ROWS: Final = 65_536
"""Races simulated at a time; their results take about 10 MB."""

GAP_SCALE_S: Final = 100.0
"""Gap to the car ahead that counts as much as a place, as a tie-break among plans of equal position."""


class RaceSearch:
    """Best-first search for the best plan of one race.

    Attributes:
        scores: by plan number, lower is better: the position, and within a position the gap to the car ahead.
        settled: the car wins, or retires whatever its plan.
    """

    def __init__(self, slow_laps: Sequence[int]) -> None:
        self.scores: dict[int, float] = {}
        self.settled = False
        self._expanded: set[int] = set()
        self._slow_laps = slow_laps

    def record(self, number: int, score: float, retired: bool) -> None:
        """Record the result of a plan."""
        self.scores[number] = score
        self.settled |= retired or score < 2.0

    @property
    def best(self) -> int:
        """Number of the best plan so far."""
        return min(self.scores, key=lambda number: (self.scores[number], number))

    def next_plans(self, table: PlanTable, max_plans: int) -> list[int]:
        """Numbers of the plans to simulate next, around the best ones not yet expanded; at most `max_plans` over the whole search."""
        if self.settled or len(self.scores) >= max_plans:
            return []
        unexpanded = [(score, number) for number, score in self.scores.items() if number not in self._expanded]
        found: dict[int, None] = {}
        for _, number in heapq.nsmallest(PARENTS, unexpanded):
            self._expanded.add(number)
            found |= dict.fromkeys((*table.with_stop_on(number, self._slow_laps), *table.neighbours(number)))
        return [number for number in found if number not in self.scores][: max_plans - len(self.scores)]


class HindsightStrategist(PlannedStrategist):
    """Drives each race to the best plan found for that very race.

    Args:
        plans_per_race: upper limit of the plans simulated on each race.
        budget: races of the plan search that supplies some of the initial plans, as for `best-plan`.
    """

    def __init__(
        self,
        record: RaceRecord,
        car: int,
        seed: int,
        *,
        plans_per_race: int = PLANS_PER_RACE,
        budget: int | None = None,
        progress: Progress | None = None,
    ) -> None:
        super().__init__("hindsight")
        self._record, self._car, self._max_plans = record, car, plans_per_race
        published, clean_air = published_by_start(record, car), CleanAir(record, car)
        self._initial: dict[int, list[Plan]] = {}
        for start, best in BestPlanStrategist(record, car, seed, budget=budget, progress=progress).plans.items():
            grid = grid_of_plans(clean_air.families((start,)), MAX_LOSS_S, min(INITIAL_PLANS, plans_per_race // 2))
            self._initial[start] = [best, *published[start], *grid]
        self._guides: tuple[Strategist, ...] = (DpStrategist(record, car, seed), HeuristicStrategist(record, car, seed))

    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        """Search for the best plan of every race of the batch."""
        plans: list[Plan] = []
        for first in range(0, len(races), SLICE_RACES):
            plans += self._best_plans(environment, seed, races[first : first + SLICE_RACES])
        rows = {plan: i for i, plan in enumerate(dict.fromkeys(plans))}
        self.assign(list(rows), np.array([rows[plan] for plan in plans], np.int64))

    def _best_plans(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> list[Plan]:
        """The best plan found for each race of a slice."""
        table = PlanTable(self._record, self._car)
        twin = _copy_of(environment, len(races))
        driven, slow_laps = zip(*(_drive(guide, twin, seed, races) for guide in self._guides), strict=True)
        searches = [RaceSearch(laps) for laps in slow_laps[0]]
        wanted = [list(dict.fromkeys(table.add([*self._initial[own[0].compounds[0]], *own]))) for own in zip(*driven, strict=True)]
        while any(wanted):
            self._try(environment.races, seed, races, searches, wanted, table)
            wanted = [search.next_plans(table, self._max_plans) for search in searches]
        return [table[search.best] for search in searches]

    def _try(
        self, batch: RaceBatch, seed: int, races: NDArray[np.int64], searches: list[RaceSearch], wanted: list[list[int]], plans: PlanTable
    ) -> None:
        """Simulate the wanted plans of each race, a slice at a time, and record their results."""
        rows = np.concatenate([batch.table, plans.rows()])
        which = np.repeat(np.arange(len(races)), [len(numbers) for numbers in wanted])
        flat = np.array([number for numbers in wanted for number in numbers], np.int32)
        for first in range(0, len(flat), SLICE_ROWS):
            race, number = which[first : first + SLICE_ROWS], flat[first : first + SLICE_ROWS]
            focus_plans = number + np.int32(len(batch.table))
            result = run_rows(batch.figures, rows, seed, races[race], batch.callers, focus=self._car, focus_plans=focus_plans)
            scores, retired = scores_of(result.positions, result.race_time_s, self._car), result.retired[:, self._car]
            for entry in zip(race.tolist(), number.tolist(), scores.tolist(), retired.tolist(), strict=True):
                searches[entry[0]].record(*entry[1:])


def scores_of(positions: NDArray[np.int8], times_s: NDArray[np.float32], car: int) -> NDArray[np.float64]:
    """Score of the car in each race, float64 [B], lower is better: its position, plus its gap to the car ahead as a fraction below one."""
    own = positions[:, car].astype(np.float64)
    ahead = positions == own[:, None] - 1
    gap_s = times_s[:, car].astype(np.float64) - np.where(ahead, times_s, 0.0).sum(axis=1)
    score: NDArray[np.float64] = own + np.where(own > 1, np.clip(gap_s / GAP_SCALE_S, 0.0, 0.99), 0.0)
    return score


def _copy_of(environment: RaceEnvironment, batch: int) -> RaceEnvironment:
    """An environment of the same race with the same rivals, in which a guide can drive the races beforehand."""
    twin, races = RaceEnvironment(environment.record, environment.car, batch=batch), environment.races
    twin.races.figures, twin.races.table, twin.races.callers = races.figures, races.table, races.callers
    return twin


def _drive(guide: Strategist, twin: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> tuple[list[Plan], list[list[int]]]:
    """What a guide drives on each race, as a plan, and the laps of each race that were not green."""
    twin.reset(seed, races)
    starts = column(twin, "tyre").astype(int).tolist()
    guide.begin(twin, seed, races)
    calls, status = np.zeros((len(races), twin.laps), np.int8), np.zeros((len(races), twin.laps), np.int8)
    for lap in range(twin.laps):
        status[:, lap] = np.where(twin.done, GREEN, twin.races.r[:, at.R_STATUS])
        call = np.where(twin.done, np.int8(0), guide.decide(twin))
        calls[:, lap] = call
        twin.step(call)  # contiguous: for a column of `calls`, Numba would compile the race a second time
    plans = []
    for start, row in zip(starts, calls, strict=True):
        laps = np.flatnonzero(row)
        plans.append(Plan((start, *(int(call) - 1 for call in row[laps])), tuple(int(lap) + 1 for lap in laps)))
    return plans, [[int(lap) + 1 for lap in np.flatnonzero(row)] for row in status != GREEN]
