"""Changes worth asking a policy about: single causes and pairs on a grid, a further cause on top, and what leaves of a tree point to."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.counterfactual.change import CAUSE, CAUSES, HYPOTHETICAL
from rsrl.explanation.counterfactual.coupled import Found
from rsrl.explanation.counterfactual.space import Space
from rsrl.season import TRACK_STATUS_NAMES
from rsrl.state import COLUMN

Floats = NDArray[np.float32]
EVERY_LAP: Final = 12
EVERY: Final = 3
"""In pairs with a cause of many values every lap of the first twelve is tried, every third after that; then the first that does."""

FEW: Final = 2

MOST_OLDER: Final = 40
GAP_GRID_S: Final = np.round(np.geomspace(0.3, 40.0, 22), 1).astype(np.float32)
LOST_GRID_S: Final = np.round(np.geomspace(1.0, 40.0, 12), 1).astype(np.float32)
LATER, CALLED, STATUS, OLDER = (CAUSE[name] for name in ("laps_later", "laps_called", "track_status", "laps_older"))
USED, LOST = CAUSE["compounds_used"], CAUSE["time_lost_s"]
GAPS: Final = (CAUSE["gap_ahead_s"], CAUSE["gap_behind_s"])
SOFT_SETS: Final = CAUSE["soft_sets"]
CLOCKS: Final = (LATER, CALLED)
APART: Final = frozenset({(LATER, CALLED), (CALLED, OLDER)})
"""Pairs not tried: two ways to the same lap; an older set has other stops at every age, and is told by staying out."""

PAST: Final = frozenset(CAUSE[name] for name in HYPOTHETICAL)


class Grid:
    """Values of each cause to be tried for one moment and one target call.

    Args:
        raw: the raw row of the moment.
        target: the call wanted; staying out cannot be waited for, and a stop needs a set.
        calls: what the policy calls lap by lap from now; up to its first stop, driving on by them is staying out.
    """

    def __init__(self, raw: Floats, target: int, calls: NDArray[np.int8]) -> None:
        laps = np.arange(1, int(raw[COLUMN["laps_left"]]) if target else 1, dtype=np.float32)
        stops = np.flatnonzero(calls)
        age, used = raw[COLUMN["tyre_age_laps"]], 1.0 + raw[COLUMN["valid_finish"]]
        self._fine: dict[int, Floats] = {
            LATER: laps,
            CALLED: laps[laps > stops[0]] if len(stops) else laps[:0],
            LOST: LOST_GRID_S,
            GAPS[0]: GAP_GRID_S,
            GAPS[1]: GAP_GRID_S,
            STATUS: np.array([s for s in range(3) if s != int(raw[COLUMN["safety_car"]])], np.float32),
            CAUSE["boxed_ahead"]: np.ones(1, np.float32),
            CAUSE["boxed_behind"]: np.ones(1, np.float32),
            OLDER: np.arange(1, max(MOST_OLDER - age, 0) + 1, dtype=np.float32),
            USED: np.array([3.0 - used], np.float32),
        }
        for call in range(1, 4):  # were there no set for another stop
            if call != target and raw[COLUMN["soft_sets"] + call - 1] > 0:
                self._fine[SOFT_SETS + call - 1] = np.zeros(1, np.float32)
        self._coarse = self._fine | dict.fromkeys(GAPS, GAP_GRID_S[::2]) | {LOST: LOST_GRID_S[::2], OLDER: self._fine[OLDER][::EVERY]}
        self._needed = SOFT_SETS + target - 1 if target and raw[COLUMN["soft_sets"] + target - 1] < 1 else -1

    def singles(self, *, hypothetical: bool) -> Floats:
        """Every value of every cause by itself, float32 [N, causes]: of those still to come, or of those that only could have been."""
        if self._needed >= 0:
            rows = [_empty(1), *(_with(_empty(1), c, v) for c, v in self._fine.items())] if hypothetical else []
        else:
            rows = [_with(_empty(1), c, v) for c, v in self._fine.items() if (c in PAST) == hypothetical]
        return self._with_set(np.concatenate([_empty(0), *rows]))

    def pairs(self, *, hypothetical: bool) -> Floats:
        """Every pair of two causes in coarser steps, float32 [N, causes]; hypothetical where one of them is."""
        rows, values = [_empty(0)], dict(self._coarse)
        if hypothetical:  # another past has other stops
            values[CALLED] = self._fine[LATER]
        causes = list(values) if hypothetical or self._needed < 0 else []
        for i, one in enumerate(causes):
            for other in causes[i + 1 :]:
                known = self._needed >= 0 or (one in PAST or other in PAST) == hypothetical
                if known and (one, other) not in APART:
                    many = one in CLOCKS and len(values[other]) > FEW
                    rows.append(_with(_with(_empty(1), one, _thinned(values[one]) if many else values[one]), other, values[other]))
        return self._with_set(np.concatenate(rows))

    def added(self, near: Floats) -> Floats:
        """Each of the changes `near` [N, causes] with each value of a cause that it lacks, float32 [M, causes]."""
        rows = [_empty(0)]
        for row in near:
            there = np.flatnonzero(~np.isnan(row))
            for cause, values in self._coarse.items():
                if cause not in there and not any((min(cause, c), max(cause, c)) in APART for c in there):
                    rows.append(_with(row[None], cause, _thinned(values) if cause in CLOCKS else values))
        return np.concatenate(rows)

    def of_leaf(self, found: Found, space: Space) -> Floats:
        """The causes among what moved on the way to a leaf, float32 [1, causes]; all not a number where none is."""
        row = _empty(1)
        values = dict(zip(space.names, found.point, strict=True))
        moved = {space.names[i] for i in np.flatnonzero(found.moved)}
        for cause in GAPS:
            if CAUSES[cause] in moved:
                row[0, cause] = values[CAUSES[cause]]
        if space.clock and found.moved[space.clock[0]] and len(self._fine[LATER]):
            row[0, LATER] = np.flatnonzero((space.laps == found.point[list(space.clock)]).all(axis=1))[0]
        if any(name.startswith("safety_car=") for name in moved):
            row[0, STATUS] = next(s for s in range(3) if values[f"safety_car={TRACK_STATUS_NAMES[s]}"] == 1.0)
        for name in ("boxed_ahead", "boxed_behind"):
            if name in moved and values[name] == 1.0:
                row[0, CAUSE[name]] = 1.0
        return row if np.isnan(row).all() else self._with_set(row)

    def _with_set(self, rows: Floats) -> Floats:
        if self._needed >= 0:
            rows[:, self._needed] = 1.0
        return rows


def _thinned(laps: Floats) -> Floats:
    return np.concatenate([laps[:EVERY_LAP], laps[EVERY_LAP + EVERY - 1 :: EVERY]])


def _with(rows: Floats, cause: int, values: Floats) -> Floats:
    """Each of `rows` with each value of a cause."""
    made = np.repeat(rows, len(values), axis=0)
    made[:, cause] = np.tile(values, len(rows))
    return made


def _empty(n: int) -> Floats:
    return np.full((n, len(CAUSES)), np.nan, np.float32)
