"""Decision trees as surrogates of a policy: the tree, its columns, its file, and the strategist that calls with it."""

from rsrl.strategists.tree.columns import TreeColumn, TreeRows, describe, tree_columns
from rsrl.strategists.tree.files import MissingTreeError, load_tree, save_tree, stored_tree, tree_file, tree_folders
from rsrl.strategists.tree.strategist import TreeStrategist, default_tree_strategist
from rsrl.strategists.tree.tree import LEAF, Condition, Tree, tree_from_classifier

__all__ = [
    "LEAF",
    "Condition",
    "MissingTreeError",
    "Tree",
    "TreeColumn",
    "TreeRows",
    "TreeStrategist",
    "default_tree_strategist",
    "describe",
    "load_tree",
    "save_tree",
    "stored_tree",
    "tree_columns",
    "tree_file",
    "tree_folders",
    "tree_from_classifier",
]
