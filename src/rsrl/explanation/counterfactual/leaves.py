"""The leaves of a surrogate tree nearest to a decision, as the paper reports them, and what the policy itself calls there.

Leaves come in order of cost. `space` solves each in closed form, which ignores that some gaps are ordered: the gap to the leader is never
less than the gap ahead. Where a point breaks that, the gaps concerned are solved together by a mixed-integer program. The closed form is a
lower bound of that cost, so that no more leaves are solved than are walked to.
"""

import heapq
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.explanation.counterfactual.query import PolicyQuery
from rsrl.explanation.counterfactual.space import Boxes, Norm, Space, bounds, cost_of, described, nearest_points, space_of
from rsrl.explanation.moment import Moment
from rsrl.state import COLUMN, FEATURES
from rsrl.strategists import Tree, TreeRows

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
MAX_LEAVES: Final = 12
"""Leaves walked to, the cheapest first."""

TOLERANCE: Final = 1.0e-9
MAX_CUTS: Final = 200
"""The l2 norm is solved by cutting planes to this tolerance, or so many rounds."""


class LeafPoint(NamedTuple):
    """A point of a leaf.

    Attributes:
        leaf: number of the leaf in the tree.
        point: float32 [n].
        cost: distance under the norm.
        distance: scaled distance of each column, float64 [n].
        moved: columns that move, bool [n].
    """

    leaf: int
    point: Floats
    cost: float
    distance: Doubles
    moved: NDArray[np.bool_]


@dataclass(frozen=True)
class NearestLeaves:
    """The leaves of one call that are nearest to a decision.

    Attributes:
        x: the tree's row of the decision, float32 [n].
        tree_call: the tree's own call for it.
        space: how the row may be moved.
        points: nearest points, the cheapest first.
        rows: makes the tree's rows from raw ones.
    """

    x: Floats
    tree_call: int
    space: Space
    points: tuple[LeafPoint, ...]
    rows: TreeRows


def nearest_leaves(tree: Tree, moment: Moment, features: str, target: int, norm: Norm, count: int = MAX_LEAVES) -> NearestLeaves:
    """The leaves of `target` nearest to a decision; none where the tree never makes that call, or no such leaf can be reached."""
    rows = TreeRows(tree.columns)
    x = rows.of_race(moment.raw)[-1]
    space = space_of(tree.columns, x, moment.record, features)
    low, high = tree.leaf_boxes()
    chosen = tree.action[tree.leaves] == target
    boxes = Boxes(low[chosen].astype(np.float32), high[chosen].astype(np.float32), tree.leaves[chosen])
    points = tuple(islice(walk_leaves(x, boxes, space, norm), count))
    for one in points:
        if tree.leaf(one.point) != one.leaf:
            raise RsrlError(f"tree of {tree.model}: a point of leaf {one.leaf} came to leaf {tree.leaf(one.point)}; fit the tree again")
    return NearestLeaves(x, int(tree.actions(x[None])[0]), space, points, rows)


def confirmed_on_last_lap(query: PolicyQuery, leaves: NearestLeaves, target: int) -> NDArray[np.bool_]:
    """Whether the policy makes the call where a leaf's point replaces the last row and all else stays as it is, bool [points]."""
    if not leaves.points:
        return np.zeros(0, np.bool_)
    raw = np.stack([_substituted(query.moment, leaves, point) for point in leaves.points])
    legal = np.repeat(query.moment.legal[None], len(raw), axis=0)
    legal[:, target] = True
    confirmed: NDArray[np.bool_] = query.policy.chosen(query.q_of_last_rows(raw), legal) == target
    return confirmed


def _substituted(moment: Moment, leaves: NearestLeaves, point: LeafPoint) -> Floats:
    """The raw row of a decision with the features that move put in, and nothing that follows from them.

    A difference between two features is put into one of them. A tree's memory of past laps is not in the row, and stays as it is.
    """
    raw = moment.raw[-1].copy()
    differences = []
    for i in np.flatnonzero(point.point != leaves.x).tolist():
        column, value = described(leaves.space.names[i]), point.point[i]
        if column.source == "derived":
            differences.append(i)
        elif column.source == "feature" and not column.category:
            raw[COLUMN[column.feature]] = value
        elif column.source == "feature" and value == 1.0:
            raw[COLUMN[column.feature]] = FEATURES[COLUMN[column.feature]].categories.index(column.category)
    for i in differences:
        raw = _with_difference(raw, i, point.point[i], leaves)
    return raw


def _with_difference(raw: Floats, i: int, wanted: np.float32, leaves: NearestLeaves) -> Floats:
    """A raw row in which the difference of column `i` is as near to the one wanted as moving one of its two features makes it."""
    reads = [COLUMN[name] for name in described(leaves.space.names[i]).reads]
    rows = np.repeat(raw[None], 1 + 2 * len(reads), axis=0)
    off = wanted - _tree_rows(leaves, rows[:1])[0, i]
    for n, column in enumerate(reads):
        rows[1 + 2 * n, column] += off
        rows[2 + 2 * n, column] -= off
    nearest: Floats = rows[np.abs(_tree_rows(leaves, rows)[:, i] - wanted).argmin()]
    return nearest


def _tree_rows(leaves: NearestLeaves, raw: Floats) -> Floats:
    leaves.rows.begin(len(raw))
    return leaves.rows(raw)


