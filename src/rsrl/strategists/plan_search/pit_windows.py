"""Pit windows of a plan: how far each stop can move, the others fixed, before it costs places."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.season import RaceRecord
from rsrl.simulator import Plan, compile_figures
from rsrl.strategists.plan_search.evaluator import PlanEvaluator, Progress, RaceBudget
from rsrl.strategists.plan_search.neighbours import is_legal
from rsrl.strategists.plan_search.search import SEARCH_SEED

MAX_COST_PLACES: Final = 0.05
REACH_LAPS: Final = 10
STEP_LAPS: Final = 2
WINDOW_RACES: Final = 1200
FIRST_RACE: Final = 2_000_000
"""Number of the first race; the plan search uses lower numbers."""

Window = tuple[int, int]


def window_budget(plans: Sequence[Plan], races: int = WINDOW_RACES) -> int:
    """Upper bound of the races that `pit_windows` simulates."""
    return sum(races * (1 + plan.stops * (2 * REACH_LAPS // STEP_LAPS)) for plan in plans)


def pit_windows(
    record: RaceRecord, car: int, plans: Sequence[Plan], *, seed: int = 0, races: int = WINDOW_RACES, progress: Progress | None = None
) -> list[tuple[Window, ...]]:
    """First and last lap of each stop of each plan at which it costs less than MAX_COST_PLACES against the plan's own lap.

    Each stop is moved by up to REACH_LAPS either way on the same races, and a parabola fitted to the cost smooths the noise (the standard
    error at one lap is about 0.04 places). A window that ends REACH_LAPS away may be wider in truth.
    """
    evaluator = PlanEvaluator(
        compile_figures(record), car, SEARCH_SEED + seed, FIRST_RACE, RaceBudget(window_budget(plans, races), progress)
    )
    return [tuple(_window(evaluator, record, car, plan, stop, races) for stop in range(plan.stops)) for plan in plans]


def _window(evaluator: PlanEvaluator, record: RaceRecord, car: int, plan: Plan, stop: int, races: int) -> Window:
    offsets, moved = [0], [plan]
    for offset in range(-REACH_LAPS, REACH_LAPS + 1, STEP_LAPS):
        laps = tuple(lap + offset * (i == stop) for i, lap in enumerate(plan.laps))
        if offset and is_legal(candidate := replace(plan, laps=laps), record, car):
            offsets.append(offset)
            moved.append(candidate)
    positions = evaluator.positions(moved, races).astype(np.float64)
    first, last = cheap_offsets(np.array(offsets), positions.mean(axis=1))
    return plan.laps[stop] + first, plan.laps[stop] + last


def cheap_offsets(offsets: NDArray[np.int64], mean_positions: NDArray[np.float64]) -> tuple[int, int]:
    """Range of the tried offsets around 0 at which the smoothed mean position is less than MAX_COST_PLACES worse than at 0."""
    if len(offsets) < 3:
        return 0, 0
    curve = np.polynomial.Polynomial.fit(offsets, mean_positions, 2)
    tried = np.arange(offsets.min(), offsets.max() + 1)
    costly = curve(tried) - curve(0) >= MAX_COST_PLACES
    first = max((int(t) + 1 for t in tried[costly & (tried < 0)]), default=int(tried[0]))
    last = min((int(t) - 1 for t in tried[costly & (tried > 0)]), default=int(tried[-1]))
    return first, last
