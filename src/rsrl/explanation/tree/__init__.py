"""A surrogate tree of a policy: fitted with VIPER, measured, explained and drawn."""

from rsrl.explanation.tree.dataset import TreeEpisodes, TreeRecorder, side_by_side
from rsrl.explanation.tree.draw import plot_tree, tree_text
from rsrl.explanation.tree.fit import FittedTree, fit_tree
from rsrl.explanation.tree.metrics import LabelFigures, label_figures
from rsrl.explanation.tree.path import Interval, explain_tree, merge_path
from rsrl.explanation.tree.store import find_tree, store_tree

__all__ = [
    "FittedTree",
    "Interval",
    "LabelFigures",
    "TreeEpisodes",
    "TreeRecorder",
    "explain_tree",
    "find_tree",
    "fit_tree",
    "label_figures",
    "merge_path",
    "plot_tree",
    "side_by_side",
    "store_tree",
    "tree_text",
]
