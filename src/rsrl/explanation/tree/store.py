"""Where a policy's trees are stored: in its folder, or, if that is read-only, in the user's cache under the policy's hash."""

from pathlib import Path

from rsrl.cache_folder import can_write
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
    """Write a tree where `find_tree` finds it; returns its file. Raises RsrlError if no folder can be written."""
    folders = tree_folders(policy.folder, policy.hash)
    for folder in folders:
        if can_write(folder):
            path = tree_file(folder, record, car)
            save_tree(tree, path)
            return path
    raise RsrlError(f"{' and '.join(map(str, folders))}: cannot be written, so the tree cannot be kept")
