"""The leaves of a surrogate tree nearest to a decision, as the paper reports them, and what the policy says to them."""

from dataclasses import dataclass
from itertools import islice
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.explanation.counterfactual.coupled import Found, walk_leaves
from rsrl.explanation.counterfactual.nearest import Boxes, Norm
from rsrl.explanation.counterfactual.query import PolicyQuery
from rsrl.explanation.counterfactual.space import Space, described, space_of
from rsrl.explanation.moment import Moment
from rsrl.state import COLUMN, FEATURES
from rsrl.strategists import Tree, TreeRows

Floats = NDArray[np.float32]
LEAVES: Final = 12
"""Leaves walked, the cheapest first."""


@dataclass(frozen=True)
class Leaves:
    """What a tree says of a decision and the leaves of a target call.

    Attributes:
        x: the tree's row of the decision, float32 [C].
        says: the tree's call for it.
        space: how the row may be moved.
        found: nearest points, the cheapest first.
        rows: makes the tree's rows from raw ones.
    """

    x: Floats
    says: int
    space: Space
    found: tuple[Found, ...]
    rows: TreeRows


def nearest_leaves(tree: Tree, moment: Moment, features: str, target: int, norm: Norm, most: int = LEAVES) -> Leaves:
    """The leaves of `target` nearest to a decision; none where the tree never makes that call, or no leaf of it can be reached."""
    rows = TreeRows(tree.columns)
    x = rows.of_race(moment.raw)[-1]
    space = space_of(tree.columns, x, moment.record, features)
    low, high = tree.leaf_boxes()
    mine = tree.action[tree.leaves] == target
    boxes = Boxes(low[mine].astype(np.float32), high[mine].astype(np.float32), tree.leaves[mine])
    found = tuple(islice(walk_leaves(x, boxes, space, norm), most))
    for leaf in found:
        if tree.leaf(leaf.point) != leaf.leaf:
            raise RsrlError(f"tree of {tree.model}: a point of leaf {leaf.leaf} came to leaf {tree.leaf(leaf.point)}; fit the tree again")
    return Leaves(x, int(tree.actions(x[None])[0]), space, found, rows)


def substituted(moment: Moment, leaves: Leaves, found: Found) -> Floats:
    """The raw row of a decision with the features that moved put in, and nothing that follows from them.

    A difference between two features is put into one of them. What a tree remembers of past laps is not in the row, and stays.
    """
    raw = moment.raw[-1].copy()
    differences = []
    for i in np.flatnonzero(found.point != leaves.x).tolist():
        column, value = described(leaves.space.names[i]), found.point[i]
        if column.source == "derived":
            differences.append(i)
        elif column.source == "feature" and not column.category:
            raw[COLUMN[column.feature]] = value
        elif column.source == "feature" and value == 1.0:
            raw[COLUMN[column.feature]] = _code(column.feature, column.category)
    for i in differences:
        raw = _with_difference(raw, i, found.point[i], leaves)
    return raw


def _with_difference(raw: Floats, i: int, wanted: np.float32, leaves: Leaves) -> Floats:
    """A raw row in which the difference of column `i` comes nearest to the one wanted, one of the features it reads being moved for it."""
    reads = [COLUMN[name] for name in described(leaves.space.names[i]).reads]
    rows = np.repeat(raw[None], 1 + 2 * len(reads), axis=0)
    off = wanted - _columns(leaves, rows[:1])[0, i]
    for n, column in enumerate(reads):
        rows[1 + 2 * n, column] += off
        rows[2 + 2 * n, column] -= off
    nearest: Floats = rows[np.abs(_columns(leaves, rows)[:, i] - wanted).argmin()]
    return nearest


def _columns(leaves: Leaves, raw: Floats) -> Floats:
    leaves.rows.begin(len(raw))
    return leaves.rows(raw)


def _code(feature: str, category: str) -> float:
    return float(next(f for f in FEATURES if f.name == feature).categories.index(category))


def confirmed_on_last_lap(asker: PolicyQuery, leaves: Leaves, target: int) -> NDArray[np.bool_]:
    """Whether the policy makes the call where a leaf's point takes the place of the last lap, all else as it is, bool [found]."""
    if not leaves.found:
        return np.zeros(0, np.bool_)
    raw = np.stack([substituted(asker.moment, leaves, f) for f in leaves.found])
    legal = np.repeat(asker.moment.legal[None], len(raw), axis=0)
    legal[:, target] = True
    said: NDArray[np.bool_] = asker.policy.chosen(asker.of_rows(raw), legal) == target
    return said


def leaf_report(
    leaves: Leaves, last_lap: NDArray[np.bool_], consistent: NDArray[np.bool_], causal: NDArray[np.bool_]
) -> dict[str, Any] | None:
    """The nearest leaf as the paper reports it: what moves, how many features, how far; and whether the policy confirms it."""
    if not leaves.found:
        return None
    nearest = leaves.found[0]
    moved = np.flatnonzero(nearest.moved)
    return {
        "leaf": nearest.leaf,
        "distance": nearest.cost,
        "features_changed": len(moved),
        "changes": [_move(leaves, nearest, int(i)) for i in moved],
        "confirmed_on_last_lap": bool(last_lap[0]),
        "names_a_cause": bool(causal[0]),
        "confirmed_consistent": bool(consistent[0]),
        "tree_says": leaves.says,
    }


def _move(leaves: Leaves, found: Found, i: int) -> dict[str, Any]:
    return {
        "feature": leaves.space.names[i],
        "from": float(leaves.x[i]),
        "to": float(found.point[i]),
        "distance": float(found.distance[i]),
    }
