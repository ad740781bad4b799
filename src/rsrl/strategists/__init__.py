"""One interface, many ways to call a race: fixed plans, a heuristic, plan search, a trained policy."""

from rsrl.strategists.dp import DpStrategist
from rsrl.strategists.factory import STRATEGISTS, make_strategist
from rsrl.strategists.heuristic import HeuristicRules, HeuristicStrategist
from rsrl.strategists.imitation import ImitationStrategist
from rsrl.strategists.interface import Strategist, made_legal
from rsrl.strategists.lookahead.planner import PlannerStrategist
from rsrl.strategists.lookahead.policy_search import SearchingPolicy, SearchSettings
from rsrl.strategists.plan_search.best_plan import BestPlanStrategist
from rsrl.strategists.plan_search.clean_air import CleanAir
from rsrl.strategists.plan_search.hindsight import HindsightStrategist
from rsrl.strategists.plan_search.pit_windows import pit_windows, window_budget
from rsrl.strategists.plan_search.planned import FixedStrategist, PlannedStrategist
from rsrl.strategists.plan_search.search import SEARCH_SEED, PlanSearch, RankedPlan, search_plans
from rsrl.strategists.policy import PolicyStrategist, find_model, is_model, outside_training, weights_hash
from rsrl.strategists.tree.columns import TreeColumn, TreeRows, describe, tree_columns
from rsrl.strategists.tree.tree import Condition, Tree, TreeStrategist, load_tree, stored_tree, tree_file, tree_from_classifier

__all__ = [
    "SEARCH_SEED",
    "STRATEGISTS",
    "BestPlanStrategist",
    "CleanAir",
    "Condition",
    "DpStrategist",
    "FixedStrategist",
    "HeuristicRules",
    "HeuristicStrategist",
    "HindsightStrategist",
    "ImitationStrategist",
    "PlanSearch",
    "PlannedStrategist",
    "PlannerStrategist",
    "PolicyStrategist",
    "RankedPlan",
    "SearchSettings",
    "SearchingPolicy",
    "Strategist",
    "Tree",
    "TreeColumn",
    "TreeRows",
    "TreeStrategist",
    "describe",
    "find_model",
    "is_model",
    "load_tree",
    "made_legal",
    "make_strategist",
    "outside_training",
    "pit_windows",
    "search_plans",
    "stored_tree",
    "tree_columns",
    "tree_file",
    "tree_from_classifier",
    "weights_hash",
    "window_budget",
]
