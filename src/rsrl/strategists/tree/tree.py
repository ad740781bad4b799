"""A decision tree that stands for a policy: as data, and as a strategist."""

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.agents import load_agent
from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.season import RaceRecord, find_car
from rsrl.strategists.interface import Strategist, made_legal
from rsrl.strategists.policy import find_model, weights_hash
from rsrl.strategists.tree.columns import TreeRows

Floats = NDArray[np.float32]
FORMAT: Final = 1
LEAF: Final = -1
N_ACTIONS: Final = 4
DEFAULT_POLICY: Final = "all"
"""The shipped policy whose tree calls races as the strategist `tree`."""


class Condition(NamedTuple):
    """One question on the way to a leaf: `column` at most `threshold`, or above it."""

    column: int
    threshold: float
    at_most: bool


@dataclass(frozen=True)
class Tree:
    """A binary tree over rows of `columns`. Node 0 is the root; a row goes left where its value is at most the threshold, in float32.

    Attributes:
        feature: int32 [n], column asked about, `LEAF` at a leaf.
        threshold: float32 [n].
        left, right: int32 [n], nodes that follow; `LEAF` at a leaf.
        action: int8 [n], the call most of a node's samples have; a leaf's is the tree's answer.
        samples: int64 [n, 4], labels of the fitting data that came to each node.
        columns: names of the columns (`tree_columns.describe`), natural units.
        model, model_hash: policy the tree stands for, and the first 16 hex digits of the SHA-256 of its weights.
        race, driver: it was fitted on; "" for several.
        race_hash: of the race's figures (`season.race_hash`).
        about: how it was fitted and what was measured, in types that JSON has.
    """

    feature: NDArray[np.int32]
    threshold: Floats
    left: NDArray[np.int32]
    right: NDArray[np.int32]
    action: NDArray[np.int8]
    samples: NDArray[np.int64]
    columns: tuple[str, ...]
    model: str = ""
    model_hash: str = ""
    race: str = ""
    driver: str = ""
    race_hash: str = ""
    about: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        n = len(self.feature)
        inner = self.feature != LEAF
        follow = np.concatenate([self.left[inner], self.right[inner]])
        parents = np.concatenate([np.flatnonzero(inner)] * 2)
        sound = (
            n > 0
            and all(len(a) == n for a in (self.threshold, self.left, self.right, self.action))
            and self.samples.shape == (n, N_ACTIONS)
            and bool((self.feature < len(self.columns)).all() and (self.feature >= LEAF).all())
            and bool((follow > parents).all() and (follow < n).all() and len(np.unique(follow)) == n - 1 == len(follow))
            and bool(((self.action >= 0) & (self.action < N_ACTIONS)).all() and np.isfinite(self.threshold).all())
        )
        if not sound:
            raise RsrlError("not a tree: its nodes do not fit together")

    @property
    def leaves(self) -> NDArray[np.int64]:
        """Nodes that are leaves."""
        return np.flatnonzero(self.feature == LEAF)

    @property
    def depth(self) -> int:
        """Most questions on the way to a leaf."""
        return int(self.depths().max())

    def depths(self) -> NDArray[np.int64]:
        """Questions on the way to each node."""
        depths = np.zeros(len(self.feature), np.int64)
        for node in np.flatnonzero(self.feature != LEAF):  # a node stands before those that follow it
            depths[self.left[node]] = depths[self.right[node]] = depths[node] + 1
        return depths

    def leaf_nodes(self, rows: Floats) -> NDArray[np.int64]:
        """The leaf each row of float32 [N, C] comes to: its node."""
        node = np.zeros(len(rows), np.int64)
        every = np.arange(len(rows))
        while True:
            column = self.feature[node]
            inner = column != LEAF
            if not inner.any():
                return node
            goes_left = rows[every, np.where(inner, column, 0)] <= self.threshold[node]
            node = np.where(inner, np.where(goes_left, self.left[node], self.right[node]), node)

    def leaf(self, row: Floats) -> int:
        """The leaf that one row [C] comes to: its node."""
        return int(self.leaf_nodes(row[None])[0])

    def actions(self, rows: Floats) -> NDArray[np.int8]:
        """The tree's answers int8 [N] to rows float32 [N, C], legal or not."""
        return self.action[self.leaf_nodes(rows)]

    def path(self, row: Floats) -> tuple[Condition, ...]:
        """The questions that one row [C] is asked, from the root on, as they were answered."""
        conditions, node = [], 0
        while self.feature[node] != LEAF:
            column = int(self.feature[node])
            at_most = bool(row[column] <= self.threshold[node])
            conditions.append(Condition(column, float(self.threshold[node]), at_most))
            node = int(self.left[node] if at_most else self.right[node])
        return tuple(conditions)

    def leaf_boxes(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """What comes to each leaf, in the order of `leaves`: rows with lower < value <= upper in every column; float64 [leaves, C] each."""
        n, c = len(self.feature), len(self.columns)
        lower, upper = np.full((n, c), -np.inf), np.full((n, c), np.inf)
        for node in np.flatnonzero(self.feature != LEAF):
            column, threshold = self.feature[node], float(self.threshold[node])
            for child in (self.left[node], self.right[node]):
                lower[child], upper[child] = lower[node], upper[node]
            upper[self.left[node], column] = min(upper[node, column], threshold)
            lower[self.right[node], column] = max(lower[node, column], threshold)
        return lower[self.leaves], upper[self.leaves]

    def counted(self, rows: Floats, labels: NDArray[np.int8], times: NDArray[np.int64] | None = None) -> "Tree":
        """The same tree with the samples that rows [N, C] with labels [N] bring to its nodes, each `times` [N] over; its answers stay."""
        samples = np.zeros_like(self.samples)
        np.add.at(samples, (self.leaf_nodes(rows), labels.astype(np.int64)), 1 if times is None else times)
        for node in np.flatnonzero(self.feature != LEAF)[::-1]:
            samples[node] = samples[self.left[node]] + samples[self.right[node]]
        return replace(self, samples=samples)

    def merged(self) -> "Tree":
        """The same answers with fewer questions: where all leaves below a node answer alike, it becomes a leaf."""
        alike = np.ones(len(self.feature), np.bool_)
        answer = self.action.copy()
        for node in np.flatnonzero(self.feature != LEAF)[::-1]:
            left, right = self.left[node], self.right[node]
            alike[node] = alike[left] and alike[right] and answer[left] == answer[right]
            answer[node] = answer[left] if alike[node] else self.action[node]
        return _rebuilt(replace(self, action=answer), alike, np.arange(len(alike)))

    def without_empty(self) -> "Tree":
        """Without the branches that no sample came to: the questions that lead there are not asked."""
        follow = np.arange(len(self.feature))
        empty = self.samples.sum(axis=1) == 0
        for node in np.flatnonzero(self.feature != LEAF)[::-1]:
            left, right = self.left[node], self.right[node]
            if empty[left] or empty[right]:
                follow[node] = follow[right] if empty[left] else follow[left]
        return _rebuilt(self, self.feature == LEAF, follow)

    def save(self, path: Path) -> None:
        """Write the tree as JSON. Raises RsrlError where the file cannot be written."""
        nodes = {name: getattr(self, name).tolist() for name in _ARRAYS}
        document = {"format": FORMAT} | {name: getattr(self, name) for name in _WORDS}
        document |= {"columns": list(self.columns), "nodes": nodes, "about": dict(self.about)}
        try:
            path.write_text(json.dumps(document) + "\n", encoding="utf-8")
        except OSError as error:
            raise RsrlError(f"{path}: cannot be written ({error.strerror}); choose another folder") from None


_ARRAYS: Final = {
    "feature": np.int32, "threshold": np.float32, "left": np.int32, "right": np.int32, "action": np.int8, "samples": np.int64,
}  # fmt: skip
_WORDS: Final = ("model", "model_hash", "race", "driver", "race_hash")


def _rebuilt(tree: Tree, leaf: NDArray[np.bool_], follow: NDArray[np.int64]) -> Tree:
    """The tree in which the nodes `leaf` [n] are leaves and node i is replaced by node follow[i]."""
    kept: list[int] = []
    waiting = [int(follow[0])]
    while waiting:
        node = waiting.pop()
        kept.append(node)
        if not leaf[node]:
            waiting += [int(follow[tree.right[node]]), int(follow[tree.left[node]])]
    number = {node: i for i, node in enumerate(kept)}
    at_leaf = leaf[kept]
    sides = [[LEAF if leaf[node] else number[int(follow[side[node]])] for node in kept] for side in (tree.left, tree.right)]
    return replace(
        tree,
        feature=np.where(at_leaf, LEAF, tree.feature[kept]).astype(np.int32),
        threshold=np.where(at_leaf, 0.0, tree.threshold[kept]).astype(np.float32),
        left=np.array(sides[0], np.int32),
        right=np.array(sides[1], np.int32),
        action=tree.action[kept],
        samples=tree.samples[kept],
    )


def load_tree(path: Path, model_hash: str | None = None) -> Tree:
    """Read a tree.

    Args:
        model_hash: of the policy it must stand for; None for any.

    Raises:
        RsrlError: there is no such file, it is no tree, or it is a tree of another model.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise RsrlError(f"{path}: cannot be read ({error.strerror})") from None
    except (UnicodeDecodeError, json.JSONDecodeError):
        raise RsrlError(f"{path}: not a tree file; fit the tree again") from None
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise RsrlError(f"{path}: not a tree file of format {FORMAT}; fit the tree again")
    try:
        nodes = document["nodes"]
        arrays: dict[str, Any] = {name: np.array(nodes[name], kind) for name, kind in _ARRAYS.items()}
        words: dict[str, Any] = {name: str(document[name]) for name in _WORDS}
        tree = Tree(**arrays, columns=tuple(map(str, document["columns"])), **words, about=dict(document["about"]))
    except (KeyError, TypeError, ValueError, OverflowError, IndexError) as error:
        raise RsrlError(f"{path}: not a whole tree file ({error}); fit the tree again") from None
    except RsrlError as error:
        raise RsrlError(f"{path}: {error}; fit the tree again") from None
    if model_hash is not None and tree.model_hash != model_hash:
        raise RsrlError(f"{path}: a tree of another model, {tree.model_hash}; the policy asked for is {model_hash}; fit the tree again")
    return tree


def float32_at_most(thresholds: NDArray[np.float64]) -> Floats:
    """The largest float32 at most each threshold: float32 values fall on the same side of it."""
    near = thresholds.astype(np.float32)
    return np.where(near.astype(np.float64) > thresholds, np.nextafter(near, np.float32(-np.inf)), near).astype(np.float32)


def tree_from_classifier(classifier: Any, columns: Sequence[str], actions: Sequence[int] | None = None) -> Tree:
    """A fitted scikit-learn `DecisionTreeClassifier` as a tree; samples are nodes' weights, rounded: see `counted`.

    Args:
        columns: names of the columns it was fitted on.
        actions: the call each of its classes stands for; None for the classes themselves.
    """
    inner = classifier.tree_
    codes = np.asarray(classifier.classes_ if actions is None else actions, np.int64)
    shares = inner.value[:, 0, :] * inner.weighted_n_node_samples[:, None]
    leaf = inner.children_left < 0
    samples = np.zeros((len(leaf), N_ACTIONS), np.int64)
    samples[:, codes] = np.rint(shares).astype(np.int64)
    return Tree(
        feature=np.where(leaf, LEAF, inner.feature).astype(np.int32),
        threshold=np.where(leaf, np.float32(0.0), float32_at_most(inner.threshold)).astype(np.float32),
        left=inner.children_left.astype(np.int32),
        right=inner.children_right.astype(np.int32),
        action=codes[shares.argmax(axis=1)].astype(np.int8),
        samples=samples,
        columns=tuple(columns),
    )


class TreeStrategist(Strategist):
    """Calls with a tree. A stop that may not be made becomes staying out; staying out, where that may not be, becomes a stop."""

    def __init__(self, tree: Tree, name: str = "tree") -> None:
        self.name = name
        self.tree = tree
        self._rows = TreeRows(tree.columns)

    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        """Start with an empty memory."""
        self._rows.begin(len(races))

    def decide(self, environment: RaceEnvironment) -> NDArray[np.int8]:
        """The answer of the leaf each race comes to, made legal."""
        return made_legal(self.tree.actions(self._rows(environment.raw)), environment.legal)


def tree_file(folder: Path, record: RaceRecord, car: int) -> Path:
    """Where the tree of a model in `folder` is stored for a race: the driver is named where it is not the race's default one."""
    driver = "" if car == find_car(record, None) else f"-{record.cars[car].driver}"
    return folder / f"tree-{record.name}{driver}.json"


class MissingTreeError(RsrlError):
    """No tree was fitted yet."""


def tree_folders(folder: Path, model_hash: str) -> tuple[Path, Path]:
    """Where a policy's trees lie: in its folder, or, where that cannot be written, in the user's cache under the policy's hash."""
    base = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    return folder, base / "rsrl" / "trees" / model_hash


def stored_tree(folder: Path, model: str, model_hash: str, record: RaceRecord, car: int) -> Tree:
    """The tree that was fitted for a policy, a race and a car.

    Raises:
        MissingTreeError: none was fitted; the command that does is named.
        RsrlError: the file is another model's or broken.
    """
    for place in tree_folders(folder, model_hash):
        if tree_file(place, record, car).is_file():
            return load_tree(tree_file(place, record, car), model_hash)
    driver = record.cars[car].driver
    command = f"rsrl explain {model} --race {record.name} --driver {driver} --fit-tree"
    raise MissingTreeError(f"no tree of {model} for {driver} at {record.name}; fit one with `{command}`")


def default_tree_strategist(record: RaceRecord, car: int) -> TreeStrategist:
    """The strategist `tree`: the stored tree of the shipped policy `DEFAULT_POLICY`. Raises RsrlError as `stored_tree`."""
    folder = find_model(DEFAULT_POLICY)
    agent, _ = load_agent(folder)
    return TreeStrategist(stored_tree(folder, DEFAULT_POLICY, weights_hash(agent), record, car))
