"""The best fixed plan as a strategist: searched for before the race, for each tyre the car may start on."""

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.season import COMPOUNDS, RaceRecord
from rsrl.simulator import Plan
from rsrl.strategists.interface import column
from rsrl.strategists.plan_search.evaluator import Progress
from rsrl.strategists.plan_search.planned import PlannedStrategist
from rsrl.strategists.plan_search.search import search_plans

BUDGET: Final = 180_000
SC_BUDGET: Final = 250_000
"""Races simulated for the most common starting tyre, without and with a safety-car rule; a rarer tyre gets fewer, by the square root of its
relative frequency."""

MIN_SHARE: Final = 0.05


class BestPlanStrategist(PlannedStrategist):
    """Drives to the plan that a search finds best for the starting tyre, with or without a safety-car rule.

    Attributes:
        plans: the plan for each starting tyre by compound code.
    """

    def __init__(
        self, record: RaceRecord, car: int, seed: int, *, sc_rule: bool = False, budget: int | None = None, progress: Progress | None = None
    ) -> None:
        super().__init__("best-plan-sc" if sc_rule else "best-plan")
        budgets = start_budgets(record, budget or (SC_BUDGET if sc_rule else BUDGET))
        total, spent = sum(budgets.values()), 0
        self.plans: dict[int, Plan] = {}
        for start, own in budgets.items():
            report = _shifted(progress, spent, total) if progress else None
            self.plans[start] = search_plans(record, car, start, seed=seed, budget=own, sc_rule=sc_rule, progress=report).best
            spent += own
            if progress:
                progress(spent, total)

    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        """Take the plan for each race's starting tyre."""
        starts = sorted(self.plans)
        self.assign([self.plans[s] for s in starts], np.searchsorted(starts, column(environment, "tyre").astype(np.int64)))


def start_budgets(record: RaceRecord, budget: int) -> dict[int, int]:
    """Races to simulate for each starting tyre that teams used, by compound code."""
    weights = dict.fromkeys(range(len(COMPOUNDS)), 0.0)
    for entry in record.rivals.plans:
        weights[COMPOUNDS.index(entry.plan[0])] += entry.weight
    most = max(weights.values())
    return {start: round(budget * max(weight / most, MIN_SHARE) ** 0.5) for start, weight in weights.items() if weight > 0}


def _shifted(progress: Progress, spent: int, total: int) -> Callable[[int, int], None]:
    return lambda done, _: progress(spent + done, total)
