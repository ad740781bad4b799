"""Searching for the best plan before the race, and the strategists that drive to a plan."""

from rsrl.strategists.plan_search.best_plan import BestPlanStrategist
from rsrl.strategists.plan_search.clean_air import CleanAir
from rsrl.strategists.plan_search.evaluator import Progress
from rsrl.strategists.plan_search.hindsight import HindsightStrategist
from rsrl.strategists.plan_search.pit_windows import pit_windows, window_budget
from rsrl.strategists.plan_search.planned import FixedStrategist, PlannedStrategist
from rsrl.strategists.plan_search.search import SEARCH_SEED, PlanSearchResult, RankedPlan, search_plans

__all__ = [
    "SEARCH_SEED",
    "BestPlanStrategist",
    "CleanAir",
    "FixedStrategist",
    "HindsightStrategist",
    "PlanSearchResult",
    "PlannedStrategist",
    "Progress",
    "RankedPlan",
    "pit_windows",
    "search_plans",
    "window_budget",
]
