"""Where a policy's trees lie: in its folder, or, where nothing can be written there, in the user's cache under the policy's hash."""

import os
from pathlib import Path

from rsrl.errors import RsrlError
from rsrl.explanation.subject import ExplainedPolicy
from rsrl.season import RaceRecord
from rsrl.strategists.tree import Tree, load_tree, tree_file


class MissingTreeError(RsrlError):
    """No tree was fitted yet."""


def cache_folder(policy: ExplainedPolicy) -> Path:
    """The user's own folder for what is derived from a policy; named by its hash, so that another policy's is never met in it."""
    base = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    return base / "rsrl" / "trees" / policy.hash


def find_tree(policy: ExplainedPolicy, record: RaceRecord, car: int) -> Tree:
    """The tree fitted for a policy, a race and a car.

    Raises:
        MissingTreeError: none was fitted; the command that does is named.
        RsrlError: the file is another model's or broken.
    """
    folders = [folder for folder in (policy.folder, cache_folder(policy)) if tree_file(folder, record, car).is_file()]
    if not folders:
        driver = record.cars[car].driver
        command = f"rsrl explain {policy.name} --race {record.name} --driver {driver} --fit-tree"
        raise MissingTreeError(f"no tree of {policy.name} for {driver} at {record.name}; fit one with `{command}`")
    return load_tree(tree_file(folders[0], record, car), policy.hash)


def read_tree(path: Path, policy: ExplainedPolicy, record: RaceRecord) -> Tree:
    """A tree from a file. Raises RsrlError where it is no tree, or one of another model or race."""
    tree = load_tree(path, policy.hash)
    if tree.race and tree.race != record.name:
        raise RsrlError(f"{path}: a tree for {tree.race}, not for {record.name}")
    return tree


def store_tree(tree: Tree, policy: ExplainedPolicy, record: RaceRecord, car: int) -> Path:
    """Write a tree where `find_tree` finds it; returns its file. Raises RsrlError where neither folder can be written."""
    for folder in (policy.folder, cache_folder(policy)):
        if writable(folder):
            path = tree_file(folder, record, car)
            tree.save(path)
            return path
    raise RsrlError(f"{policy.folder} and {cache_folder(policy)}: neither can be written, so the tree cannot be kept")


def writable(folder: Path) -> bool:
    """Whether files can be made in a folder, which is itself made if it can."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)
