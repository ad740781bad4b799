"""Hindsight: for each race the best plan there is, knowing its luck. No strategist can do better, but for what the search misses.

It simulates the very races it is to call, many plans each. A plan gives the same position there as when it is driven in the environment,
since everything random is a pure function of (seed, race, lap, car, purpose). What it shows is a bound, not a rival: it knows when
the safety car comes.

1. A first lot for every race: plans quick in clean air, the published ones, the best of a plan search, and what `dp` and `heuristic` drove.
2. Then best first, race by race: the plans one move away from the best not yet looked around, stops put on the race's slow laps included.
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
from rsrl.strategists.plan_search.plan_table import PlanBook
from rsrl.strategists.plan_search.planned import PlannedStrategist, published_by_start

PLANS_A_RACE: Final = 1000
FIRST_PLANS: Final = 150
REACH_S: Final = 10.0
"""Plans slower in clean air than the best by more are not in the first lot."""

PARENTS: Final = 3
"""Plans looked around at once, the best ones of each race."""

SLICE_RACES: Final = 128
"""Races searched side by side: their plans take some 35 MB."""

SLICE_ROWS: Final = 65_536
"""Races simulated in one go: about 10 MB of results."""

GAP_SCALE_S: Final = 100.0


class RaceSearch:
    """The search for the best plan of one race.

    Attributes:
        scores: by number of a plan, lower is better: position, and within it the gap to the car ahead.
        settled: the car wins, or does not finish whatever it does.
    """

    def __init__(self, slow_laps: Sequence[int]) -> None:
        self.scores: dict[int, float] = {}
        self.settled = False
        self._expanded: set[int] = set()
        self._slow_laps = slow_laps

    def enter(self, number: int, score: float, retired: bool) -> None:
        """Take note of how a plan did."""
        self.scores[number] = score
        self.settled |= retired or score < 2.0

    @property
    def best(self) -> int:
        """Number of the best plan so far."""
        return min(self.scores, key=lambda number: (self.scores[number], number))

    def next_plans(self, book: PlanBook, most: int) -> list[int]:
        """Plans to try next, at most so many in all: from around the best not yet looked around."""
        if self.settled or len(self.scores) >= most:
            return []
        fresh = [(score, number) for number, score in self.scores.items() if number not in self._expanded]
        found: dict[int, None] = {}
        for _, number in heapq.nsmallest(PARENTS, fresh):
            self._expanded.add(number)
            found |= dict.fromkeys((*book.at_laps(number, self._slow_laps), *book.moves(number)))
        return [number for number in found if number not in self.scores][: most - len(self.scores)]


class HindsightStrategist(PlannedStrategist):
    """Drives each race to the best plan found for that very race.

    Args:
        plans_a_race: how many plans are simulated on each race, at most.
        budget: races of the plan search that gives some of the first plans, as for `best-plan`.
    """

    def __init__(
        self,
        record: RaceRecord,
        car: int,
        seed: int,
        *,
        plans_a_race: int = PLANS_A_RACE,
        budget: int | None = None,
        progress: Progress | None = None,
    ) -> None:
        super().__init__("hindsight")
        self._record, self._car, self._most = record, car, plans_a_race
        published, clean_air = published_by_start(record, car), CleanAir(record, car)
        self._first: dict[int, list[Plan]] = {}
        for start, best in BestPlanStrategist(record, car, seed, budget=budget, progress=progress).plans.items():
            grid = grid_of_plans(clean_air.families((start,)), REACH_S, min(FIRST_PLANS, plans_a_race // 2))
            self._first[start] = [best, *published[start], *grid]
        self._guides: tuple[Strategist, ...] = (DpStrategist(record, car, seed), HeuristicStrategist(record, car, seed))

    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        """Search every race of the batch."""
        plans: list[Plan] = []
        for first in range(0, len(races), SLICE_RACES):
            plans += self._best_plans(environment, seed, races[first : first + SLICE_RACES])
        rows = {plan: i for i, plan in enumerate(dict.fromkeys(plans))}
        self.assign(list(rows), np.array([rows[plan] for plan in plans], np.int64))

    def _best_plans(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> list[Plan]:
        """The best plan found for each race."""
        book = PlanBook(self._record)
        twin = _twin(environment, len(races))
        driven, slow_laps = zip(*(_drive(guide, twin, seed, races) for guide in self._guides), strict=True)
        searches = [RaceSearch(laps) for laps in slow_laps[0]]
        wanted = [list(dict.fromkeys(book.numbers([*self._first[own[0].compounds[0]], *own]))) for own in zip(*driven, strict=True)]
        while any(wanted):
            self._try(environment.races, seed, races, searches, wanted, book)
            wanted = [search.next_plans(book, self._most) for search in searches]
        return [book[search.best] for search in searches]

    def _try(
        self, batch: RaceBatch, seed: int, races: NDArray[np.int64], searches: list[RaceSearch], wanted: list[list[int]], book: PlanBook
    ) -> None:
        """Simulate the plans wanted of each race, a slice at a time, and enter how they did."""
        table = np.concatenate([batch.table, book.table()])
        which = np.repeat(np.arange(len(races)), [len(numbers) for numbers in wanted])
        flat = np.array([number for numbers in wanted for number in numbers], np.int32)
        for first in range(0, len(flat), SLICE_ROWS):
            race, number = which[first : first + SLICE_ROWS], flat[first : first + SLICE_ROWS]
            focus_plans = number + np.int32(len(batch.table))
            result = run_rows(batch.figures, table, seed, races[race], batch.callers, focus=self._car, focus_plans=focus_plans)
            scores, retired = scores_of(result.positions, result.race_time_s, self._car), result.retired[:, self._car]
            for entry in zip(race.tolist(), number.tolist(), scores.tolist(), retired.tolist(), strict=True):
                searches[entry[0]].enter(*entry[1:])


def scores_of(positions: NDArray[np.int8], times_s: NDArray[np.float32], car: int) -> NDArray[np.float64]:
    """Position of the car in each race, and as the part after the point its gap to the car ahead; lower is better."""
    own = positions[:, car].astype(np.float64)
    ahead = positions == own[:, None] - 1
    gap_s = times_s[:, car].astype(np.float64) - np.where(ahead, times_s, 0.0).sum(axis=1)
    score: NDArray[np.float64] = own + np.where(own > 1, np.clip(gap_s / GAP_SCALE_S, 0.0, 0.99), 0.0)
    return score


def _twin(environment: RaceEnvironment, batch: int) -> RaceEnvironment:
    """An environment of the same race with the same rivals, to call it in before it is called."""
    twin, races = RaceEnvironment(environment.record, environment.car, batch=batch), environment.races
    twin.races.figures, twin.races.table, twin.races.callers = races.figures, races.table, races.callers
    return twin


def _drive(guide: Strategist, twin: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> tuple[list[Plan], list[list[int]]]:
    """What a guide drives on each race, as a plan, and the slow laps of each race."""
    twin.reset(seed, races)
    starts = column(twin, "tyre").astype(int).tolist()
    guide.begin(twin, seed, races)
    calls, status = np.zeros((len(races), twin.laps), np.int8), np.zeros((len(races), twin.laps), np.int8)
    for lap in range(twin.laps):
        status[:, lap] = np.where(twin.done, GREEN, twin.races.r[:, at.R_STATUS])
        call = np.where(twin.done, np.int8(0), guide.decide(twin))
        calls[:, lap] = call
        twin.step(call)  # a column of `calls` is another kind of array, for which the race would be compiled again
    plans = []
    for start, row in zip(starts, calls, strict=True):
        laps = np.flatnonzero(row)
        plans.append(Plan((start, *(int(call) - 1 for call in row[laps])), tuple(int(lap) + 1 for lap in laps)))
    return plans, [[int(lap) + 1 for lap in np.flatnonzero(row)] for row in status != GREEN]
