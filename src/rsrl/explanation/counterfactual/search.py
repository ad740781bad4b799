"""The search for the smallest change under which a policy makes another call: every candidate is put to the policy itself."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.counterfactual.asking import Asker
from rsrl.explanation.counterfactual.causes import CAUSE, CAUSES, HYPOTHETICAL, Change, change_of
from rsrl.explanation.counterfactual.costs import Costs
from rsrl.explanation.counterfactual.nearest import Norm

Floats = NDArray[np.float32]
GAPS: Final = (CAUSE["gap_ahead_s"], CAUSE["gap_behind_s"])
PAST: Final = [CAUSE[name] for name in HYPOTHETICAL]
STEP_S: Final = 0.1
"""Gaps are told in tenths of a second, and checked as told."""
FARTHEST_S: Final = 60.0
BETWEEN: Final = 32
REFINED: Final = 3
"""Candidates refined before the nearest is taken."""


@dataclass(frozen=True)
class Counterfactual:
    """A change under which the policy makes the call asked for, checked.

    Attributes:
        row: the change as the compiled code reads it, float32 [causes].
        starts, distances: where each cause starts from and how far it goes, float64 [causes].
        q: values [4] there.
        raw: raw row there.
        holds_s: for each gap that changes, how far beyond its value the call stays the same.
        from_leaf: it came from a leaf of the tree, not from the grid of causes.
    """

    row: Floats
    starts: NDArray[np.float64]
    distances: NDArray[np.float64]
    q: Floats
    raw: Floats
    holds_s: dict[str, float]
    from_leaf: bool

    @property
    def change(self) -> Change:
        """What changes."""
        return change_of(self.row)


def search(asker: Asker, costs: Costs, target: int, norm: Norm, leaf_rows: Floats, singles: Floats, pairs: Floats) -> list[Counterfactual]:
    """The best changes found, refined, the best first.

    What the race can still come to goes first: leaves' proposals and single causes, and pairs only where none of these does. Then, where
    nothing is found, the same with causes that only could have been.
    """
    from_leaf = {row.tobytes() for row in leaf_rows}
    found = pairs[:0]
    for hypothetical in (False, True):
        for group in (np.concatenate([leaf_rows, singles]), pairs):
            rows = group[(~np.isnan(group[:, PAST])).any(axis=1) == hypothetical]
            if not len(found) and len(rows):
                found = _first(asker, costs, target, norm, rows)
    refined = [_refine(asker, costs, target, row, row.tobytes() in from_leaf) for row in found]
    results = [r for r in refined if r is not None]
    if not results:
        return []
    return [results[i] for i in costs.order(np.stack([r.row for r in results]), norm)]


def _first(asker: Asker, costs: Costs, target: int, norm: Norm, rows: Floats) -> Floats:
    """The cheapest rows that the policy confirms, one for each set of causes, at most REFINED."""
    rows = rows[costs.order(rows, norm)]
    kept: dict[bytes, Floats] = {}
    for row in rows[asker(rows).says(target)]:
        kept.setdefault(np.isnan(row).tobytes() + row[CAUSE["track_status"]].tobytes(), row)
    chosen = list(kept.values())[:REFINED]
    return np.stack(chosen) if chosen else rows[:0]


def _refine(asker: Asker, costs: Costs, target: int, row: Floats, from_leaf: bool) -> Counterfactual | None:
    """The same causes, each gap as near to where it starts as the policy's call allows, in tenths of a second."""
    row = row.copy()
    starts = costs.starts(row[None])[0]
    holds: dict[str, float] = {}
    for cause in GAPS:
        if not np.isnan(row[cause]):
            row[cause] = _nearest_gap(asker, target, row, cause, starts[cause])
    for cause in GAPS:
        if not np.isnan(row[cause]):
            holds[CAUSES[cause]] = _holds_to(asker, target, row, cause, starts[cause])
    answers = asker(row[None])
    if not answers.says(target)[0]:  # level to the last digit, which a batch of another size rounds otherwise
        return None
    return Counterfactual(row, starts, costs.distances(row[None])[0], answers.q[0], answers.races.raw[0], holds, from_leaf)


def _nearest_gap(asker: Asker, target: int, row: Floats, cause: int, start: float) -> np.float32:
    """The value nearest to `start` at which the call is the one wanted, in tenths of a second: wide steps first, then the last of them."""
    tenths = _tenths_between(start, float(row[cause]))
    best = row[cause]
    while len(tenths):
        at = np.unique(np.linspace(0, len(tenths) - 1, BETWEEN).astype(np.int64)) if len(tenths) > BETWEEN else np.arange(len(tenths))
        good = _confirmed(asker, target, row, cause, tenths[at])
        if not good.any():
            return np.float32(best)
        first = int(good.argmax())
        best = tenths[at[first]]
        if len(at) == len(tenths):
            return np.float32(best)
        tenths = tenths[(at[first - 1] + 1 if first else 0) : at[first]]
    return np.float32(best)


def _tenths_between(start: float, end: float) -> Floats:
    """Whole tenths of a second from `start`, not included, to `end`, nearest to the start first."""
    if end > start:
        return (np.arange(np.floor(start / STEP_S + 1.0e-6) + 1, np.ceil(end / STEP_S - 1.0e-6) + 1) * STEP_S).astype(np.float32)
    return (np.arange(np.ceil(start / STEP_S - 1.0e-6) - 1, np.floor(end / STEP_S + 1.0e-6) - 1, -1) * STEP_S).astype(np.float32)


def _holds_to(asker: Asker, target: int, row: Floats, cause: int, start: float) -> float:
    """The farthest value to which the call stays the same without a break, from the row's own outward; 0 or FARTHEST_S where to the end."""
    value = float(row[cause])
    end = FARTHEST_S if value > start else 0.0
    if abs(end - value) < STEP_S:
        return end
    outward = np.round(np.linspace(value, end, BETWEEN), 1).astype(np.float32)
    good = _confirmed(asker, target, row, cause, outward)
    return float(outward[-1] if good.all() else outward[max(int((~good).argmax()) - 1, 0)])


def _confirmed(asker: Asker, target: int, row: Floats, cause: int, values: Floats) -> NDArray[np.bool_]:
    rows = np.repeat(row[None], len(values), axis=0)
    rows[:, cause] = values
    return asker(rows).says(target)
