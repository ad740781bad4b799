"""Changes of a race under which a policy may make another call: their causes, a race edited by them, and how far a change goes.

A feature such as the expected time of a stop is no cause: it follows from the race. A change is therefore made to the race itself, and
every feature of the edited race is computed by the code that observes any other race (`state.observe`).
"""

import math
from dataclasses import dataclass, fields
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.counterfactual import edit_kernels
from rsrl.explanation.counterfactual.edit_kernels import AHEAD, BEHIND, CALLED, LATER, SETS, STATUS, USED
from rsrl.explanation.counterfactual.space import Norm, cost_of
from rsrl.explanation.moment import Arrays
from rsrl.season import RaceRecord
from rsrl.state import COLUMN, FEATURES, RAW_SIZE, Observer, feature_set
from rsrl.state.encoding import working_range

Floats = NDArray[np.float32]
Calls = NDArray[np.int8] | None


@dataclass(frozen=True)
class Change:
    """A change of a race; None leaves a cause as it is. Fields stand in the order of the columns that the compiled code reads.

    Attributes:
        laps_later: laps from now until the change holds, staying out until then.
        laps_called: the same, the policy calling until then; not together with `laps_later`.
        time_lost_s: time lost by then, s.
        gap_ahead_s, gap_behind_s: gaps to the cars one place ahead and behind at that time, s. Cars in the way move with them.
        track_status: 0 green, 1 virtual safety car, 2 safety car, beginning at that time.
        boxed_ahead, boxed_behind: 1 where the car ahead, or behind, boxed at the end of the last lap.
        laps_older: laps by which the set now fitted is older.
        compounds_used: compounds used so far, 1 (the one fitted) or 2.
        soft_sets, medium_sets, hard_sets: sets left now.
    """

    laps_later: float | None = None
    laps_called: float | None = None
    time_lost_s: float | None = None
    gap_ahead_s: float | None = None
    gap_behind_s: float | None = None
    track_status: float | None = None
    boxed_ahead: float | None = None
    boxed_behind: float | None = None
    laps_older: float | None = None
    compounds_used: float | None = None
    soft_sets: float | None = None
    medium_sets: float | None = None
    hard_sets: float | None = None

    @property
    def parts(self) -> dict[str, float]:
        """Causes that change, by name, with their new values."""
        return {f.name: value for f in fields(self) if (value := getattr(self, f.name)) is not None}

    @property
    def laps(self) -> int:
        """Laps from now until the change holds."""
        return int(self.laps_later or self.laps_called or 0)

    @property
    def reachable(self) -> bool:
        """Whether the race can still come to it: no part of it lies in the past."""
        return not any(name in PAST_CAUSES for name in self.parts)


CAUSES: Final = tuple(f.name for f in fields(Change))
CAUSE: Final = {name: i for i, name in enumerate(CAUSES)}
"""Column of each cause in rows of changes."""

PAST_CAUSES: Final = ("laps_older", "compounds_used", "soft_sets", "medium_sets", "hard_sets")
"""Causes that lie in the past, which nothing still to come can bring about: an earlier stop, another compound, a set kept or used."""

PAST: Final = [CAUSE[name] for name in PAST_CAUSES]
GAPS: Final = [AHEAD, BEHIND]
CLOCKS: Final = [LATER, CALLED]
"""Columns that say how many laps from now a change holds."""


def empty_rows(n: int) -> Floats:
    """Rows of `n` changes that change nothing, float32 [n, causes], all NaN."""
    return np.full((n, len(CAUSES)), np.nan, np.float32)


def change_rows(changes: list[Change]) -> Floats:
    """Changes as the compiled code reads them, float32 [N, causes]; NaN leaves a cause as it is."""
    rows = empty_rows(len(changes))
    for row, change in zip(rows, changes, strict=True):
        for name, value in change.parts.items():
            row[CAUSE[name]] = value
    return rows


def change_of(row: Floats) -> Change:
    """The change of one row, the inverse of `change_rows`."""
    return Change(**{name: None if math.isnan(value) else float(value) for name, value in zip(CAUSES, row, strict=True)})


def laps_ahead(row: Floats, clock: int, laps: int) -> Floats:
    """Rows of the laps from now on, 0 to `laps` - 1 of them, with the past of `row`, float32 [laps, causes].

    Args:
        clock: LATER or CALLED, who calls until then.
    """
    rows = empty_rows(laps)
    rows[:, PAST] = row[PAST]
    rows[1:, clock] = np.arange(1, laps)
    return rows


class EditedRaces(NamedTuple):
    """Observations of N edited races: raw rows float32 [N, RAW_SIZE], legal calls bool [N, 4], whether each is feasible bool [N]."""

    raw: Floats
    legal: NDArray[np.bool_]
    feasible: NDArray[np.bool_]


