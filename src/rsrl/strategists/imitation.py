"""What a team would have done: the model of real calls that rivals run on, as a strategist (a Virtual Strategy Engineer)."""

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.season import RaceRecord
from rsrl.simulator.rivals import imitate_rows
from rsrl.strategists.interface import Strategist, made_legal

LUCK: int = 0x5EED
"""Sets its draws apart from those of the races it calls."""


class ImitationStrategist(Strategist):
    """Boxes with the probability with which teams did in such a place, and for the compound they took.

    It runs the rivals' own kernel on what timing screens show of the race: gaps, tyres, stops, track status; with luck of its own.

    Raises:
        RsrlError: the season file holds no model of calls.
    """

    name = "imitation"

    def __init__(self, record: RaceRecord, car: int, seed: int) -> None:
        if not record.rivals.hazard:
            raise RsrlError(f"{record.name}: the season file holds no model of calls (rivals.hazard); leave out the strategist imitation")
        self._seed = seed

    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        """Remember which races these are."""
        self._luck = (seed * 0x9E3779B1 + self._seed + LUCK) % 2**63
        self._races = races
        self._calls = np.zeros(len(races), np.int8)

    def decide(self, environment: RaceEnvironment) -> NDArray[np.int8]:
        """The model's calls, those that are not legal put right."""
        b = environment.races
        imitate_rows(b.figures.rivals, b.f, b.k, b.r, environment.car, self._luck, self._races, self._calls)
        return made_legal(self._calls, environment.legal)
