"""Stochastic dynamic programming as a strategist: each lap the call with the least expected time to the flag, future safety cars included.

The value table (`state.expectation`) follows Heine & Thraves (2023): a car alone on the track that knows how likely a safety car is and
what a stop costs under one. One addition: time lost counts less where a later safety car may give it back (`REGAINED`).
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.season import GREEN, RED, SC, RaceRecord
from rsrl.simulator import compile_figures
from rsrl.state import COLUMN, REGAINED, expectation_table, expected_calls_of_rows
from rsrl.strategists.interface import Strategist, column, coming_lap, made_legal, stint_laps

SETS: Final = slice(COLUMN["soft_sets"], COLUMN["soft_sets"] + 3)
ILLEGAL_S: Final = 1.0e9


class DpStrategist(Strategist):
    """Makes the call with the least expected time to the flag; ignores other cars.

    Args:
        seed: unused, the strategist is deterministic.
        regained: see `REGAINED`; 0 gives the published method.
    """

    name = "dp"

    def __init__(self, record: RaceRecord, car: int, seed: int, *, regained: float = REGAINED) -> None:
        self._table = expectation_table(compile_figures(record), car, regained=regained)

    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        """Start on a green track."""
        self._effective_age = np.zeros(len(races), np.float32)
        self._status = np.full(len(races), GREEN, np.int64)

    def decide(self, environment: RaceEnvironment) -> NDArray[np.int8]:
        """The legal call with the least expected time to the flag."""
        values = np.where(environment.legal, self.expected_times_s(environment), ILLEGAL_S)
        return made_legal(values.argmin(axis=1).astype(np.int8), environment.legal)

    def expected_times_s(self, environment: RaceEnvironment) -> NDArray[np.float32]:
        """Expected time to the flag of each call, relative to reference laps throughout, s, float32 [B, 4].

        Must be called exactly once per lap: it tracks the slow laps, on which a set ages less.
        """
        status = column(environment, "safety_car").astype(np.int32)
        status[(status == SC) & (column(environment, "pit_cost_s") == 0)] = (
            RED  # features report a red flag as a safety car with a free stop
        )
        fitted, age = stint_laps(environment) == 0, column(environment, "tyre_age_laps")
        self._effective_age = np.where(fitted, age, self._effective_age + self._table.ageing[self._status]).astype(np.float32)
        self._status = status.astype(np.int64)
        left = environment.raw[:, SETS].astype(np.int32)
        used = ((left < self._table.sets) << np.arange(3)).sum(axis=1).astype(np.int32)
        values = np.empty((environment.batch, 4), np.float32)
        laps_done, compound = (coming_lap(environment) - 1).astype(np.int32), column(environment, "tyre").astype(np.int32)
        expected_calls_of_rows(self._table, laps_done, status, left, compound, self._effective_age, used, values)
        return values
