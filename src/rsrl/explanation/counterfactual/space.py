"""In which ways a row of a tree may be moved, and the nearest point of each leaf, in closed form (Carreira-Perpinan & Hada 2021).

Columns are those of a tree (`strategists.tree.columns`): natural units, one column for each value of a category. A leaf of an axis-aligned
tree is a box and the cost of a move is a sum over columns, so each column is solved by itself: a number goes to the bound of its interval,
an integer to the nearest integer inside, a category to the cheapest value allowed. The columns of the clock go together to the first lap on
which all of them are inside. A tree compares in single precision with <=: an interval is open below, so the nearest point above a threshold
is the next float32.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.season import RaceRecord
from rsrl.state import FEATURES, FIGURES, Feature, feature_set
from rsrl.state.encoding import working_range
from rsrl.strategists import TreeColumn, describe

Norm = Literal["l0", "l1", "l2"]
Floats = NDArray[np.float32]

IMMUTABLE: Final = frozenset(
    {f.name for f in FIGURES}
    | {"track", "tyre", "stops_made", "valid_finish", "soft_sets", "medium_sets", "hard_sets"}
    | {"soft_available", "medium_available", "hard_available"}
)
"""Features that nothing before the call can change: track, car, set fitted, stops made, sets and compounds used."""

INCREASING: Final = frozenset({"race_progress", "tyre_age_laps", "tyre_degradation_s"})
DECREASING: Final = frozenset({"laps_left", "cars_running"})
CLOCK: Final = ("laps_left", "race_progress", "tyre_age_laps")
"""Features that move together, a lap at a time. The first one that a tree knows carries the cost of a lap."""

ORDERED: Final = (
    ("gap_ahead_s", "gap_two_ahead_s"),
    ("gap_ahead_s", "gap_to_leader_s"),
    ("gap_two_ahead_s", "gap_to_leader_s"),
    ("gap_behind_s", "gap_two_behind_s"),
)
"""Pairs of features of which the second is never less than the first."""


@dataclass(frozen=True)
class Space:
    """How each of n columns may move from its present value.

    Attributes:
        names: of the columns.
        low, high: range that may be reached, both ends included, float32 [n].
        factor: scaled distance of a natural unit, or of a unit of log(1 + value), float64 [n].
        logarithmic, integer: bool [n].
        categories: columns of each one-hot category; a change of it costs 1.
        fixed_categories: indices of those that keep their value.
        clock: columns that move together, lap by lap.
        clock_values: their values 0, 1, 2 ... laps from now, float32 [laps, len(clock)].
        ordered: (i, j): column j is never less than column i.
    """

    names: tuple[str, ...]
    low: Floats
    high: Floats
    factor: NDArray[np.float64]
    logarithmic: NDArray[np.bool_]
    integer: NDArray[np.bool_]
    categories: tuple[tuple[int, ...], ...] = ()
    fixed_categories: frozenset[int] = frozenset()
    clock: tuple[int, ...] = ()
    clock_values: Floats = field(default_factory=lambda: np.zeros((1, 0), np.float32))
    ordered: tuple[tuple[int, int], ...] = ()

    def transformed(self, values: NDArray[np.floating]) -> NDArray[np.float64]:
        """Values [..., n] on the scale on which distances are linear; times `factor` they are scaled."""
        wide = np.asarray(values, np.float64)
        return np.where(self.logarithmic, np.log1p(np.maximum(wide, 0.0)), wide)


def space_of(names: Sequence[str], x: Floats, record: RaceRecord, features: str, *, immutable: frozenset[str] = IMMUTABLE) -> Space:
    """Ways to move a tree's row `x` [n] in a race, with distances as the feature set `features` scales them.

    A column made from features (a difference, a memory of past laps) moves freely, on the scale of the first feature it reads.

    Raises:
        RsrlError: a column that this version of RSRL does not have.
    """
    columns = [described(name) for name in names]
    known: dict[str, Feature] = {f.name: f for f in FEATURES} | {f.name: f for f in feature_set(features)}
    clock = tuple(names.index(n) for n in CLOCK if n in names)
    scales = [_scale(c, known, record) for c in columns]
    low, high = _reach(columns, x, known, immutable)
    categories = _categories(columns)
    return Space(
        names=tuple(names),
        low=low,
        high=high,
        factor=np.array([s[0] for s in scales]),
        logarithmic=np.array([s[1] for s in scales]),
        integer=np.array([c.whole for c in columns]),
        categories=tuple(categories.values()),
        fixed_categories=frozenset(i for i, name in enumerate(categories) if name in immutable),
        clock=clock,
        clock_values=_clock_values(names, clock, x, record.laps),
        ordered=tuple((names.index(a), names.index(b)) for a, b in ORDERED if a in names and b in names),
    )


@cache
def described(name: str) -> TreeColumn:
    """A tree's column by its name, looked up once."""
    return describe(name)


