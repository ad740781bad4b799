"""Changes worth asking a policy about: single causes and pairs on a grid, and what the nearest leaves of a tree point to."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.counterfactual.causes import CAUSE, CAUSES
from rsrl.explanation.counterfactual.coupled import Found
from rsrl.explanation.counterfactual.space import Space
from rsrl.season import TRACK_STATUS_NAMES
from rsrl.state import COLUMN

Floats = NDArray[np.float32]
MOST_LAPS: Final = 30
MOST_LAPS_OF_PAIRS: Final = 12
"""Laps from now that are tried: by themselves, and with another cause."""

MOST_OLDER: Final = 12
GAP_GRID_S: Final = np.round(np.geomspace(0.3, 40.0, 22), 1).astype(np.float32)
COARSE_GAP_GRID_S: Final = GAP_GRID_S[::2]
LATER, STATUS, OLDER = CAUSE["laps_later"], CAUSE["track_status"], CAUSE["laps_older"]
GAPS: Final = (CAUSE["gap_ahead_s"], CAUSE["gap_behind_s"])
SOFT_SETS: Final = CAUSE["soft_sets"]


class Grid:
    """Values of each cause to be tried for one moment and one target call.

    Args:
        raw: the raw row of the moment.
        target: the call wanted; staying out cannot be waited for, and a stop needs a set.
    """

    def __init__(self, raw: Floats, target: int) -> None:
        status = int(raw[COLUMN["safety_car"]])
        statuses = [s for s in range(3) if s != status]
        self._fine = {
            LATER: np.arange(1, MOST_LAPS + 1, dtype=np.float32) if target else np.zeros(0, np.float32),
            GAPS[0]: GAP_GRID_S,
            GAPS[1]: GAP_GRID_S,
            STATUS: np.array(statuses, np.float32),
            OLDER: np.arange(1, MOST_OLDER + 1, dtype=np.float32),
            CAUSE["boxed_ahead"]: np.ones(1, np.float32),
            CAUSE["boxed_behind"]: np.ones(1, np.float32),
        }
        for call in range(1, 4):  # were there no set for another stop
            if call != target and raw[COLUMN["soft_sets"] + call - 1] > 0:
                self._fine[SOFT_SETS + call - 1] = np.zeros(1, np.float32)
        self._coarse = self._fine | dict.fromkeys(GAPS, COARSE_GAP_GRID_S) | {LATER: self._fine[LATER][:MOST_LAPS_OF_PAIRS]}
        self._needed = SOFT_SETS + target - 1 if target and raw[COLUMN["soft_sets"] + target - 1] < 1 else -1

    def singles(self) -> Floats:
        """Every value of every cause by itself, float32 [N, causes]."""
        rows = [np.concatenate([_empty(0), *(self._set(_empty(len(v)), c, v) for c, v in self._fine.items())])]
        if self._needed >= 0:
            rows.append(_empty(1))
        return self._with_set(np.concatenate(rows))

    def pairs(self) -> Floats:
        """Every pair of two causes, gaps in coarser steps, float32 [N, causes]."""
        rows, causes = [_empty(0)], list(self._coarse)
        for i, one in enumerate(causes):
            for other in causes[i + 1 :]:
                first, second = np.meshgrid(self._coarse[one], self._coarse[other], indexing="ij")
                rows.append(self._set(self._set(_empty(first.size), one, first.ravel()), other, second.ravel()))
        return self._with_set(np.concatenate(rows))

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

    @staticmethod
    def _set(rows: Floats, cause: int, values: Floats) -> Floats:
        rows[:, cause] = values
        return rows

    def _with_set(self, rows: Floats) -> Floats:
        if self._needed >= 0:
            rows[:, self._needed] = 1.0
        return rows


def _empty(n: int) -> Floats:
    return np.full((n, len(CAUSES)), np.nan, np.float32)