def walk_leaves(x: Floats, boxes: Boxes, space: Space, norm: Norm = "l1") -> Iterator[LeafPoint]:
    """The nearest point of each leaf that can be reached, the order of gaps kept, the cheapest first."""
    near = nearest_points(x, boxes, space, norm)
    queue: list[tuple[float, int, int, bool]] = []
    for rank, i in enumerate(near.order()):
        queue.append((float(near.cost[i]), rank, int(i), _keeps_order(near.points[i], space)))
    heapq.heapify(queue)
    solved: dict[int, LeafPoint] = {}
    while queue:
        cost, rank, i, final = heapq.heappop(queue)
        if i in solved:
            yield solved[i]
            continue
        closed_form = LeafPoint(int(boxes.leaf[i]), near.points[i], cost, near.distance[i], near.moved[i])
        if final:
            yield closed_form
            continue
        point = _solve_leaf(x, Boxes(boxes.low[i : i + 1], boxes.high[i : i + 1], boxes.leaf[i : i + 1]), space, norm, closed_form)
        if point is not None:
            solved[i] = point
            heapq.heappush(queue, (point.cost, rank, i, True))


def _keeps_order(point: Floats, space: Space) -> bool:
    return all(point[j] >= point[i] for i, j in space.ordered)


def _solve_leaf(x: Floats, leaf: Boxes, space: Space, norm: Norm, near: LeafPoint) -> LeafPoint | None:
    """The nearest point of one leaf that keeps the order of gaps, None where there is none; other columns are as in the closed form."""
    columns = sorted({c for pair in space.ordered for c in pair})
    low, high = (b[0, columns] for b in bounds(leaf, space))
    start, least, most = space.transformed(np.stack([_with_values(x, v, columns) for v in (x[columns], low, high)]))[:, columns]
    pairs = [(columns.index(i), columns.index(j)) for i, j in space.ordered]
    values = _solve_program(start, least, most, space.factor[columns], pairs, norm)
    if values is None:
        return None
    point = near.point.copy()
    natural = np.where(space.logarithmic[columns], np.expm1(values), values)
    point[columns] = _rounded_in_order(np.clip(natural.astype(np.float32), low, high), pairs, low, high)
    still = np.abs(point - x) <= 1.0e-6 * (1.0 + np.abs(x))  # the solver's rounding is no move
    back = np.where(still, x, point).astype(np.float32)
    if _keeps_order(back, space) and bool(((back > leaf.low[0]) & (back <= leaf.high[0]))[columns].all()):
        point = back
    if not _keeps_order(point, space):
        return None
    distance, moved = near.distance.copy(), near.moved.copy()
    distance[columns] = (np.abs(space.transformed(point) - space.transformed(x)) * space.factor)[columns]
    moved[columns] = (point != x)[columns]
    return LeafPoint(near.leaf, point, float(cost_of(distance, moved, norm)), distance, moved)


def _with_values(x: Floats, values: Floats, columns: list[int]) -> Floats:
    row = x.copy()
    row[columns] = values
    return row


def _rounded_in_order(values: Floats, pairs: list[tuple[int, int]], low: Floats, high: Floats) -> Floats:
    """Undo what rounding to single precision did to the order: raise the value that should be greater, else lower the other one."""
    for _ in pairs:
        for i, j in pairs:
            if values[j] < values[i]:
                values[j] = min(values[i], high[j])
                values[i] = max(min(values[i], values[j]), low[i])
    return values


def _solve_program(x: Doubles, low: Doubles, high: Doubles, factor: Doubles, pairs: list[tuple[int, int]], norm: Norm) -> Doubles | None:
    """Values [m] of least cost within bounds in which no pair is out of order; None where there are none.

    Variables: values y [m], costs t [m], moves z [m], 0 or 1. l1: the sum of t >= factor |y - x|. l0: the sum of z, y equal to x where z is
    0, a big-M constraint. l2: the sum of t, each t above the tangents of (factor (y - x))^2 at the solutions so far (cutting planes).
    """
    from scipy.optimize import Bounds, LinearConstraint, milp

    m = len(x)
    eye, nil = np.eye(m), np.zeros((m, m))
    # The solver needs finite bounds; these are so wide that none of them binds.
    reach = np.where(np.isfinite(low) & np.isfinite(high), 0.0, np.abs(x).max() + np.abs(np.where(np.isfinite(low), low, 0.0)).max() + 1.0)
    low, high = np.where(np.isfinite(low), low, -10.0 * reach), np.where(np.isfinite(high), high, 10.0 * reach + 10.0)
    rows = [np.concatenate([(eye[j] - eye[i]), np.zeros(2 * m)]) for i, j in pairs]
    ends = [0.0] * len(pairs)
    big = np.maximum(high - low, np.maximum(np.abs(high - x), np.abs(low - x))) + 1.0
    for sign in (1.0, -1.0):
        if norm == "l1":
            rows += list(np.hstack([-sign * np.diag(factor), eye, nil]))
            ends += list(-sign * factor * x)
        elif norm == "l0":
            rows += list(np.hstack([-sign * eye, nil, np.diag(big)]))
            ends += list(-sign * x)
    counts = np.full(m, 1.0 if norm == "l0" else 0.0)
    weights, integrality = np.concatenate([np.zeros(m), 1.0 - counts, counts]), np.concatenate([np.zeros(2 * m), counts])
    limits = Bounds(np.concatenate([low, np.zeros(2 * m)]), np.concatenate([high, np.full(m, np.inf), np.ones(m)]))
    for _ in range(MAX_CUTS):
        constraint = LinearConstraint(np.array(rows), np.array(ends), np.inf)
        result = milp(weights, constraints=constraint, bounds=limits, integrality=integrality)
        if result.x is None:
            return None
        values, bound = result.x[:m], result.x[m : 2 * m]
        cost = (factor * (values - x)) ** 2
        if norm != "l2" or cost.sum() - bound.sum() <= TOLERANCE:
            break
        slope = 2.0 * factor**2 * (values - x)
        rows += list(np.hstack([-np.diag(slope), eye, nil]))
        ends += list(cost - slope * values)
    solution: Doubles = values
    return solution
