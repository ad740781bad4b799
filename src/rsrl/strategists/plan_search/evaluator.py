"""Simulated results of plans, all on the same races (common random numbers); results are kept and extended on demand."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from rsrl.simulator import Figures, Plan, simulate_plans

SLICE_RACES = 8192
"""Approximate number of races simulated between two reports of progress."""

Progress = Callable[[int, int], None]
"""Called with (races simulated, races in all)."""


class RaceBudget:
    """Counts simulated races against the number planned, for a progress bar."""

    def __init__(self, planned: int, progress: Progress | None = None) -> None:
        self.planned, self.spent, self._progress = planned, 0, progress

    def spend(self, races: int) -> None:
        """Count races that have just been simulated."""
        self.spent += races
        if self._progress:
            self._progress(min(self.spent, self.planned), self.planned)


class PlanEvaluator:
    """Finishing positions of one car under different plans, all on races `first`, `first` + 1 ... of a seed."""

    def __init__(self, figures: Figures, car: int, seed: int, first: int, budget: RaceBudget) -> None:
        self._figures, self._car, self._seed, self._first, self._budget = figures, car, seed, first, budget
        self._positions: dict[Plan, NDArray[np.int8]] = {}

    def positions(self, plans: Sequence[Plan], races: int) -> NDArray[np.int8]:
        """Positions of plans on the first `races` races, int8 [plans, races]; only races not simulated before are simulated."""
        missing: dict[int, list[Plan]] = {}
        for plan in dict.fromkeys(plans):
            done = len(self._positions.get(plan, ()))
            if done < races:
                missing.setdefault(done, []).append(plan)
        for done, group in missing.items():
            self._extend(group, done, races)
        return np.array([self._positions[plan][:races] for plan in plans], np.int8)

    def _extend(self, plans: list[Plan], done: int, races: int) -> None:
        numbers = np.arange(self._first + done, self._first + races, dtype=np.int64)
        step = max(SLICE_RACES // len(numbers), 1)
        for i in range(0, len(plans), step):
            part = plans[i : i + step]
            positions, _ = simulate_plans(self._figures, self._car, part, self._seed, numbers)
            for plan, row in zip(part, positions, strict=True):
                self._positions[plan] = np.concatenate([self._positions.get(plan, np.zeros(0, np.int8)), row])
            self._budget.spend(len(part) * len(numbers))

    def best(self, plans: Sequence[Plan], races: int, keep: int, sequences: int) -> list[Plan]:
        """The plans that survive a round: the best `keep` of them, and the best of other compound sequences.

        Args:
            races: plans are ranked by mean position on this many races.
            keep: plans to keep, best first.
            sequences: then the best plan of each further compound sequence follows, until this many sequences are represented.
        """
        means = self.positions(plans, races).mean(axis=1)
        order = [plan for _, plan in sorted(zip(means, plans, strict=True))]
        kept = order[:keep]
        seen = {plan.compounds for plan in kept}
        for plan in order[keep:]:
            if len(seen) < sequences and plan.compounds not in seen:
                seen.add(plan.compounds)
                kept.append(plan)
        return kept
