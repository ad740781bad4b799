"""What RSRL's learner is trained for: the mean finishing position, championship points, or the paper's reward.

A goal scores how a race ended. Learning goes on in units of about a place, so that the settings found for positions (chance to branch,
expected time, step size) hold for every goal; the policy's action values are in the goal's own unit.
"""

from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.agents.config import GoalName
from rsrl.environment.reward import EXTRA_STOP, FINISH, STEP
from rsrl.simulator import POINTS_BY_POSITION

TENTH: Final = np.array([10.0])
"""The place whose worth is the value of every decision before learning: a midfield finish."""

Doubles = NDArray[np.float64]


class Goal(NamedTuple):
    """How a race is scored; more is better.

    Attributes:
        of_positions: scores of finishing positions, in the unit.
        extra_stop: added for each stop that the tyre rules no longer asked for.
        place: units that learning counts as one place.
        unit: of the action values, as explanations name it.
    """

    of_positions: Callable[[Doubles], Doubles]
    extra_stop: float
    place: float
    unit: str

    @property
    def start(self) -> float:
        """Value of every decision before learning, in places."""
        return float(self.of_positions(TENTH)[0]) / self.place

    def scores(self, positions: NDArray[np.floating[Any]], extra_stops: NDArray[np.floating[Any]]) -> Doubles:
        """Scores in places of positions and extra stops, both [N, 4]; 0 where the position is NaN, as a call is that was not tried."""
        tried = np.isfinite(positions)
        score = self.of_positions(np.where(tried, positions, 1.0).astype(np.float64)) + self.extra_stop * extra_stops
        return np.where(tried, score / self.place, 0.0)


def _from_table(table: NDArray[Any]) -> Callable[[Doubles], Doubles]:
    return lambda positions: table[positions.astype(np.int64)].astype(np.float64)


GOALS: Final[Mapping[GoalName, Goal]] = {
    "position": Goal(np.negative, 0.0, 1.0, "places"),
    # a place among the first ten is worth 25 / 10 points on average
    "points": Goal(_from_table(POINTS_BY_POSITION), 0.0, 2.5, "points"),
    # what the laps themselves pay does not depend on the calls, but a lap with an extra stop pays less
    "paper-reward": Goal(_from_table(FINISH), float(EXTRA_STOP - STEP), 250.0, "points of reward"),
}
"""Goals by name."""
