"""Tree files: JSON, one for each policy, race and car, in the policy's folder or the user's cache."""

import json
from pathlib import Path
from typing import Any, Final

import numpy as np

from rsrl.cache_folder import cache_folder
from rsrl.errors import RsrlError
from rsrl.season import RaceRecord, find_car
from rsrl.strategists.tree.tree import Tree
from rsrl.text_files import read_text

FORMAT: Final = 1
_ARRAYS: Final = {
    "feature": np.int32, "threshold": np.float32, "left": np.int32, "right": np.int32, "action": np.int8, "samples": np.int64,
}  # fmt: skip
_STRINGS: Final = ("model", "model_hash", "race", "driver", "race_hash")


def save_tree(tree: Tree, path: Path) -> None:
    """Write a tree as JSON. Raises RsrlError where the file cannot be written."""
    nodes = {name: getattr(tree, name).tolist() for name in _ARRAYS}
    document = {"format": FORMAT} | {name: getattr(tree, name) for name in _STRINGS}
    document |= {"columns": list(tree.columns), "nodes": nodes, "about": dict(tree.about)}
    try:
        path.write_text(json.dumps(document) + "\n", encoding="utf-8")
    except OSError as error:
        raise RsrlError(f"{path}: cannot be written ({error.strerror}); choose another folder") from None


def load_tree(path: Path, model_hash: str | None = None) -> Tree:
    """Read a tree.

    Args:
        model_hash: of the policy that the tree must approximate; None accepts any.

    Raises:
        RsrlError: the file cannot be read, is not a tree file, or holds a tree of another model.
    """
    try:
        document = json.loads(read_text(path))
    except OSError as error:
        raise RsrlError(f"{path}: cannot be read ({error.strerror})") from None
    except (UnicodeDecodeError, json.JSONDecodeError):
        raise RsrlError(f"{path}: not a tree file; fit the tree again") from None
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise RsrlError(f"{path}: not a tree file of format {FORMAT}; fit the tree again")
    try:
        nodes = document["nodes"]
        arrays: dict[str, Any] = {name: np.array(nodes[name], kind) for name, kind in _ARRAYS.items()}
        strings: dict[str, Any] = {name: str(document[name]) for name in _STRINGS}
        tree = Tree(**arrays, columns=tuple(map(str, document["columns"])), **strings, about=dict(document["about"]))
    except (KeyError, TypeError, ValueError, OverflowError, IndexError) as error:
        raise RsrlError(f"{path}: not a whole tree file ({error}); fit the tree again") from None
    except RsrlError as error:
        raise RsrlError(f"{path}: {error}; fit the tree again") from None
    if model_hash is not None and tree.model_hash != model_hash:
        raise RsrlError(f"{path}: a tree of another model, {tree.model_hash}; the policy asked for is {model_hash}; fit the tree again")
    return tree


def tree_file(folder: Path, record: RaceRecord, car: int) -> Path:
    """File of a model's tree for a race; its name has the driver where that is not the race's default driver."""
    driver = "" if car == find_car(record, None) else f"-{record.cars[car].driver}"
    return folder / f"tree-{record.name}{driver}.json"


class MissingTreeError(RsrlError):
    """No tree has been fitted yet."""


def tree_folders(folder: Path, model_hash: str) -> tuple[Path, ...]:
    """Folders of a policy's trees: its own, and one in the cache folder, used where its own cannot be written."""
    cache = cache_folder()
    return (folder, cache / "trees" / model_hash) if cache else (folder,)


def stored_tree(folder: Path, model: str, model_hash: str, record: RaceRecord, car: int) -> Tree:
    """The tree fitted for a policy, a race and a car.

    Raises:
        MissingTreeError: none has been fitted; the message names the command that does.
        RsrlError: the file is broken, or of another model.
    """
    for place in tree_folders(folder, model_hash):
        if tree_file(place, record, car).is_file():
            return load_tree(tree_file(place, record, car), model_hash)
    driver = record.cars[car].driver
    command = f"rsrl explain {model} --race {record.name} --driver {driver} --fit-tree"
    raise MissingTreeError(f"no tree of {model} for {driver} at {record.name}; fit one with `{command}`")
