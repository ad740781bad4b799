"""A change found on a grid brought back toward the race as it is, and how far it holds; every step is put to the policy."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.counterfactual.change import CAUSE, CAUSES, Change, change_of
from rsrl.explanation.counterfactual.costs import Costs
from rsrl.explanation.counterfactual.query import CALLED, GAPS, LATER, PAST, PolicyQuery
from rsrl.state import COLUMN

Floats = NDArray[np.float32]
LOST: Final = CAUSE["time_lost_s"]
LAPS: Final = (LATER, CALLED, CAUSE["laps_older"])
SECONDS: Final = (LOST, *GAPS)
STEP_S: Final = 0.1
"""Gaps are told in tenths of a second, and checked as told."""
FARTHEST_S: Final = 60.0
BETWEEN: Final = 32


@dataclass(frozen=True)
class Counterfactual:
    """A change under which the policy makes the call asked for, checked.

    Attributes:
        row: the change as the compiled code reads it, float32 [causes].
        starts, distances: where each cause starts from and how far it goes, float64 [causes].
        q: values [4] there.
        raw: raw row there.
        legal: bool [4], calls that may be made there.
        holds_s: for each gap, and time lost, that changes, how far beyond its value the call stays the same.
        from_leaf: it came from a leaf of the tree, not from the grid of causes.
        on_the_way: stops as (laps from now, call): those made until then where the policy is followed; else, where one stays out, other
            stops that the policy would call for before, the first of each.
    """

    row: Floats
    starts: NDArray[np.float64]
    distances: NDArray[np.float64]
    q: Floats
    raw: Floats
    legal: NDArray[np.bool_]
    holds_s: dict[str, float]
    from_leaf: bool
    on_the_way: tuple[tuple[int, int], ...] = ()

    @property
    def change(self) -> Change:
        """What changes."""
        return change_of(self.row)


def refine(asker: PolicyQuery, costs: Costs, target: int, row: Floats, *, from_leaf: bool) -> Counterfactual | None:
    """The same causes, each as near to where it starts as the policy's call allows: whole laps first, then tenths of a second."""
    row = row.copy()
    for cause in (*LAPS, *SECONDS):
        if not np.isnan(row[cause]):
            row[cause] = _nearest(asker, target, row, cause, _starts(asker, costs, row)[cause])
    starts = _starts(asker, costs, row)
    holds = {CAUSES[c]: _holds_to(asker, target, row, c, starts[c]) for c in SECONDS if not np.isnan(row[c])}
    answers = asker(row[None])
    if not answers.says(target)[0]:  # level to the last digit, which a batch of another size rounds otherwise
        return None
    distances = costs.distances(row[None], starts[None])[0]
    found = Counterfactual(row, starts, distances, answers.q[0], answers.races.raw[0], answers.races.legal[0], holds, from_leaf)
    return replace(found, on_the_way=_on_the_way(asker, row, target))


def _starts(asker: PolicyQuery, costs: Costs, row: Floats) -> NDArray[np.float64]:
    """Where each cause starts from, float64 [causes]; a gap from what it would be if the rest of the change were so."""
    starts: NDArray[np.float64] = costs.starts(row[None])[0].copy()
    if not np.isnan(row[list(GAPS)]).all():
        rest = row.copy()
        rest[list(GAPS)] = np.nan
        raw = asker(rest[None]).races.raw[0]
        starts[list(GAPS)] = raw[[COLUMN[CAUSES[cause]] for cause in GAPS]]
    return starts


def _nearest(asker: PolicyQuery, target: int, row: Floats, cause: int, start: float) -> np.float32:
    """The value nearest to `start` at which the call is the one wanted: wide steps first, then the last of them."""
    steps = np.arange(1.0, row[cause], dtype=np.float32) if cause in LAPS else _tenths_between(start, float(row[cause]))
    best = row[cause]
    while len(steps):
        at = np.unique(np.linspace(0, len(steps) - 1, BETWEEN).astype(np.int64)) if len(steps) > BETWEEN else np.arange(len(steps))
        good = _confirmed(asker, target, row, cause, steps[at])
        if not good.any():
            return np.float32(best)
        first = int(good.argmax())
        best = steps[at[first]]
        if len(at) == len(steps):
            return np.float32(best)
        steps = steps[(at[first - 1] + 1 if first else 0) : at[first]]
    return np.float32(best)


def _tenths_between(start: float, end: float) -> Floats:
    """Whole tenths of a second from `start`, not included, to `end`, nearest to the start first."""
    if end > start:
        return (np.arange(np.floor(start / STEP_S + 1.0e-6) + 1, np.ceil(end / STEP_S - 1.0e-6) + 1) * STEP_S).astype(np.float32)
    return (np.arange(np.ceil(start / STEP_S - 1.0e-6) - 1, np.floor(end / STEP_S + 1.0e-6) - 1, -1) * STEP_S).astype(np.float32)


def _holds_to(asker: PolicyQuery, target: int, row: Floats, cause: int, start: float) -> float:
    """The farthest value to which the call stays the same without a break, from the row's own outward; 0 or FARTHEST_S where to the end."""
    value = float(row[cause])
    end = FARTHEST_S if value > start else 0.0
    if abs(end - value) < STEP_S:
        return end
    outward = np.round(np.linspace(value, end, BETWEEN), 1).astype(np.float32)
    good = _confirmed(asker, target, row, cause, outward)
    return float(outward[-1] if good.all() else outward[max(int((~good).argmax()) - 1, 0)])


def _confirmed(asker: PolicyQuery, target: int, row: Floats, cause: int, values: Floats) -> NDArray[np.bool_]:
    rows = np.repeat(row[None], len(values), axis=0)
    rows[:, cause] = values
    return asker(rows).says(target)


def _on_the_way(asker: PolicyQuery, row: Floats, target: int) -> tuple[tuple[int, int], ...]:
    """Stops on the way to a change some laps from now, as `Counterfactual.on_the_way` has them."""
    followed = asker.calls_of(row[None])
    if followed is not None:
        stops = np.flatnonzero(followed[0, : int(row[CALLED])])
        return tuple((int(n), int(followed[0, n])) for n in stops)
    if np.isnan(row[LATER]):
        return ()
    rows = np.full((int(row[LATER]), len(CAUSES)), np.nan, np.float32)
    rows[:, PAST] = row[PAST]
    rows[1:, LATER] = np.arange(1, len(rows))
    first: dict[int, int] = {}
    for n, call in enumerate(asker(rows).calls.tolist()):
        if call not in (0, target):
            first.setdefault(call, n)
    return tuple(sorted((n, call) for call, n in first.items()))