def _reach(columns: Sequence[TreeColumn], x: Floats, known: Mapping[str, Feature], immutable: frozenset[str]) -> tuple[Floats, Floats]:
    low, high = np.full(len(x), -np.inf, np.float32), np.full(len(x), np.inf, np.float32)
    for i, column in enumerate(columns):
        if column.kind != "continuous":
            low[i], high[i] = 0.0, 1.0
        elif column.source == "feature" and (known[column.name].low == 0.0 or "gap" in column.name):
            low[i] = 0.0
        if column.kind != "category" and column.name in immutable:
            low[i] = high[i] = x[i]
        low[i] = max(low[i], x[i]) if column.name in INCREASING else low[i]
        high[i] = min(high[i], x[i]) if column.name in DECREASING else high[i]
    return low, high


def _scale(column: TreeColumn, known: Mapping[str, Feature], record: RaceRecord) -> tuple[float, bool]:
    """Scaled distance of a unit, as `state.Encoder` scales, and whether it is a unit of the logarithm."""
    feature = known[column.reads[0]]
    if column.kind != "continuous" or feature.kind == "category":
        return 1.0, False
    low, high = working_range(feature, record.scaling)
    logarithmic = feature.logarithmic and column.source == "feature"
    if logarithmic:
        low, high = float(np.log1p(low)), float(np.log1p(high))
    return (1.0 - feature.low) / (high - low), logarithmic


def _categories(columns: Sequence[TreeColumn]) -> dict[str, tuple[int, ...]]:
    members: dict[str, tuple[int, ...]] = {}
    for i, column in enumerate(columns):
        if column.kind == "category":
            members[column.feature] = (*members.get(column.feature, ()), i)
    return members


def _clock_values(names: Sequence[str], clock: tuple[int, ...], x: Floats, race_laps: int) -> Floats:
    """Values of the clock's columns 0, 1, 2 ... laps from now, up to the last decision of the race."""
    if not clock:
        return np.zeros((1, 0), np.float32)
    now, first = float(x[clock[0]]), names[clock[0]]
    done = {"laps_left": race_laps - now, "race_progress": np.rint(now * race_laps)}.get(first, 0.0)
    ahead = np.arange(0, max(int(race_laps - 1 - done), 0) + 1)
    columns = []
    for i in clock:
        if names[i] == "race_progress":  # in single precision, as the observer computes it
            columns.append((np.float32(done) + ahead).astype(np.float32) / np.float32(race_laps))
        else:
            columns.append((x[i] + (-ahead if names[i] == "laps_left" else ahead)).astype(np.float32))
    return np.stack(columns, axis=1)


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
class NearestPoints:
    """The nearest point of each leaf.

    Attributes:
        points: float32 [L, n].
        distance: scaled distance of each column, float64 [L, n]; that of a category, or of the clock, stands in its first column.
        moved: whether each column moves, bool [L, n], the same.
        feasible: whether a leaf can be reached at all, bool [L].
        cost: float64 [L], infinite where it cannot.
    """

    points: Floats
    distance: NDArray[np.float64]
    moved: NDArray[np.bool_]
    feasible: NDArray[np.bool_]
    cost: NDArray[np.float64]

    def order(self) -> NDArray[np.int64]:
        """Feasible leaves, the cheapest first; ties go to fewer features moved, then to the smaller sum of distances."""
        rank = np.lexsort((self.distance.sum(axis=1), self.moved.sum(axis=1), self.cost))
        return rank[self.feasible[rank]]


