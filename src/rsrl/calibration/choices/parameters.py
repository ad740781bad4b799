"""Parameters of the choice model: their priors, and the flat vector of standard normal deviates in which they are fitted.

Every parameter is `mean + sd x deviate` with the deviate standard normal a priori, so that the whole prior is half the squared length of
the vector, and all its directions have about the same scale.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

C_NUMBERS: Final = 7
"""Hardnesses 0 to 6; the C1 of seasons up to 2022 is hardness 0, as the C0 of 2023."""

REFERENCE: Final = 3  # C3, in the middle of the range
NEW_RULES: Final = 2022
"""First season of the 18-inch tyres. Later rules stand with it until they have seasons of their own."""

OLD_WEIGHT: Final = 0.3
"""What a race before NEW_RULES counts for: other tyres, other cars."""

GRID_GROUPS: Final = (5, 10)
"""Grid places 1-5, 6-10 and the rest start on different tyres: those ahead have a place to lose, those behind one to win."""

STOP_BEYOND_S: Final = 3.4
"""What a stop costs in the race beyond the pit loss, s: the cold lap on the new set (0.9), and traffic where the car rejoins, which the
race prices at 1.7 [0.5, 2.9] (`benchmarks/stop_in_traffic.py`, files of 2023). Chosen between 0 and 3.4 on the plans of 2023: with 0
the best plans stop too seldom, since wear then comes out too low by what keeps teams from stopping (docs/calibration.md)."""

RACE_EFFECTS: Final = ("wear", "gap", "soft", "hard")
RACE_SD: Final = (0.15, 0.15, 0.07, 0.07)
"""What one weekend's tyres do beyond circuit and season: log wear, log gap between compounds, level of the soft and of the hard, s."""


SEASON_EFFECTS: Final = ("wear", "gap")
SEASON_SD: Final = 0.1
"""What a season's tyres do beyond C-number and rules: log wear and log gap."""


class Prior(NamedTuple):
    """Prior of a parameter: mean and sd, alike for all its entries or one for each."""

    shape: tuple[int, ...]
    mean: Any
    sd: Any


@dataclass(frozen=True)
class Space:
    """Names and order of the parameters for given circuits, seasons and rows of races."""

    circuits: tuple[str, ...]
    seasons: tuple[int, ...]
    races: int

    @property
    def priors(self) -> dict[str, Prior]:
        """Priors by name; softened ones (`*_t`) pass through a softplus."""
        tracks, seasons, groups = len(self.circuits), len(self.seasons), len(GRID_GROUPS) + 1
        return {
            "gap": Prior((C_NUMBERS - 1,), 0.35, 0.25),  # fresh tyre, s a step softer
            "wear": Prior((), math.log(0.06), 0.4),  # log s per lap of C3
            "wear_step": Prior((C_NUMBERS - 1,), 0.45, 0.3),  # log ratio to the next softer
            "track_wear": Prior((tracks,), 0.0, 0.35),
            "track_gap": Prior((tracks,), 0.0, 0.25),
            "season_wear": Prior((seasons,), 0.0, SEASON_SD),
            "season_gap": Prior((seasons,), 0.0, SEASON_SD),
            "old_wear": Prior((), 0.0, 0.3),  # tyres of the seasons before NEW_RULES
            "old_gap": Prior((), 0.0, 0.3),
            "race": Prior((self.races, len(RACE_EFFECTS)), 0.0, np.array(RACE_SD)),
            "start": Prior((2, 2), 0.0, np.array([[4.0], [2.0]])),  # s by rules; soft and hard against medium
            "start_group": Prior((2, groups, 2), 0.0, 1.0),
            "fuel": Prior((), 0.0, 0.5),  # wear from the first lap to the last, as a share
            "undercut": Prior((), 0.0, 0.5),  # s for each lap by which the first stop comes later
            "undercut_start": Prior((2, 3), 0.0, 0.2),
            "choice_t": Prior((), 1.0, 3.0),
            "stop_t": Prior((), 1.0, 3.0),
            "lapse": Prior((), -3.5, 0.5),  # log-odds
            "stop_lapse": Prior((), -2.5, 0.5),
            "lap_level": Prior((), 0.0, 0.5),  # how slopes of lap times follow wear: log ratio at 0.06 s, and power
            "lap_power": Prior((), 0.6, 0.4),
            "lap_gap": Prior((), 0.8, 0.4),  # levels of lap times against gaps of choices
        }

    @property
    def size(self) -> int:
        """Length of the flat vector."""
        return sum(int(np.prod(p.shape)) for p in self.priors.values())

    def values(self, deviates: Any) -> dict[str, Any]:
        """Parameters by name from the flat vector (NumPy or JAX)."""
        found, at = {}, 0
        for name, prior in self.priors.items():
            n = int(np.prod(prior.shape))
            found[name] = prior.mean + prior.sd * deviates[at : at + n].reshape(prior.shape)
            at += n
        return found

    def circuit(self, circuit: str) -> int:
        """Index of a circuit, -1 for one that no race was run on."""
        return self.circuits.index(circuit) if circuit in self.circuits else -1

    def season(self, season: int) -> int:
        """Index of a season, -1 for one without races."""
        return self.seasons.index(season) if season in self.seasons else -1


def grid_group(grid: int) -> int:
    """Group of a grid place."""
    return sum(grid > last for last in GRID_GROUPS)


def space_of(races: Sequence[tuple[str, int]], rows: int) -> Space:
    """The space of races given as (circuit, season), with effects for so many rows of races."""
    return Space(tuple(sorted({c for c, _ in races})), tuple(sorted({s for _, s in races})), rows)
