"""Why a policy calls what it calls: one result type for every way of explaining it."""

from rsrl.explanation.attribution import explain_attribution
from rsrl.explanation.counterfactual import explain_counterfactual
from rsrl.explanation.moment import Moment, reach
from rsrl.explanation.policy import ExplainedPolicy, load_explained
from rsrl.explanation.result import Decision, Explanation
from rsrl.explanation.summary import drive, state_warnings, summarise_race
from rsrl.explanation.tree import explain_tree, fit_tree
from rsrl.explanation.what_if import explain_what_if, moment_from_state, safety_car_table

__all__ = [
    "Decision",
    "ExplainedPolicy",
    "Explanation",
    "Moment",
    "drive",
    "explain_attribution",
    "explain_counterfactual",
    "explain_tree",
    "explain_what_if",
    "fit_tree",
    "load_explained",
    "moment_from_state",
    "reach",
    "safety_car_table",
    "state_warnings",
    "summarise_race",
]