class RaceEditor:
    """Edits one race in many ways at once.

    Args:
        record, car: whose race it is.
        arrays: the race as it stands, f, k, r.
        observer: of the record and car, to reuse one; its tables take 0.1 s to fill.
    """

    def __init__(self, record: RaceRecord, car: int, arrays: Arrays, observer: Observer | None = None) -> None:
        self.record, self.car, self.arrays = record, car, arrays
        self.observer = Observer(record, car) if observer is None else observer

    def edit(self, rows: Floats, calls: Calls = None) -> EditedRaces:
        """What the pit wall sees of the race edited by each of `rows` float32 [N, causes].

        Args:
            calls: calls lap by lap from now, int8 [N, laps], for rows with `laps_called`; None for staying out.
        """
        return self._edit(rows, calls, 1)[0]

    def states(self, rows: Floats, calls: Calls = None) -> tuple[EditedRaces, Arrays]:
        """The same with the edited states: f [N, F_ROWS, CARS], k [N, K_ROWS, CARS], r [N, R_SIZE]."""
        return self._edit(rows, calls, len(rows))

    def _edit(self, rows: Floats, calls: Calls, kept: int) -> tuple[EditedRaces, Arrays]:
        n, (f, k, r) = len(rows), self.arrays
        states = (np.empty((kept, *f.shape), np.float32), np.empty((kept, *k.shape), np.int32), np.empty((kept, *r.shape), np.int32))
        edited = EditedRaces(np.zeros((n, RAW_SIZE), np.float32), np.zeros((n, 4), np.bool_), np.zeros(n, np.bool_))
        if calls is None:
            calls = np.zeros((n, self.record.laps), np.int8)
        o = self.observer
        changes = np.ascontiguousarray(rows, np.float32)
        edit_kernels.edit_races(o.figures, o.context, f, k, r, self.car, changes, np.ascontiguousarray(calls, np.int8), *states, *edited)
        return edited, states


MEASURED_BY: Final = {
    "laps_later": "laps_left",
    "laps_called": "laps_left",
    "time_lost_s": "gap_ahead_s",
    "gap_ahead_s": "gap_ahead_s",
    "gap_behind_s": "gap_behind_s",
    "laps_older": "tyre_age_laps",
    "soft_sets": "soft_sets",
    "medium_sets": "medium_sets",
    "hard_sets": "hard_sets",
}
"""The feature on whose range the distance of a cause is measured. Any change of another cause counts 1."""

STARTS_FROM: Final = {AHEAD: "gap_ahead_s", BEHIND: "gap_behind_s", STATUS: "safety_car"}
"""Causes whose starting value is what is expected of a feature when the change is to hold."""


class ChangeDistance:
    """Scaled distances of changes from one moment, on the scale of the policy's encoder.

    Args:
        features: the policy's feature set; a feature outside it is scaled as in the registry.
        raw: raw row of the moment.
        staying, called: raw rows [laps, RAW_SIZE] expected 0, 1, 2 ... laps from now, staying out and as the policy calls.
    """

    def __init__(self, record: RaceRecord, features: str, raw: Floats, staying: Floats, called: Floats) -> None:
        known = {f.name: f for f in FEATURES} | {f.name: f for f in feature_set(features)}
        self._factor, self._logarithmic = np.ones(len(CAUSES)), np.zeros(len(CAUSES), np.bool_)
        for cause, name in MEASURED_BY.items():
            low, high = working_range(known[name], record.scaling)
            if known[name].logarithmic:
                low, high = float(np.log1p(low)), float(np.log1p(high))
            self._factor[CAUSE[cause]] = (1.0 - known[name].low) / (high - low)
            self._logarithmic[CAUSE[cause]] = known[name].logarithmic
        if "laps_left" not in {f.name for f in feature_set(features)}:
            self._factor[CLOCKS] = 1.0 / record.laps  # such a policy reads the race's progress instead
        self._raw, self._staying, self._called = raw, staying, called

    def starts(self, rows: Floats) -> NDArray[np.float64]:
        """Starting value of each cause of changes [N, causes], float64 [N, causes]."""
        starts = np.zeros(rows.shape)
        later, called = (np.nan_to_num(rows[:, c]).astype(np.int64) for c in CLOCKS)
        called, later = np.minimum(called, len(self._called) - 1), np.minimum(later, len(self._staying) - 1)
        for cause, name in STARTS_FROM.items():
            starts[:, cause] = np.where(called > 0, self._called[called, COLUMN[name]], self._staying[later, COLUMN[name]])
        starts[:, USED] = 1.0 + self._raw[COLUMN["valid_finish"]]
        starts[:, SETS : SETS + 3] = self._raw[COLUMN["soft_sets"] : COLUMN["soft_sets"] + 3]
        return starts

    def distances(self, rows: Floats, starts: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Scaled distance of each cause of changes [N, causes], 0 where it does not change.

        Args:
            starts: starting values float64 [N, causes] where they are known better; None for `self.starts`.
        """
        starts, ends = self.starts(rows) if starts is None else starts, rows.astype(np.float64)
        ends = np.where(np.isnan(ends), starts, ends)
        linear = np.abs(ends - starts)
        logarithmic = np.abs(np.log1p(np.maximum(ends, 0.0)) - np.log1p(np.maximum(starts, 0.0)))
        distances: NDArray[np.float64] = np.where(self._logarithmic, logarithmic, linear) * self._factor
        distances[:, STATUS] = linear[:, STATUS] > 0
        return distances

    def order(self, rows: Floats, norm: Norm) -> NDArray[np.int64]:
        """Indices of changes, the fewest causes first, and among as many causes the nearest first."""
        distances, changed = self.distances(rows), ~np.isnan(rows)
        return np.lexsort((distances.sum(axis=1), cost_of(distances, changed, norm), changed.sum(axis=1)))
