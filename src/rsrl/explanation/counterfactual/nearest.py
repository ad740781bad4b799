"""The nearest point of each leaf of a tree, in closed form (the problem of Carreira-Perpinan & Hada 2021 for axis-aligned trees).

A leaf is a box, and what a move costs is a sum over columns, so each column goes by itself to the nearest value its interval holds: a
number to the bound, a whole number to the nearest whole one inside, a category to the cheapest allowed. Columns that tell the time go
together to the first lap on which all of them are inside. A tree compares in single precision with <=: an interval is open below, and the
point past a threshold is the next float32.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.explanation.counterfactual.space import Space

Norm = Literal["l0", "l1", "l2"]
Floats = NDArray[np.float32]


@dataclass(frozen=True)
class Boxes:
    """Leaves as boxes: column c of a row lies in leaf l where low[l, c] < value <= high[l, c].

    Attributes:
        low, high: float32 [L, n].
        leaf: their numbers in the tree, int [L].
    """

    low: Floats
    high: Floats
    leaf: NDArray[np.int64]


@dataclass(frozen=True)
class Nearest:
    """The nearest point of each leaf.

    Attributes:
        points: float32 [L, n].
        distance: float64 [L, n], scaled, of each column; a category's stands in its first column, the time's in its first.
        moved: bool [L, n], the same.
        possible: bool [L], whether the leaf can be reached at all.
        cost: float64 [L], infinite where it cannot.
    """

    points: Floats
    distance: NDArray[np.float64]
    moved: NDArray[np.bool_]
    possible: NDArray[np.bool_]
    cost: NDArray[np.float64]

    @property
    def changes(self) -> NDArray[np.int64]:
        """How many features move, int64 [L]."""
        return self.moved.sum(axis=1)

    def order(self) -> NDArray[np.int64]:
        """Leaves that can be reached, cheapest first; of equal cost the one with fewer changes, then the shorter way, then the first."""
        rank = np.lexsort((self.distance.sum(axis=1), self.changes, self.cost))
        return rank[self.possible[rank]]


def nearest_points(x: Floats, boxes: Boxes, space: Space, norm: Norm = "l1") -> Nearest:
    """The nearest point to `x` [n] of each leaf; couplings between gaps (`Space.orders`) are left to `coupled.walk_leaves`."""
    low, high = bounds(boxes, space)
    points = np.minimum(np.maximum(x, low), high).astype(np.float32)
    inside = (points >= low) & (points <= high) & (points > boxes.low) & (points <= boxes.high)
    distance = np.abs(space.stretched(points) - space.stretched(x)) * space.factor
    moved = points != x
    for number, group in enumerate(space.groups):
        _choose_category(x, boxes, group, number in space.fixed_groups, points, inside, distance, moved)
    if space.clock:
        _set_clock(x, boxes, space, points, inside, distance, moved)
    possible: NDArray[np.bool_] = np.asarray(inside.all(axis=1), np.bool_)
    return Nearest(points, distance, moved, possible, np.where(possible, cost_of(distance, moved, norm), np.inf))


def cost_of(distance: NDArray[np.float64], moved: NDArray[np.bool_], norm: Norm) -> NDArray[np.float64]:
    """Cost [L] of moves: the number of them, the sum of distances, or the root of the sum of their squares."""
    if norm == "l0":
        return moved.sum(axis=-1).astype(np.float64)
    if norm == "l1":
        total: NDArray[np.float64] = distance.sum(axis=-1)
        return total
    if norm == "l2":
        root: NDArray[np.float64] = np.sqrt((distance**2).sum(axis=-1))
        return root
    raise RsrlError(f"norm {norm!r} is unknown; there are l0, l1 and l2")


def bounds(boxes: Boxes, space: Space) -> tuple[Floats, Floats]:
    """Least and greatest value a column may take in each leaf, both included, float32 [L, n]; none where the least is greater."""
    low = np.maximum(np.nextafter(boxes.low, np.float32(np.inf)), space.low)
    high = np.minimum(boxes.high, space.high)
    with np.errstate(invalid="ignore"):
        low = np.where(space.whole, np.maximum(np.floor(boxes.low) + np.float32(1.0), np.ceil(space.low)), low)
    return low.astype(np.float32), np.where(space.whole, np.floor(high), high).astype(np.float32)


def _choose_category(
    x: Floats,
    boxes: Boxes,
    group: tuple[int, ...],
    fixed: bool,
    points: Floats,
    inside: NDArray[np.bool_],
    distance: NDArray[np.float64],
    moved: NDArray[np.bool_],
) -> None:
    """Set a one-hot category to the present one where a leaf allows it, else to the first that it allows, at a cost of 1."""
    columns = list(group)
    low, high = boxes.low[:, columns], boxes.high[:, columns]
    one, zero = (low < 1.0) & (high >= 1.0), (low < 0.0) & (high >= 0.0)
    allowed = np.stack([one[:, c] & np.delete(zero, c, axis=1).all(axis=1) for c in range(len(columns))], axis=1)
    now = int(np.argmax(x[columns]))
    chosen = np.where(allowed[:, now] | fixed, now, allowed.argmax(axis=1))
    rows = np.arange(len(points))
    points[:, columns] = 0.0
    points[rows, np.array(columns)[chosen]] = 1.0
    inside[:, columns] = allowed[rows, chosen][:, None]
    distance[:, columns], moved[:, columns] = 0.0, False
    distance[:, columns[0]], moved[:, columns[0]] = chosen != now, chosen != now


def _set_clock(
    x: Floats,
    boxes: Boxes,
    space: Space,
    points: Floats,
    inside: NDArray[np.bool_],
    distance: NDArray[np.float64],
    moved: NDArray[np.bool_],
) -> None:
    """Let the columns that tell the time go on together to the first lap on which a leaf holds all of them."""
    columns = list(space.clock)
    laps = space.laps[None]
    within = (laps > boxes.low[:, None, columns]) & (laps <= boxes.high[:, None, columns])
    fits = np.array(within.all(axis=2), np.bool_, ndmin=2)
    later = fits.argmax(axis=1)
    points[:, columns] = space.laps[later]
    inside[:, columns] = fits.any(axis=1, keepdims=True)
    first = columns[0]
    distance[:, columns], moved[:, columns] = 0.0, False
    distance[:, first] = np.abs(space.laps[later, 0].astype(np.float64) - float(x[first])) * space.factor[first]
    moved[:, first] = later > 0
