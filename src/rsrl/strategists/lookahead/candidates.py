"""Candidate actions of the planner: the next stop, on this lap or a later one, for each compound, ranked by clean-air time."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsrl.rollouts import BY_COST, CostToGo
from rsrl.season import GREEN
from rsrl.simulator import Figures
from rsrl.simulator import layout as at
from rsrl.simulator.tyres import next_set
from rsrl.state.outlook import IMPOSSIBLE_S, lap_cost


@dataclass(frozen=True)
class Candidates:
    """Candidate next stops; arrays [m].

    Attributes:
        lap: of the stop, NO_STOP for no further stop.
        compound: code of the compound fitted at the stop.
        call: what the candidate means for the coming lap: 0 stay out, 1 + compound.
        cost_s: expected clean-air time to the flag, relative to the best candidate.
    """

    lap: NDArray[np.int64]
    compound: NDArray[np.int64]
    cost_s: NDArray[np.float64]
    call: NDArray[np.int64]

    def plan_rows(self) -> NDArray[np.int32]:
        """The candidates as rows of the plan table, int32 [m, P_COLUMNS]."""
        table = np.zeros((len(self.lap), at.P_COLUMNS), np.int32)
        table[:, at.P_STOPS], table[:, at.P_SC_WINDOW] = 1, BY_COST
        table[:, at.P_FIRST], table[:, at.P_FIRST + 1] = self.lap, self.compound
        return table

    def subset(self, indices: NDArray[np.int64]) -> "Candidates":
        """The candidates of these indices."""
        return Candidates(self.lap[indices], self.compound[indices], self.cost_s[indices], self.call[indices])


class CandidateStops:
    """Lists the candidates at each decision of one car."""

    def __init__(self, figures: Figures, foresight: CostToGo, car: int) -> None:
        self._laps, self._limit = int(figures.whole[at.I_LAPS]), int(figures.whole[at.I_MAX_LAPS_PER_SET])
        self._foresight, self._sets, self._stops_asked = foresight, figures.sets[:, car], int(figures.whole[at.I_STOPS_ASKED])
        wear = np.array([[float(lap_cost(figures.tyres, c, age)) for age in range(2 * self._laps)] for c in range(3)])
        if self._limit:
            wear[:, self._limit :] = IMPOSSIBLE_S
        self._worn = np.concatenate([np.zeros((3, 1)), np.cumsum(wear, axis=1)], axis=1)

    def every_stop(
        self,
        *,
        lap: int,
        status: int,
        compound: int,
        age: int,
        used: int,
        stops_made: int,
        sets: NDArray[np.int32],
        legal: NDArray[np.bool_],
        stint_offset_s: float,
    ) -> Candidates:
        """Every legal next stop from lap `lap` on, ordered by lap within each compound.

        Args:
            lap: the coming lap.
            status: track status of that lap.
            compound, age: of the set on the car, age in laps.
            used: bit mask of the compounds used so far.
            stops_made: by now.
            sets: sets left of each compound, int32 [3].
            legal: calls that are legal on the coming lap, bool [4].
            stint_offset_s: expected pace of this set beyond its compound's, s a lap.
        """
        laps = self._laps
        stop_laps = np.arange(lap, laps)
        two_used = used & (used - 1) != 0
        own = self._worn[compound, age + stop_laps - lap + 1] - self._worn[compound, age] + stint_offset_s * (stop_laps - lap + 1)
        price = np.full(len(stop_laps), float(self._foresight.price[GREEN]))
        price[:1] = self._foresight.price[status]
        stop_lap, fitted, cost = [], [], []
        for new in range(3):
            if sets[new] > 0:
                fitted_set = next_set(int(self._sets[new]), int(sets[new]), self._foresight.new.shape[3])
                time_s = own + price + self._foresight.new[stop_laps, int(two_used or new != compound), new, fitted_set]
                keep = (stop_laps > lap) & legal[0]
                keep[:1] = legal[1 + new]
                stop_lap.append(stop_laps[keep])
                fitted.append(np.full(keep.sum(), new))
                cost.append(time_s[keep])
        if two_used and stops_made >= self._stops_asked and legal[0]:
            stop_lap.append(np.array([at.NO_STOP]))
            fitted.append(np.array([0]))
            cost.append(
                np.array([self._worn[compound, age + laps - lap + 1] - self._worn[compound, age] + stint_offset_s * (laps - lap + 1)])
            )
        stops, compounds, costs = (np.concatenate(part) for part in (stop_lap, fitted, cost))
        return Candidates(stops, compounds, costs - costs.min(), np.where(stops == lap, compounds + 1, 0))


def shortlist(every: Candidates, max_candidates: int, max_cost_s: float) -> Candidates:
    """At most `max_candidates` of the candidates that cost no more than `max_cost_s`, ordered by lap.

    Stops on the coming lap have priority, then the quickest stop of each later lap, then the quickest of the rest.
    """
    near = np.flatnonzero(every.cost_s <= max_cost_s)
    order = near[np.argsort(every.cost_s[near], kind="stable")]
    _, first = np.unique(every.lap[order], return_index=True)
    rank = np.full(len(order), 2)
    rank[first] = 1
    rank[every.call[order] > 0] = 0
    return every.subset(np.sort(order[np.argsort(rank, kind="stable")][:max_candidates]))
