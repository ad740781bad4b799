"""Where a policy's trees are stored: in its folder, or, if that is read-only, in the user's cache under the policy's hash."""

import os
from pathlib import Path

from rsrl.errors import RsrlError
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.season import RaceRecord
from rsrl.strategists.tree import Tree, load_tree, save_tree, stored_tree, tree_file, tree_folders


def find_tree(policy: ExplainedPolicy, record: RaceRecord, car: int) -> Tree:
    """The tree fitted for a policy, a race and a car. Raises RsrlError as `strategists.tree.stored_tree`."""
    return stored_tree(policy.folder, policy.name, policy.hash, record, car)


def read_tree(path: Path, policy: ExplainedPolicy, record: RaceRecord) -> Tree:
    """A tree from a file. Raises RsrlError if it is not a tree, or a tree of another model or race."""
    tree = load_tree(path, policy.hash)
    if tree.race and tree.race != record.name:
        raise RsrlError(f"{path}: a tree for {tree.race}, not for {record.name}")
    return tree


def store_tree(tree: Tree, policy: ExplainedPolicy, record: RaceRecord, car: int) -> Path:
    """Write a tree where `find_tree` finds it; returns its file. Raises RsrlError if neither folder can be written."""
    folders = tree_folders(policy.folder, policy.hash)
    for folder in folders:
        if writable(folder):
            path = tree_file(folder, record, car)
            save_tree(tree, path)
            return path
    raise RsrlError(f"{folders[0]} and {folders[1]}: neither can be written, so the tree cannot be kept")


def writable(folder: Path) -> bool:
    """Whether files can be made in a folder, which is made if it does not exist."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)
