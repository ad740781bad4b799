"""What may be different about a race before a call: the causes, and a race changed by them.

A feature such as the expected time of a stop is not a cause: it follows. A change is put into the race itself, and every feature is read
off the changed race by the code that reads every other race (`state.observe`).
"""

import math
from dataclasses import dataclass, fields
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.counterfactual import edit_kernels as altering
from rsrl.explanation.moment import Arrays
from rsrl.season import RaceRecord
from rsrl.state import RAW_SIZE, Observer

Floats = NDArray[np.float32]
Calls = NDArray[np.int8] | None


@dataclass(frozen=True)
class Change:
    """A race that is otherwise: None leaves a thing as it is. Fields stand in the order in which the compiled code reads them.

    Attributes:
        laps_later: so many laps from now, staying out until then.
        laps_called: the same, called by the policy until then; not together with `laps_later`.
        time_lost_s: lost by that time.
        gap_ahead_s, gap_behind_s: to the cars one place ahead and behind, at that time. Cars that would be passed by the moved car move on.
        track_status: 0 green, 1 virtual safety car, 2 safety car; newly so.
        boxed_ahead, boxed_behind: 1 where the car ahead, or behind, boxed at the end of the last lap.
        laps_older: laps by which the set now fitted is older.
        compounds_used: by now, 1 (the one fitted) or 2.
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
        """What changes, by name."""
        return {f.name: value for f in fields(self) if (value := getattr(self, f.name)) is not None}

    @property
    def laps(self) -> int:
        """Laps from now."""
        return int(self.laps_later or self.laps_called or 0)

    @property
    def reachable(self) -> bool:
        """Whether the race can still come to it."""
        return not any(name in HYPOTHETICAL for name in self.parts)


HYPOTHETICAL: Final = ("laps_older", "compounds_used", "soft_sets", "medium_sets", "hard_sets")
"""What nothing still to come brings about: had the stop been earlier, or for another compound, had a set been kept or been used."""

CAUSES: Final = tuple(f.name for f in fields(Change))
CAUSE: Final = {name: i for i, name in enumerate(CAUSES)}


def change_rows(changes: list[Change]) -> Floats:
    """Changes as the compiled code reads them, float32 [N, len(CAUSES)]; not a number: as it is."""
    return np.array([[math.nan if (v := getattr(c, name)) is None else v for name in CAUSES] for c in changes], np.float32).reshape(
        len(changes), len(CAUSES)
    )


def change_of(row: Floats) -> Change:
    """A row of `change_rows` back as a change."""
    return Change(**{name: None if math.isnan(value) else float(value) for name, value in zip(CAUSES, row, strict=True)})


class Altered(NamedTuple):
    """Races changed: raw rows float32 [N, RAW_SIZE], legal calls bool [N, 4], whether the change can be made at all bool [N]."""

    raw: Floats
    legal: NDArray[np.bool_]
    possible: NDArray[np.bool_]


class RaceEditor:
    """Changes one race in many ways at once.

    Args:
        record, car: whose race it is.
        arrays: the race as it stands, f, k, r.
        observer: of the record and car, where there is one already: its tables take a while to fill.
    """

    def __init__(self, record: RaceRecord, car: int, arrays: Arrays, observer: Observer | None = None) -> None:
        self.record, self.car, self.arrays = record, car, arrays
        self.observer = Observer(record, car) if observer is None else observer

    def __call__(self, rows: Floats, calls: Calls = None) -> Altered:
        """The races that `rows` float32 [N, len(CAUSES)] make of this one, as the pit wall sees them.

        calls: what is called lap by lap from now, int8 [N, laps], by rows with `laps_called`; None: staying out.
        """
        return self._alter(rows, calls, 1)[0]

    def states(self, rows: Floats, calls: Calls = None) -> tuple[Altered, Arrays]:
        """The same, with the states themselves: f [N, F_ROWS, 20], k [N, K_ROWS, 20], r [N, R_SIZE]."""
        return self._alter(rows, calls, len(rows))

    def _alter(self, rows: Floats, calls: Calls, kept: int) -> tuple[Altered, Arrays]:
        n, (f, k, r) = len(rows), self.arrays
        states = (np.empty((kept, *f.shape), np.float32), np.empty((kept, *k.shape), np.int32), np.empty((kept, *r.shape), np.int32))
        out = Altered(np.zeros((n, RAW_SIZE), np.float32), np.zeros((n, 4), np.bool_), np.zeros(n, np.bool_))
        if calls is None:
            calls = np.zeros((n, self.record.laps), np.int8)
        o = self.observer
        changes = np.ascontiguousarray(rows, np.float32)
        altering.alter_races(o.figures, o.context, f, k, r, self.car, changes, np.ascontiguousarray(calls, np.int8), *states, *out)
        return out, states
