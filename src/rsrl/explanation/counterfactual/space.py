"""In which ways a row may be moved: how far a step counts, what moves in whole steps, never, one way only, or together.

Columns are those of a tree (`strategists.tree_columns`): natural units, a category's columns one by one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.season import RaceRecord
from rsrl.state import FEATURES, FIGURES, Feature, feature_set
from rsrl.state.encoding import working_range
from rsrl.strategists import TreeColumn, describe

Floats = NDArray[np.float32]

FROZEN: Final = frozenset(
    {f.name for f in FIGURES}
    | {"track", "tyre", "stops_made", "valid_finish", "soft_sets", "medium_sets", "hard_sets"}
    | {"soft_available", "medium_available", "hard_available"}
)
"""What nothing that can still happen before the call changes: track, car, set fitted, stops made, sets and compounds used."""

RISES: Final = frozenset({"race_progress", "tyre_age_laps", "tyre_degradation_s"})
FALLS: Final = frozenset({"laps_left", "cars_running"})
CLOCK: Final = ("laps_left", "race_progress", "tyre_age_laps")
"""Move together, a lap at a time; the first one that a tree knows is what a lap costs."""

ORDERED: Final = (
    ("gap_ahead_s", "gap_two_ahead_s"),
    ("gap_ahead_s", "gap_to_leader_s"),
    ("gap_two_ahead_s", "gap_to_leader_s"),
    ("gap_behind_s", "gap_two_behind_s"),
)
"""Pairs of which the second is never less than the first."""


@dataclass(frozen=True)
class Space:
    """How each of n columns may move from where it is.

    Attributes:
        names: of the columns.
        low, high: range that may be reached, both ends included, float32 [n].
        factor: scaled distance of a natural unit, or of a unit of log(1 + value), float64 [n].
        logarithmic, whole: bool [n].
        groups: columns of each category; a change of it counts 1.
        fixed_groups: those of them that keep their category.
        clock: columns that move together, lap by lap.
        laps: their values so many laps from now, float32 [laps + 1, len(clock)]; the first row is now.
        orders: (i, j): column j is never less than column i.
    """

    names: tuple[str, ...]
    low: Floats
    high: Floats
    factor: NDArray[np.float64]
    logarithmic: NDArray[np.bool_]
    whole: NDArray[np.bool_]
    groups: tuple[tuple[int, ...], ...] = ()
    fixed_groups: frozenset[int] = frozenset()
    clock: tuple[int, ...] = ()
    laps: Floats = field(default_factory=lambda: np.zeros((1, 0), np.float32))
    orders: tuple[tuple[int, int], ...] = ()

    def stretched(self, values: NDArray[np.floating]) -> NDArray[np.float64]:
        """Values [..., n] on the scale their distances are taken on, up to `factor`."""
        wide = np.asarray(values, np.float64)
        return np.where(self.logarithmic, np.log1p(np.maximum(wide, 0.0)), wide)


def space_of(names: Sequence[str], x: Floats, record: RaceRecord, features: str, *, frozen: frozenset[str] = FROZEN) -> Space:
    """Ways to move a tree's row `x` [n] in a race, distances as the feature set `features` scales them.

    What is made from features (a difference, a memory of past laps) moves freely; its step counts as that of the first feature it reads.

    Raises:
        RsrlError: a column that this version of RSRL does not have.
    """
    columns = [described(name) for name in names]
    known: dict[str, Feature] = {f.name: f for f in FEATURES} | {f.name: f for f in feature_set(features)}
    clock = tuple(names.index(n) for n in CLOCK if n in names)
    scales = [_scale(c, known, record) for c in columns]
    low, high = _reach(columns, x, known, frozen)
    groups = _groups(columns)
    return Space(
        names=tuple(names),
        low=low,
        high=high,
        factor=np.array([s[0] for s in scales]),
        logarithmic=np.array([s[1] for s in scales]),
        whole=np.array([c.whole for c in columns]),
        groups=tuple(groups.values()),
        fixed_groups=frozenset(i for i, name in enumerate(groups) if name in frozen),
        clock=clock,
        laps=_clock_values(names, clock, x, record.laps),
        orders=tuple((names.index(a), names.index(b)) for a, b in ORDERED if a in names and b in names),
    )


@cache
def described(name: str) -> TreeColumn:
    """A tree's column by its name, looked up once."""
    return describe(name)


def _reach(columns: Sequence[TreeColumn], x: Floats, known: Mapping[str, Feature], frozen: frozenset[str]) -> tuple[Floats, Floats]:
    low, high = np.full(len(x), -np.inf, np.float32), np.full(len(x), np.inf, np.float32)
    for i, column in enumerate(columns):
        if column.kind != "continuous":
            low[i], high[i] = 0.0, 1.0
        elif column.source == "feature" and (known[column.name].low == 0.0 or "gap" in column.name):
            low[i] = 0.0
        if column.kind != "category" and column.name in frozen:
            low[i] = high[i] = x[i]
        low[i] = max(low[i], x[i]) if column.name in RISES else low[i]
        high[i] = min(high[i], x[i]) if column.name in FALLS else high[i]
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


def _groups(columns: Sequence[TreeColumn]) -> dict[str, tuple[int, ...]]:
    members: dict[str, tuple[int, ...]] = {}
    for i, column in enumerate(columns):
        if column.kind == "category":
            members[column.feature] = (*members.get(column.feature, ()), i)
    return members


def _clock_values(names: Sequence[str], clock: tuple[int, ...], x: Floats, race_laps: int) -> Floats:
    """Values of the columns that tell the time, now and so many laps from now, up to the last decision of the race."""
    if not clock:
        return np.zeros((1, 0), np.float32)
    now, first = float(x[clock[0]]), names[clock[0]]
    done = {"laps_left": race_laps - now, "race_progress": np.rint(now * race_laps)}.get(first, 0.0)
    ahead = np.arange(0, max(int(race_laps - 1 - done), 0) + 1)
    columns = []
    for i in clock:
        if names[i] == "race_progress":  # in single precision, as the observer has it
            columns.append((np.float32(done) + ahead).astype(np.float32) / np.float32(race_laps))
        else:
            columns.append((x[i] + (-ahead if names[i] == "laps_left" else ahead)).astype(np.float32))
    return np.stack(columns, axis=1)
