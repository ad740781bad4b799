"""The search for the smallest change under which a policy makes another call: every candidate is put to the policy itself."""

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.counterfactual.change import CAUSE
from rsrl.explanation.counterfactual.costs import Costs
from rsrl.explanation.counterfactual.grid import Grid
from rsrl.explanation.counterfactual.nearest import Norm
from rsrl.explanation.counterfactual.query import PAST, PolicyQuery
from rsrl.explanation.counterfactual.refining import Counterfactual, refine

Floats = NDArray[np.float32]
REFINED: Final = 3
"""Candidates refined before the nearest is taken."""

NEAR: Final = 8
"""Pairs of causes that come nearest to the call, to which a third cause is added where no pair does."""


class Search:
    """Looks for changes that lead one policy to one call from one moment.

    Args:
        grid: what is tried.
        leaf_rows: what leaves of a tree proposed, float32 [N, causes].
    """

    def __init__(self, asker: PolicyQuery, costs: Costs, target: int, norm: Norm, grid: Grid, leaf_rows: Floats) -> None:
        self._asker, self._costs, self._target, self._norm = asker, costs, target, norm
        self._grid, self._leaf_rows = grid, leaf_rows
        self._near: list[tuple[float, Floats]] = []

    def run(self) -> list[Counterfactual]:
        """The best changes found, refined, the best first.

        What the race can still come to goes first: leaves' proposals and single causes, and pairs only where none of these does. Then,
        where nothing is found, the same with causes that only could have been, and last a third cause on top of the nearest pairs.
        """
        found = self._leaf_rows[:0]
        for group in self._groups():
            rows = group()
            found = self._first(rows) if len(rows) else found
            if len(found):
                break
        from_leaf = {row.tobytes() for row in self._leaf_rows}
        refined = [refine(self._asker, self._costs, self._target, row, from_leaf=row.tobytes() in from_leaf) for row in found]
        results = [r for r in refined if r is not None]
        return [results[i] for i in self._costs.order(np.stack([r.row for r in results]), self._norm)] if results else []

    def _groups(self) -> list[Callable[[], Floats]]:
        """What is tried, one after the other, each made only when its turn comes."""
        grid, leaves = self._grid, self._leaf_rows
        hypothetical = (~np.isnan(leaves[:, PAST])).any(axis=1)
        return [
            lambda: np.concatenate([leaves[~hypothetical], grid.singles(hypothetical=False)]),
            lambda: grid.pairs(hypothetical=False),
            lambda: np.concatenate([leaves[hypothetical], grid.singles(hypothetical=True)]),
            lambda: grid.pairs(hypothetical=True),
            lambda: grid.added(self._nearest_misses()),
        ]

    def _first(self, rows: Floats) -> Floats:
        """The cheapest rows that the policy confirms, one for each set of causes, at most REFINED."""
        rows = rows[self._costs.order(rows, self._norm)]
        answers = self._asker(rows)
        kept: dict[bytes, Floats] = {}
        for row in rows[answers.says(self._target)]:
            kept.setdefault(np.isnan(row).tobytes() + row[CAUSE["track_status"]].tobytes(), row)
        if not kept:
            self._remember(rows, answers.short_of(self._target))
        chosen = list(kept.values())[:REFINED]
        return np.stack(chosen) if chosen else rows[:0]

    def _remember(self, rows: Floats, short: NDArray[np.float32]) -> None:
        """Keep the rows of two causes that came nearest to the call, one for each set of causes."""
        best: dict[bytes, tuple[float, Floats]] = {}
        for i in np.argsort(short, kind="stable")[: 64 * NEAR]:
            if np.isfinite(short[i]):
                best.setdefault(np.isnan(rows[i]).tobytes(), (float(short[i]), rows[i]))
        self._near = sorted(self._near + list(best.values())[:NEAR], key=lambda one: one[0])

    def _nearest_misses(self) -> Floats:
        near = [row for _, row in self._near if (~np.isnan(row)).sum() == 2][:NEAR]
        return np.stack(near) if near else self._leaf_rows[:0]
