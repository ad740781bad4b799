"""Imitation of real teams: the fitted model of their calls that drives the rivals, as a strategist (a Virtual Strategy Engineer)."""

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.season import RaceRecord
from rsrl.simulator.rivals import imitate_rows
from rsrl.strategists.interface import Strategist, made_legal

SEED_SALT: int = 0x5EED
"""Keeps its random numbers apart from those of the races it calls."""


class ImitationStrategist(Strategist):
    """Boxes with the probability that teams had in the same situation, for the compound they chose.

    Runs the rivals' kernel on what timing screens show (gaps, tyres, stops, track status), with its own random numbers.

    Raises:
        RsrlError: the season file has no model of teams' calls.
    """

    name = "imitation"

    def __init__(self, record: RaceRecord, car: int, seed: int) -> None:
        if not record.rivals.hazard:
            raise RsrlError(f"{record.name}: the season file holds no model of calls (rivals.hazard); leave out the strategist imitation")
        self._seed = seed

    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        """Note seed and numbers of the races."""
        self._stream = (seed * 0x9E3779B1 + self._seed + SEED_SALT) % 2**63
        self._races = races
        self._calls = np.zeros(len(races), np.int8)

    def decide(self, environment: RaceEnvironment) -> NDArray[np.int8]:
        """Calls drawn from the model, illegal ones replaced."""
        b = environment.races
        imitate_rows(b.figures.rivals, b.f, b.k, b.r, environment.car, self._stream, self._races, self._calls)
        return made_legal(self._calls, environment.legal)
