"""Plans on trial: all on the same races (common random numbers), more races for those that do well."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from rsrl.simulator import Figures, Plan, simulate_plans

SLICE_RACES = 8192
"""Races simulated between two reports of progress, about."""

Progress = Callable[[int, int], None]
"""Called with (races done, races in all)."""


class RaceBudget:
    """Counts the races spent against those planned, for a progress bar."""

    def __init__(self, planned: int, progress: Progress | None = None) -> None:
        self.planned, self.spent, self._progress = planned, 0, progress

    def spend(self, races: int) -> None:
        """Count races just simulated."""
        self.spent += races
        if self._progress:
            self._progress(min(self.spent, self.planned), self.planned)


class PlanEvaluator:
    """Finishing positions of plans for one car on races `first`, `first` + 1 ... of a seed, whichever plan it is."""

    def __init__(self, figures: Figures, car: int, seed: int, first: int, bill: RaceBudget) -> None:
        self._figures, self._car, self._seed, self._first, self._bill = figures, car, seed, first, bill
        self._positions: dict[Plan, NDArray[np.int8]] = {}

    def positions(self, plans: Sequence[Plan], races: int) -> NDArray[np.int8]:
        """Positions of plans on the first `races` races, int8 [plans, races]; what is known is not simulated again."""
        lacking: dict[int, list[Plan]] = {}
        for plan in dict.fromkeys(plans):
            known = len(self._positions.get(plan, ()))
            if known < races:
                lacking.setdefault(known, []).append(plan)
        for known, group in lacking.items():
            self._extend(group, known, races)
        return np.array([self._positions[plan][:races] for plan in plans], np.int8)

    def _extend(self, plans: list[Plan], known: int, races: int) -> None:
        numbers = np.arange(self._first + known, self._first + races, dtype=np.int64)
        step = max(SLICE_RACES // len(numbers), 1)
        for i in range(0, len(plans), step):
            part = plans[i : i + step]
            positions, _ = simulate_plans(self._figures, self._car, part, self._seed, numbers)
            for plan, row in zip(part, positions, strict=True):
                self._positions[plan] = np.concatenate([self._positions.get(plan, np.zeros(0, np.int8)), row])
            self._bill.spend(len(part) * len(numbers))

    def best(self, plans: Sequence[Plan], races: int, keep: int, sequences: int) -> list[Plan]:
        """The `keep` plans of the best mean position on the first `races` races, best first, then the best plan of further
        sequences of compounds until there are `sequences` of them."""
        means = self.positions(plans, races).mean(axis=1)
        order = [plan for _, plan in sorted(zip(means, plans, strict=True))]
        kept = order[:keep]
        seen = {plan.compounds for plan in kept}
        for plan in order[keep:]:
            if len(seen) < sequences and plan.compounds not in seen:
                seen.add(plan.compounds)
                kept.append(plan)
        return kept
