"""Counterfactual explanations: the smallest change of a race under which the policy itself makes another call."""

from rsrl.explanation.counterfactual.change import Change, RaceEditor, change_rows
from rsrl.explanation.counterfactual.explain import explain_counterfactual, find_counterfactual
from rsrl.explanation.counterfactual.leaves import walk_leaves
from rsrl.explanation.counterfactual.space import Boxes, NearestPoints, Space, nearest_points, space_of

__all__ = [
    "Boxes",
    "Change",
    "NearestPoints",
    "RaceEditor",
    "Space",
    "change_rows",
    "explain_counterfactual",
    "find_counterfactual",
    "nearest_points",
    "space_of",
    "walk_leaves",
]