class _Moves(NamedTuple):
    """Moves of L leaves while they are being solved, [L, n] each; `inside`: the column is within the leaf."""

    points: Floats
    inside: NDArray[np.bool_]
    distance: NDArray[np.float64]
    moved: NDArray[np.bool_]

    def together(self, columns: list[int], inside: NDArray[np.bool_], distance: NDArray[np.float64], moved: NDArray[np.bool_]) -> None:
        """Book columns that move as one, [L] each, in the first of them."""
        self.inside[:, columns] = inside[:, None]
        self.distance[:, columns], self.moved[:, columns] = 0.0, False
        self.distance[:, columns[0]], self.moved[:, columns[0]] = distance, moved


def nearest_points(x: Floats, boxes: Boxes, space: Space, norm: Norm = "l1") -> NearestPoints:
    """The nearest point to `x` [n] of each leaf, `Space.ordered` left out: `leaves.walk_leaves` sees to that."""
    low, high = bounds(boxes, space)
    points = np.minimum(np.maximum(x, low), high).astype(np.float32)
    inside = (points >= low) & (points <= high) & (points > boxes.low) & (points <= boxes.high)
    moves = _Moves(points, inside, np.abs(space.transformed(points) - space.transformed(x)) * space.factor, points != x)
    for number, columns in enumerate(space.categories):
        _move_category(x, boxes, list(columns), number in space.fixed_categories, moves)
    if space.clock:
        _move_clock(x, boxes, space, moves)
    feasible: NDArray[np.bool_] = np.asarray(inside.all(axis=1), np.bool_)
    return NearestPoints(
        points, moves.distance, moves.moved, feasible, np.where(feasible, cost_of(moves.distance, moves.moved, norm), np.inf)
    )


def cost_of(distance: NDArray[np.float64], moved: NDArray[np.bool_], norm: Norm) -> NDArray[np.float64]:
    """Cost [L] of moves [L, n]: how many there are (l0), the sum of distances (l1), or the root of the sum of their squares (l2)."""
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
    """Least and greatest value each column may take in each leaf, both included, float32 [L, n]; none where the least is greater."""
    low = np.maximum(np.nextafter(boxes.low, np.float32(np.inf)), space.low)
    high = np.minimum(boxes.high, space.high)
    with np.errstate(invalid="ignore"):
        low = np.where(space.integer, np.maximum(np.floor(boxes.low) + np.float32(1.0), np.ceil(space.low)), low)
    return low.astype(np.float32), np.where(space.integer, np.floor(high), high).astype(np.float32)


def _move_category(x: Floats, boxes: Boxes, columns: list[int], fixed: bool, moves: _Moves) -> None:
    """Keep a one-hot category where a leaf allows its present value, else move it to the first value allowed, at a cost of 1."""
    low, high = boxes.low[:, columns], boxes.high[:, columns]
    one, zero = (low < 1.0) & (high >= 1.0), (low < 0.0) & (high >= 0.0)
    allowed = np.stack([one[:, c] & np.delete(zero, c, axis=1).all(axis=1) for c in range(len(columns))], axis=1)
    now = int(np.argmax(x[columns]))
    chosen = np.where(allowed[:, now] | fixed, now, allowed.argmax(axis=1))
    rows = np.arange(len(chosen))
    moves.points[:, columns] = 0.0
    moves.points[rows, np.array(columns)[chosen]] = 1.0
    moves.together(columns, allowed[rows, chosen], (chosen != now).astype(np.float64), chosen != now)


def _move_clock(x: Floats, boxes: Boxes, space: Space, moves: _Moves) -> None:
    """Let the clock go on to the first lap on which a leaf holds all its columns."""
    columns, values = list(space.clock), space.clock_values
    within = (values > boxes.low[:, None, columns]) & (values <= boxes.high[:, None, columns])
    fits = np.array(within.all(axis=2), np.bool_, ndmin=2)
    later = fits.argmax(axis=1)
    moves.points[:, columns] = values[later]
    distance = np.abs(values[later, 0].astype(np.float64) - float(x[columns[0]])) * space.factor[columns[0]]
    moves.together(columns, np.array(fits.any(axis=1), np.bool_), distance, later > 0)
