"""A surrogate tree of a policy: fitted as VIPER fits it, measured, read out loud."""

from rsrl.explanation.tree.draw import plot_tree, tree_text
from rsrl.explanation.tree.driving import Driven, Driver, joined
from rsrl.explanation.tree.explaining import explain_tree
from rsrl.explanation.tree.fit import FittedTree, fit_tree
from rsrl.explanation.tree.metrics import LabelFigures, label_figures
from rsrl.explanation.tree.page import tree_markup, tree_page
from rsrl.explanation.tree.path import Interval, merge_path
from rsrl.explanation.tree.store import find_tree, store_tree

__all__ = [
    "Driven",
    "Driver",
    "FittedTree",
    "Interval",
    "LabelFigures",
    "explain_tree",
    "find_tree",
    "fit_tree",
    "joined",
    "label_figures",
    "merge_path",
    "plot_tree",
    "store_tree",
    "tree_markup",
    "tree_page",
    "tree_text",
]
