"""One interface, many ways to call a race: fixed plans, a heuristic, plan search, a trained policy."""

from rsrl.strategists.best_plan import BestPlanStrategist
from rsrl.strategists.clean_air import CleanAir
from rsrl.strategists.factory import STRATEGISTS, make_strategist
from rsrl.strategists.heuristic import HeuristicRules, HeuristicStrategist
from rsrl.strategists.imitation import ImitationStrategist
from rsrl.strategists.interface import Strategist
from rsrl.strategists.planned import FixedStrategist, PlannedStrategist
from rsrl.strategists.planner import PlannerStrategist
from rsrl.strategists.policy import PolicyStrategist, find_model
from rsrl.strategists.search import SEARCH_SEED, PlanSearch, RankedPlan, search_plans
from rsrl.strategists.windows import pit_windows, window_budget

__all__ = [
    "SEARCH_SEED",
    "STRATEGISTS",
    "BestPlanStrategist",
    "CleanAir",
    "FixedStrategist",
    "HeuristicRules",
    "HeuristicStrategist",
    "ImitationStrategist",
    "PlanSearch",
    "PlannedStrategist",
    "PlannerStrategist",
    "PolicyStrategist",
    "RankedPlan",
    "Strategist",
    "find_model",
    "make_strategist",
    "pit_windows",
    "search_plans",
    "window_budget",
]
