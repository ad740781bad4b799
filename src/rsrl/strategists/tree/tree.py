"""A decision tree over named columns, as arrays; a surrogate of a policy."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError

Floats = NDArray[np.float32]
LEAF: Final = -1
N_ACTIONS: Final = 4


class Condition(NamedTuple):
    """One test on the way to a leaf: the value of `column` is at most `threshold`, or above it."""

    column: int
    threshold: float
    at_most: bool


@dataclass(frozen=True)
class Tree:
    """A binary decision tree; node 0 is the root, and a row goes left where its value is at most the threshold, in float32.

    Attributes:
        feature: int32 [n], index of the column tested, `LEAF` at a leaf.
        threshold: float32 [n].
        left, right: int32 [n], child nodes; `LEAF` at a leaf.
        action: int8 [n], the most common label of a node's samples; at a leaf, the tree's prediction.
        samples: int64 [n, 4], number of fitting samples of each label that reached the node.
        columns: names of the columns (`describe`), in natural units.
        model, model_hash: the policy the tree approximates, and the first 16 hex digits of the SHA-256 of its weights.
        race, driver: what it was fitted on; "" for several.
        race_hash: of the race's figures (`season.race_hash`).
        about: how it was fitted and how it scored, in JSON types.
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
            raise RsrlError("not a tree: its nodes are inconsistent")

    @property
    def leaves(self) -> NDArray[np.int64]:
        """Indices of the leaf nodes."""
        return np.flatnonzero(self.feature == LEAF)

    @property
    def depth(self) -> int:
        """Number of tests on the longest path to a leaf."""
        return int(self.depths().max())

    def depths(self) -> NDArray[np.int64]:
        """Number of tests on the path to each node."""
        depths = np.zeros(len(self.feature), np.int64)
        for node in np.flatnonzero(self.feature != LEAF):  # parents come before their children
            depths[self.left[node]] = depths[self.right[node]] = depths[node] + 1
        return depths

    def leaf_nodes(self, rows: Floats) -> NDArray[np.int64]:
        """The leaf node that each row of float32 [N, C] reaches."""
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
        """The leaf node that one row [C] reaches."""
        return int(self.leaf_nodes(row[None])[0])

    def actions(self, rows: Floats) -> NDArray[np.int8]:
        """Predicted calls int8 [N] of rows float32 [N, C], legal or not."""
        return self.action[self.leaf_nodes(rows)]

    def path(self, row: Floats) -> tuple[Condition, ...]:
        """The conditions that one row [C] fulfils on its path from the root to a leaf."""
        conditions, node = [], 0
        while self.feature[node] != LEAF:
            column = int(self.feature[node])
            at_most = bool(row[column] <= self.threshold[node])
            conditions.append(Condition(column, float(self.threshold[node]), at_most))
            node = int(self.left[node] if at_most else self.right[node])
        return tuple(conditions)

    def leaf_boxes(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Bounds (lower, upper) of each leaf, in the order of `leaves`: lower < value <= upper in every column; float64 [leaves, C]."""
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
        """The same tree with sample counts of rows [N, C] with labels [N], each counted `times` [N] times; predictions do not change."""
        samples = np.zeros_like(self.samples)
        np.add.at(samples, (self.leaf_nodes(rows), labels.astype(np.int64)), 1 if times is None else times)
        for node in np.flatnonzero(self.feature != LEAF)[::-1]:
            samples[node] = samples[self.left[node]] + samples[self.right[node]]
        return replace(self, samples=samples)

    def merged(self) -> "Tree":
        """The same predictions with fewer tests: a node becomes a leaf where all leaves below it predict the same call."""
        alike = np.ones(len(self.feature), np.bool_)
        answer = self.action.copy()
        for node in np.flatnonzero(self.feature != LEAF)[::-1]:
            left, right = self.left[node], self.right[node]
            alike[node] = alike[left] and alike[right] and answer[left] == answer[right]
            answer[node] = answer[left] if alike[node] else self.action[node]
        return _rebuilt(replace(self, action=answer), alike, np.arange(len(alike)))

    def without_empty(self) -> "Tree":
        """The tree without branches that no sample reached, and without the tests that lead to them."""
        follow = np.arange(len(self.feature))
        empty = self.samples.sum(axis=1) == 0
        for node in np.flatnonzero(self.feature != LEAF)[::-1]:
            left, right = self.left[node], self.right[node]
            if empty[left] or empty[right]:
                follow[node] = follow[right] if empty[left] else follow[left]
        return _rebuilt(self, self.feature == LEAF, follow)


def _rebuilt(tree: Tree, leaf: NDArray[np.bool_], follow: NDArray[np.int64]) -> Tree:
    """The tree in which node i is replaced by node follow[i], and the nodes of the mask `leaf` [n] become leaves."""
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


def float32_at_most(thresholds: NDArray[np.float64]) -> Floats:
    """The largest float32 not above each threshold: every float32 value falls on the same side of both."""
    near = thresholds.astype(np.float32)
    return np.where(near.astype(np.float64) > thresholds, np.nextafter(near, np.float32(-np.inf)), near).astype(np.float32)


def tree_from_classifier(classifier: Any, columns: Sequence[str], actions: Sequence[int] | None = None) -> Tree:
    """A fitted scikit-learn `DecisionTreeClassifier` as a tree; its sample counts are rounded node weights, see `counted`.

    Args:
        columns: names of the columns it was fitted on.
        actions: the call that each of its classes stands for; None where the classes are calls.
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
