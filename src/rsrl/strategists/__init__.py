"""Ways of calling a race behind one interface: fixed plans, a heuristic, plan search, planning by rollouts, a trained policy."""

from rsrl.strategists.dp import DpStrategist
from rsrl.strategists.external import ExternalPolicy, ExternalPolicyStrategist, is_external, of_function
from rsrl.strategists.factory import STRATEGISTS, make_model_strategist, make_strategist, strategist_names
from rsrl.strategists.heuristic import HeuristicRules, HeuristicStrategist
from rsrl.strategists.imitation import ImitationStrategist
from rsrl.strategists.interface import Strategist, made_legal
from rsrl.strategists.lookahead import PlannerStrategist, PolicySearchStrategist, SearchSettings
from rsrl.strategists.plan_search import (
    SEARCH_SEED,
    BestPlanStrategist,
    CleanAir,
    FixedStrategist,
    HindsightStrategist,
    PlannedStrategist,
    PlanSearchResult,
    RankedPlan,
    pit_windows,
    search_plans,
    window_budget,
)
from rsrl.strategists.policy import (
    PolicyStrategist,
    find_model,
    is_model,
    load_policy,
    outside_training,
    strategist_of,
    weights_hash,
)
from rsrl.strategists.tree import (
    Condition,
    Tree,
    TreeColumn,
    TreeRows,
    TreeStrategist,
    describe,
    load_tree,
    stored_tree,
    tree_columns,
    tree_file,
    tree_from_classifier,
)

__all__ = [
    "SEARCH_SEED",
    "STRATEGISTS",
    "BestPlanStrategist",
    "CleanAir",
    "Condition",
    "DpStrategist",
    "ExternalPolicy",
    "ExternalPolicyStrategist",
    "FixedStrategist",
    "HeuristicRules",
    "HeuristicStrategist",
    "HindsightStrategist",
    "ImitationStrategist",
    "PlanSearchResult",
    "PlannedStrategist",
    "PlannerStrategist",
    "PolicySearchStrategist",
    "PolicyStrategist",
    "RankedPlan",
    "SearchSettings",
    "Strategist",
    "Tree",
    "TreeColumn",
    "TreeRows",
    "TreeStrategist",
    "describe",
    "find_model",
    "is_external",
    "is_model",
    "load_policy",
    "load_tree",
    "made_legal",
    "make_model_strategist",
    "make_strategist",
    "of_function",
    "outside_training",
    "pit_windows",
    "search_plans",
    "stored_tree",
    "strategist_names",
    "strategist_of",
    "tree_columns",
    "tree_file",
    "tree_from_classifier",
    "weights_hash",
    "window_budget",
]
