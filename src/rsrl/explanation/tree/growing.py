"""Trees grown from samples: in one piece, or in two parts, when to stop and what to fit."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.tree.dataset import Samples
from rsrl.explanation.tree.driving import Calls, Floats
from rsrl.strategists import Tree, tree_from_classifier

MIN_SAMPLES: Final = 5
"""Samples a leaf has at least."""

COMPOUND_LEAVES: Final = 4
"""Leaves of the second part: what to fit."""


def grow(samples: Samples, weights: NDArray[np.float64], columns: Sequence[str], leaves: int, seed: int, *, two_part: bool = False) -> Tree:
    """A tree with at most `leaves` leaves, questions that change no answer taken out; its samples are those it was grown from."""
    if two_part:
        tree = _grow_two_parts(samples, weights, columns, leaves, seed)
    else:
        tree = _cart(samples.rows, samples.labels, weights, columns, leaves, seed).merged()
    return _counted(tree, samples)


def _counted(tree: Tree, samples: Samples) -> Tree:
    return tree.counted(samples.rows, samples.labels, samples.stands_for)


def _cart(rows: Floats, labels: Calls, weights: NDArray[np.float64], columns: Sequence[str], leaves: int, seed: int) -> Tree:
    """CART with the leaves that gain most grown first."""
    from sklearn.tree import DecisionTreeClassifier

    classifier = DecisionTreeClassifier(max_leaf_nodes=leaves, min_samples_leaf=MIN_SAMPLES, random_state=seed)
    return tree_from_classifier(classifier.fit(rows, labels, sample_weight=weights), columns)


def _grow_two_parts(samples: Samples, weights: NDArray[np.float64], columns: Sequence[str], leaves: int, seed: int) -> Tree:
    """First when to stop; then, once for all leaves that stop, what to fit, grafted on each and cut back to what can happen there.

    With fewer leaves than that takes the tree is grown in one piece.
    """
    stops = samples.labels > 0
    if not stops.any():
        return _cart(samples.rows, samples.labels, weights, columns, leaves, seed)
    what = _cart(samples.rows[stops], samples.labels[stops], weights[stops], columns, COMPOUND_LEAVES, seed).merged()
    best, low, high = None, 2, leaves
    while low <= high:  # the first part as large as leaves room for the second, by halving
        parts = (low + high) // 2
        when = _cart(samples.rows, stops.astype(np.int8), weights, columns, parts, seed).merged()
        tree = _counted(_grafted(when, what), samples).without_empty().merged()
        if len(tree.leaves) <= leaves:
            best, low = tree, parts + 1
        else:
            high = parts - 1
    return _cart(samples.rows, samples.labels, weights, columns, leaves, seed) if best is None else best


def _grafted(when: Tree, what: Tree) -> Tree:
    """`what` in the place of every leaf of `when` that stops."""
    tree = when
    for leaf in when.leaves[when.action[when.leaves] > 0][::-1]:
        tree = _replaced(tree, int(leaf), what)
    return tree


def _replaced(tree: Tree, leaf: int, branch: Tree) -> Tree:
    """`branch` in the place of one leaf; nodes that stand behind it move on."""
    more = len(branch.feature) - 1

    def moved(nodes: NDArray[np.int32]) -> NDArray[np.int32]:
        return np.where(nodes > leaf, nodes + more, nodes)

    def put(name: str, old: NDArray, new: NDArray) -> NDArray:
        return np.concatenate([old[:leaf], new, old[leaf + 1 :]]).astype(getattr(tree, name).dtype)

    inner = branch.feature >= 0
    children: dict[str, Any] = {
        side: put(side, moved(getattr(tree, side)), np.where(inner, getattr(branch, side) + leaf, getattr(branch, side)))
        for side in ("left", "right")
    }
    others: dict[str, Any] = {
        name: put(name, getattr(tree, name), getattr(branch, name)) for name in ("feature", "threshold", "action", "samples")
    }
    return replace(tree, **children, **others)
