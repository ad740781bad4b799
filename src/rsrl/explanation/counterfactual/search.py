"""The search for the smallest change under which a policy makes another call; every candidate is put to the policy itself.

Candidates from a grid are asked about in order of their distance. Those confirmed are refined: each cause is moved back toward its starting
value as far as the policy's call allows.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.counterfactual.change import CAUSES, CLOCKS, GAPS, PAST, Change, ChangeDistance, change_of, laps_ahead
from rsrl.explanation.counterfactual.edit_kernels import CALLED, LATER, LOST, OLDER, STATUS
from rsrl.explanation.counterfactual.grid import Grid
from rsrl.explanation.counterfactual.query import Answers, PolicyQuery
from rsrl.explanation.counterfactual.space import Norm
from rsrl.state import COLUMN

Floats = NDArray[np.float32]
REFINED: Final = 3
"""Candidates refined before the nearest is taken."""

NEAR_MISSES: Final = 8
"""Pairs of causes nearest to the call, to which a third cause is added where no pair is confirmed."""

IN_LAPS: Final = (*CLOCKS, OLDER)
IN_SECONDS: Final = (LOST, *GAPS)
STEP_S: Final = 0.1
"""Times are reported in tenths of a second, and checked as they are reported."""

MAX_TIME_S: Final = 60.0
"""Up to here a time is checked; beyond, it counts as "or more"."""

VALUES_AT_ONCE: Final = 32


@dataclass(frozen=True)
class Counterfactual:
    """A change under which the policy makes the call asked for, as checked on the policy.

    Attributes:
        row: the change as the compiled code reads it, float32 [causes].
        starts, distances: starting value of each cause and its scaled distance, float64 [causes].
        q: values [4] in the edited race.
        raw: raw row of the edited race.
        legal: legal calls there, bool [4].
        holds_to: for each gap that changes, and time lost, the farthest value in s up to which the call stays the same.
        from_leaf: it came from a leaf of the tree, not from the grid.
        stops_before: stops before the change holds, as (laps from now, call). Where the policy calls until then, its own; where the car
            stays out, the first lap of each other stop that the policy would call.
    """

    row: Floats
    starts: NDArray[np.float64]
    distances: NDArray[np.float64]
    q: Floats
    raw: Floats
    legal: NDArray[np.bool_]
    holds_to: dict[str, float]
    from_leaf: bool
    stops_before: tuple[tuple[int, int], ...] = ()

    @property
    def change(self) -> Change:
        """What changes."""
        return change_of(self.row)


class Search:
    """Looks for changes of one moment under which one policy calls `target`.

    Args:
        grid: candidates by cause.
        leaf_rows: candidates from leaves of a tree, float32 [N, causes].
    """

    def __init__(self, query: PolicyQuery, distance: ChangeDistance, target: int, norm: Norm, grid: Grid, leaf_rows: Floats) -> None:
        self._query, self._distance, self._target, self._norm = query, distance, target, norm
        self._grid, self._leaf_rows = grid, leaf_rows
        self._misses: list[tuple[float, Floats]] = []

    def run(self) -> list[Counterfactual]:
        """The best changes found, refined, the best first.

        What the race can still come to is tried first: candidates of leaves and single causes, and pairs only where none of these is
        confirmed. Then the same with causes that lie in the past, and last a third cause added to the nearest pairs.
        """
        confirmed = self._leaf_rows[:0]
        for group in self._groups():
            rows = group()
            confirmed = self._confirmed(rows) if len(rows) else confirmed
            if len(confirmed):
                break
        from_leaf = {row.tobytes() for row in self._leaf_rows}
        refiner = _Refiner(self._query, self._distance, self._target)
        refined = [refiner.refine(row, from_leaf=row.tobytes() in from_leaf) for row in confirmed]
        found = [one for one in refined if one is not None]
        return [found[i] for i in self._distance.order(np.stack([one.row for one in found]), self._norm)] if found else []

    def _groups(self) -> list[Callable[[], Floats]]:
        """Groups of candidates in order; each is made only when its turn comes."""
        grid, leaves = self._grid, self._leaf_rows
        past = (~np.isnan(leaves[:, PAST])).any(axis=1)
        return [
            lambda: np.concatenate([leaves[~past], grid.singles(past=False)]),
            lambda: grid.pairs(past=False),
            lambda: np.concatenate([leaves[past], grid.singles(past=True)]),
            lambda: grid.pairs(past=True),
            lambda: grid.with_another_cause(self._nearest_pairs()),
        ]

    def _confirmed(self, rows: Floats) -> Floats:
        """The cheapest rows that the policy confirms, one for each set of causes, at most REFINED."""
        rows = rows[self._distance.order(rows, self._norm)]
        answers = self._query.ask(rows)
        kept: dict[bytes, Floats] = {}
        for row in rows[answers.confirm(self._target)]:
            kept.setdefault(np.isnan(row).tobytes() + row[STATUS].tobytes(), row)
        if not kept:
            self._note_misses(rows, answers)
        chosen = list(kept.values())[:REFINED]
        return np.stack(chosen) if chosen else rows[:0]

    def _note_misses(self, rows: Floats, answers: Answers) -> None:
        """Remember the rows whose value of the call was nearest to the best one, one for each set of causes."""
        best: dict[bytes, tuple[float, Floats]] = {}
        short = answers.shortfall(self._target)
        for i in np.argsort(short, kind="stable")[: 64 * NEAR_MISSES]:
            if np.isfinite(short[i]):
                best.setdefault(np.isnan(rows[i]).tobytes(), (float(short[i]), rows[i]))
        self._misses = sorted(self._misses + list(best.values())[:NEAR_MISSES], key=lambda one: one[0])

    def _nearest_pairs(self) -> Floats:
        pairs = [row for _, row in self._misses if (~np.isnan(row)).sum() == 2][:NEAR_MISSES]
        return np.stack(pairs) if pairs else self._leaf_rows[:0]


class _Refiner:
    """Moves confirmed changes back toward the race as it is, and finds how far each holds; every step is put to the policy."""

    def __init__(self, query: PolicyQuery, distance: ChangeDistance, target: int) -> None:
        self._query, self._distance, self._target = query, distance, target

    def refine(self, row: Floats, *, from_leaf: bool) -> Counterfactual | None:
        """The same causes, each as near to its start as the policy's call allows: laps first, then tenths of a second."""
        row = row.copy()
        for cause in (*IN_LAPS, *IN_SECONDS):
            if not np.isnan(row[cause]):
                row[cause] = self._nearest(row, cause, self._starts(row)[cause])
        starts = self._starts(row)
        holds_to = {CAUSES[c]: self._holds_to(row, c, starts[c]) for c in IN_SECONDS if not np.isnan(row[c])}
        answers = self._query.ask(row[None])
        if not answers.confirm(self._target)[0]:  # values level to the last digit, which batches of another size round otherwise
            return None
        distances = self._distance.distances(row[None], starts[None])[0]
        found = Counterfactual(row, starts, distances, answers.q[0], answers.races.raw[0], answers.races.legal[0], holds_to, from_leaf)
        return replace(found, stops_before=self._stops_before(row))

    def _starts(self, row: Floats) -> NDArray[np.float64]:
        """Starting value of each cause, float64 [causes]; that of a gap is the gap with all else of the change made."""
        starts: NDArray[np.float64] = self._distance.starts(row[None])[0].copy()
        if not np.isnan(row[GAPS]).all():
            rest = row.copy()
            rest[GAPS] = np.nan
            raw = self._query.ask(rest[None]).races.raw[0]
            starts[GAPS] = raw[[COLUMN[CAUSES[cause]] for cause in GAPS]]
        return starts

    def _nearest(self, row: Floats, cause: int, start: float) -> np.float32:
        """The value nearest to `start` at which the policy makes the call: in wide steps first, then within the last of them."""
        steps = np.arange(1.0, row[cause], dtype=np.float32) if cause in IN_LAPS else _tenths_between(start, float(row[cause]))
        best = row[cause]
        while len(steps):
            wide = len(steps) > VALUES_AT_ONCE
            at = np.unique(np.linspace(0, len(steps) - 1, VALUES_AT_ONCE).astype(np.int64)) if wide else np.arange(len(steps))
            confirmed = self._confirmed(row, cause, steps[at])
            if not confirmed.any():
                break
            first = int(confirmed.argmax())
            best = steps[at[first]]
            steps = steps[(at[first - 1] + 1 if first else 0) : at[first]] if wide else steps[:0]
        return np.float32(best)

    def _holds_to(self, row: Floats, cause: int, start: float) -> float:
        """The farthest value from the row's own outward up to which the call stays the same; 0 or MAX_TIME_S where to the end."""
        value = float(row[cause])
        end = MAX_TIME_S if value > start else 0.0
        if abs(end - value) < STEP_S:
            return end
        outward = np.round(np.linspace(value, end, VALUES_AT_ONCE), 1).astype(np.float32)
        confirmed = self._confirmed(row, cause, outward)
        return float(outward[-1] if confirmed.all() else outward[max(int((~confirmed).argmax()) - 1, 0)])

    def _confirmed(self, row: Floats, cause: int, values: Floats) -> NDArray[np.bool_]:
        rows = np.repeat(row[None], len(values), axis=0)
        rows[:, cause] = values
        return self._query.ask(rows).confirm(self._target)

    def _stops_before(self, row: Floats) -> tuple[tuple[int, int], ...]:
        """As `Counterfactual.stops_before` has them."""
        followed = self._query.calls_of(row[None])
        if followed is not None:
            stops = np.flatnonzero(followed[0, : int(row[CALLED])])
            return tuple((int(n), int(followed[0, n])) for n in stops)
        if np.isnan(row[LATER]):
            return ()
        first: dict[int, int] = {}
        for n, call in enumerate(self._query.ask(laps_ahead(row, LATER, int(row[LATER]))).calls.tolist()):
            if call not in (0, self._target):
                first.setdefault(call, n)
        return tuple(sorted((n, call) for call, n in first.items()))


def _tenths_between(start: float, end: float) -> Floats:
    """Whole tenths of a second from `start`, not included, to `end`, nearest to the start first."""
    if end > start:
        return (np.arange(np.floor(start / STEP_S + 1.0e-6) + 1, np.ceil(end / STEP_S - 1.0e-6) + 1) * STEP_S).astype(np.float32)
    return (np.arange(np.ceil(start / STEP_S - 1.0e-6) - 1, np.floor(end / STEP_S + 1.0e-6) - 1, -1) * STEP_S).astype(np.float32)
