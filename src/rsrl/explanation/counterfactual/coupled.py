"""The leaves of a tree in order of cost where gaps are coupled: the gap to the leader is never less than the gap ahead.

Each leaf by itself is solved in closed form (nearest.py); where that point breaks a coupling, the gaps concerned are solved together by a
mixed-integer program, and the closed form is a lower bound of what it will cost. So the walk solves no more than it must.
"""

import heapq
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.counterfactual.nearest import Boxes, Norm, bounds, cost_of, nearest_points
from rsrl.explanation.counterfactual.space import Space

Floats = NDArray[np.float32]
SLACK = 1.0e-9
MOST_CUTS = 200


class Found(NamedTuple):
    """A point of a leaf: the leaf's number, the point float32 [n], its cost, and what of it moved, bool [n]."""

    leaf: int
    point: Floats
    cost: float
    distance: NDArray[np.float64]
    moved: NDArray[np.bool_]


def walk_leaves(x: Floats, boxes: Boxes, space: Space, norm: Norm = "l1") -> Iterator[Found]:
    """The nearest point of each leaf that can be reached, couplings kept, the cheapest first."""
    near = nearest_points(x, boxes, space, norm)
    queue: list[tuple[float, int, int, bool]] = []
    for rank, i in enumerate(near.order()):
        queue.append((float(near.cost[i]), rank, int(i), keeps_order(near.points[i], space)))
    heapq.heapify(queue)
    solved: dict[int, Found] = {}
    while queue:
        cost, rank, i, final = heapq.heappop(queue)
        if i in solved:
            yield solved[i]
        elif final:
            yield Found(int(boxes.leaf[i]), near.points[i], cost, near.distance[i], near.moved[i])
        else:
            leaf = Boxes(boxes.low[i : i + 1], boxes.high[i : i + 1], boxes.leaf[i : i + 1])
            found = _solve_leaf(x, leaf, space, norm, Found(int(boxes.leaf[i]), near.points[i], cost, near.distance[i], near.moved[i]))
            if found is not None:
                solved[i] = found
                heapq.heappush(queue, (found.cost, rank, i, True))


def keeps_order(point: Floats, space: Space) -> bool:
    """Whether a point keeps every coupling."""
    return all(point[j] >= point[i] for i, j in space.orders)


def _solve_leaf(x: Floats, leaf: Boxes, space: Space, norm: Norm, near: Found) -> Found | None:
    """The nearest point of one leaf that keeps the couplings, None where there is none; other columns are as in the closed form."""
    columns = sorted({c for pair in space.orders for c in pair})
    low, high = (b[0, columns] for b in bounds(leaf, space))
    wide = space.stretched(np.stack([_at(x, values, columns) for values in (x[columns], low, high)]))[:, columns]
    start, least, most = wide
    pairs = [(columns.index(i), columns.index(j)) for i, j in space.orders]
    values = _program(start, least, most, space.factor[columns], pairs, norm)
    if values is None:
        return None
    point = near.point.copy()
    natural = np.where(space.logarithmic[columns], np.expm1(values), values)
    point[columns] = _in_order(np.clip(natural.astype(np.float32), low, high), pairs, low, high)
    still = np.abs(point - x) <= 1.0e-6 * (1.0 + np.abs(x))  # the solver's last digit is no change
    back = np.where(still, x, point).astype(np.float32)
    if keeps_order(back, space) and bool(((back > leaf.low[0]) & (back <= leaf.high[0]))[columns].all()):
        point = back
    if not keeps_order(point, space):
        return None
    distance, moved = near.distance.copy(), near.moved.copy()
    distance[columns] = (np.abs(space.stretched(point) - space.stretched(x)) * space.factor)[columns]
    moved[columns] = (point != x)[columns]
    return Found(near.leaf, point, float(cost_of(distance, moved, norm)), distance, moved)


def _at(x: Floats, values: Floats, columns: list[int]) -> Floats:
    row = x.copy()
    row[columns] = values
    return row


def _in_order(values: Floats, pairs: list[tuple[int, int]], low: Floats, high: Floats) -> Floats:
    """Take out what rounding to single precision did to the order: the greater goes up to the less, or where it may not, the less down."""
    for _ in pairs:
        for i, j in pairs:
            if values[j] < values[i]:
                values[j] = min(values[i], high[j])
                values[i] = max(min(values[i], values[j]), low[i])
    return values


def _program(
    x: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    factor: NDArray[np.float64],
    pairs: list[tuple[int, int]],
    norm: Norm,
) -> NDArray[np.float64] | None:
    """Least cost of m coupled values within bounds; None where they cannot be. Variables: values y [m], costs t [m], moved z [m].

    l1: the sum of t >= factor |y - x|; l0: the sum of z, with a move only where z is 1. l2 by cutting planes: the sum of t, each t above
    the tangents of (factor (y - x))^2 at the points found so far, until another would raise the sum no more.
    """
    from scipy.optimize import Bounds, LinearConstraint, milp

    m = len(x)
    eye, nil = np.eye(m), np.zeros((m, m))
    reach = np.where(np.isfinite(low) & np.isfinite(high), 0.0, np.abs(x).max() + np.abs(np.where(np.isfinite(low), low, 0.0)).max() + 1.0)
    low, high = np.where(np.isfinite(low), low, -10.0 * reach), np.where(np.isfinite(high), high, 10.0 * reach + 10.0)
    rows = [np.concatenate([(eye[j] - eye[i]), np.zeros(2 * m)]) for i, j in pairs]
    ends = [0.0] * len(pairs)
    big = np.maximum(high - low, np.maximum(np.abs(high - x), np.abs(low - x))) + 1.0
    scale = factor if norm == "l1" else np.ones(m)
    for sign in (1.0, -1.0):
        if norm == "l1":
            rows += list(np.hstack([-sign * np.diag(scale), eye, nil]))
            ends += list(-sign * scale * x)
        elif norm == "l0":
            rows += list(np.hstack([-sign * eye, nil, np.diag(big)]))
            ends += list(-sign * x)
    weights = np.concatenate([np.zeros(m), np.zeros(m) if norm == "l0" else np.ones(m), np.ones(m) if norm == "l0" else np.zeros(m)])
    integrality = np.concatenate([np.zeros(2 * m), np.ones(m) if norm == "l0" else np.zeros(m)])
    limits = Bounds(np.concatenate([low, np.zeros(2 * m)]), np.concatenate([high, np.full(m, np.inf), np.ones(m)]))
    for _ in range(MOST_CUTS):
        constraint = LinearConstraint(np.array(rows), np.array(ends), np.inf)
        result = milp(weights, constraints=constraint, bounds=limits, integrality=integrality)
        if result.x is None:
            return None
        values, bound = result.x[:m], result.x[m : 2 * m]
        cost = (factor * (values - x)) ** 2
        if norm != "l2" or cost.sum() - bound.sum() <= SLACK:
            break
        slope = 2.0 * factor**2 * (values - x)
        rows += list(np.hstack([-np.diag(slope), eye, nil]))
        ends += list(cost - slope * values)
    found: NDArray[np.float64] = values
    return found
