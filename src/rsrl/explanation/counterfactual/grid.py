"""Candidate changes to ask a policy about: single causes and pairs on a grid, another cause on top, and what a tree's leaves point to."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.counterfactual.change import CAUSES, CLOCKS, GAPS, PAST, empty_rows
from rsrl.explanation.counterfactual.edit_kernels import BOXED_AHEAD, BOXED_BEHIND, CALLED, LATER, LOST, OLDER, SETS, STATUS, USED
from rsrl.explanation.counterfactual.leaves import LeafPoint
from rsrl.explanation.counterfactual.space import Space
from rsrl.season import TRACK_STATUS_NAMES
from rsrl.state import COLUMN

Floats = NDArray[np.float32]
EVERY_LAP_UP_TO: Final = 12
LAP_STEP: Final = 3
"""In a pair with a cause of many values every lap of the first twelve is tried, then every third; refining finds the laps between."""

FEW_VALUES: Final = 2
"""A cause with so many values leaves room for every lap in a pair."""

MAX_AGE_LAPS: Final = 40
GAP_GRID_S: Final = np.round(np.geomspace(0.3, 40.0, 22), 1).astype(np.float32)
LOST_GRID_S: Final = np.round(np.geomspace(1.0, 40.0, 12), 1).astype(np.float32)
EXCLUDED_PAIRS: Final = frozenset({(LATER, CALLED), (CALLED, OLDER)})
"""Pairs not tried: two ways to the same lap; and the policy's own stops depend on the set's age, so no lap stands for all ages."""


class Grid:
    """Values of each cause to be tried for one moment and one target call.

    Args:
        raw: the raw row of the moment.
        target: the call asked for. Staying out cannot be waited for, and a stop needs a set.
        calls: the policy's calls lap by lap from now, int8 [laps]; up to its first stop, following them is the same as staying out.
    """

    def __init__(self, raw: Floats, target: int, calls: NDArray[np.int8]) -> None:
        laps = np.arange(1, int(raw[COLUMN["laps_left"]]) if target else 1, dtype=np.float32)
        stops = np.flatnonzero(calls)
        one = np.ones(1, np.float32)
        fine: dict[int, Floats] = {
            LATER: laps,
            CALLED: laps[laps > stops[0]] if len(stops) else laps[:0],
            LOST: LOST_GRID_S,
            GAPS[0]: GAP_GRID_S,
            GAPS[1]: GAP_GRID_S,
            STATUS: np.array([s for s in range(3) if s != int(raw[COLUMN["safety_car"]])], np.float32),
            BOXED_AHEAD: one,
            BOXED_BEHIND: one,
            OLDER: np.arange(1, max(MAX_AGE_LAPS - raw[COLUMN["tyre_age_laps"]], 0) + 1, dtype=np.float32),
            USED: np.array([2.0 - raw[COLUMN["valid_finish"]]], np.float32),
        }
        sets = raw[COLUMN["soft_sets"] : COLUMN["soft_sets"] + 3]
        for call in range(1, 4):  # no set left for another stop
            if call != target and sets[call - 1] > 0:
                fine[SETS + call - 1] = np.zeros(1, np.float32)
        self._fine = fine
        self._coarse = fine | dict.fromkeys(GAPS, GAP_GRID_S[::2]) | {LOST: LOST_GRID_S[::2], OLDER: fine[OLDER][::LAP_STEP]}
        self._needed_set = SETS + target - 1 if target and sets[target - 1] < 1 else None
        """The cause without which the target cannot be called: a set that is not there. It is then a part of every change."""

    def singles(self, *, past: bool) -> Floats:
        """Every value of every cause by itself, float32 [N, causes]: of causes that lie in the past, or of those that do not."""
        if self._needed_set is not None:
            rows = [empty_rows(1), *(_product(empty_rows(1), c, v) for c, v in self._fine.items())] if past else []
        else:
            rows = [_product(empty_rows(1), c, v) for c, v in self._fine.items() if (c in PAST) == past]
        return self._with_needed_set(np.concatenate([empty_rows(0), *rows]))

    def pairs(self, *, past: bool) -> Floats:
        """Every pair of two causes in coarser steps, float32 [N, causes]: pairs with a cause in the past, or those without."""
        rows, values = [empty_rows(0)], dict(self._coarse)
        if past:  # with another past the policy's stops are others, so any lap may differ from staying out
            values[CALLED] = self._fine[LATER]
        causes = list(values) if past or self._needed_set is None else []
        for i, one in enumerate(causes):
            for other in causes[i + 1 :]:
                wanted = self._needed_set is not None or (one in PAST or other in PAST) == past
                if wanted and (one, other) not in EXCLUDED_PAIRS:
                    thin = one in CLOCKS and len(values[other]) > FEW_VALUES
                    first = _product(empty_rows(1), one, _thinned(values[one]) if thin else values[one])
                    rows.append(_product(first, other, values[other]))
        return self._with_needed_set(np.concatenate(rows))

    def with_another_cause(self, changes: Floats) -> Floats:
        """Each of the changes [N, causes] with each value of a cause that it lacks, float32 [M, causes]."""
        rows = [empty_rows(0)]
        for row in changes:
            there = np.flatnonzero(~np.isnan(row))
            for cause, values in self._coarse.items():
                if cause not in there and not any((min(cause, c), max(cause, c)) in EXCLUDED_PAIRS for c in there):
                    rows.append(_product(row[None], cause, _thinned(values) if cause in CLOCKS else values))
        return np.concatenate(rows)

    def from_leaf(self, leaf: LeafPoint, space: Space) -> Floats:
        """The causes among the columns that move on the way to a leaf, float32 [1, causes]; all NaN where there are none."""
        row = empty_rows(1)
        values = dict(zip(space.names, leaf.point, strict=True))
        moved = {space.names[i] for i in np.flatnonzero(leaf.moved)}
        for cause in GAPS:
            if CAUSES[cause] in moved:
                row[0, cause] = values[CAUSES[cause]]
        if space.clock and leaf.moved[space.clock[0]] and len(self._fine[LATER]):
            row[0, LATER] = np.flatnonzero((space.clock_values == leaf.point[list(space.clock)]).all(axis=1))[0]
        if any(name.startswith("safety_car=") for name in moved):
            row[0, STATUS] = next(s for s in range(3) if values[f"safety_car={TRACK_STATUS_NAMES[s]}"] == 1.0)
        for cause in (BOXED_AHEAD, BOXED_BEHIND):
            if CAUSES[cause] in moved and values[CAUSES[cause]] == 1.0:
                row[0, cause] = 1.0
        return row if np.isnan(row).all() else self._with_needed_set(row)

    def _with_needed_set(self, rows: Floats) -> Floats:
        if self._needed_set is not None:
            rows[:, self._needed_set] = 1.0
        return rows


def _thinned(laps: Floats) -> Floats:
    return np.concatenate([laps[:EVERY_LAP_UP_TO], laps[EVERY_LAP_UP_TO + LAP_STEP - 1 :: LAP_STEP]])


def _product(rows: Floats, cause: int, values: Floats) -> Floats:
    """Each of `rows` with each value of a cause."""
    made = np.repeat(rows, len(values), axis=0)
    made[:, cause] = np.tile(values, len(rows))
    return made
