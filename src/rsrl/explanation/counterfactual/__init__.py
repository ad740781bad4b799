"""What would have to be different for another call: the nearest leaves of a tree, and causes changed and checked on the policy itself."""

from rsrl.explanation.counterfactual.change import Change, RaceEditor, change_rows
from rsrl.explanation.counterfactual.coupled import walk_leaves
from rsrl.explanation.counterfactual.explain import explain_counterfactual, find_counterfactual
from rsrl.explanation.counterfactual.nearest import Boxes, Nearest, nearest_points
from rsrl.explanation.counterfactual.space import Space, space_of

__all__ = [
    "Boxes",
    "Change",
    "Nearest",
    "RaceEditor",
    "Space",
    "change_rows",
    "explain_counterfactual",
    "find_counterfactual",
    "nearest_points",
    "space_of",
    "walk_leaves",
]
