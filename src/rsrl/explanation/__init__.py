"""Why a policy makes a call: five explanation methods with one result type."""

from rsrl.explanation.attribution import explain_attribution
from rsrl.explanation.counterfactual import explain_counterfactual
from rsrl.explanation.episodes import Episode, EpisodeRecorder, Episodes, RaceOverError, first_finished_race, reach, record_episode
from rsrl.explanation.moment import Moment
from rsrl.explanation.policy import AnyPolicy, ExplainedCaller, ExplainedPolicy, check_methods, explainable, load_any_policy, load_explained
from rsrl.explanation.result import Decision, Explanation
from rsrl.explanation.summary import state_warnings, summarise_race
from rsrl.explanation.tree import explain_tree, fit_tree
from rsrl.explanation.what_if import explain_what_if, moment_from_state, safety_car_table

__all__ = [
    "AnyPolicy",
    "Decision",
    "Episode",
    "EpisodeRecorder",
    "Episodes",
    "ExplainedCaller",
    "ExplainedPolicy",
    "Explanation",
    "Moment",
    "RaceOverError",
    "check_methods",
    "explain_attribution",
    "explain_counterfactual",
    "explain_tree",
    "explain_what_if",
    "explainable",
    "first_finished_race",
    "fit_tree",
    "load_any_policy",
    "load_explained",
    "moment_from_state",
    "reach",
    "record_episode",
    "safety_car_table",
    "state_warnings",
    "summarise_race",
]
