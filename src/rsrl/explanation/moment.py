"""A decision of a race with the laps before it: what the explainers explain."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsrl.season import RaceRecord

Arrays = tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.int32]]


@dataclass(frozen=True)
class Moment:
    """A race before one lap.

    Attributes:
        record, car: whose race it is.
        lap: the lap to be called, 1 for the first.
        raw: raw feature rows float32 [T, RAW_SIZE] of all decisions so far; the last row is this decision.
        legal: bool [4], the calls that the rules allow.
        calls: int8 [T - 1], the calls made before.
        arrays: the simulator's state f, k, r (`simulator.layout`). Rollouts draw anew whatever a pit wall cannot see in it.
        seed, race: the simulated race it comes from; None for a state from elsewhere.
    """

    record: RaceRecord
    car: int
    lap: int
    raw: NDArray[np.float32]
    legal: NDArray[np.bool_]
    calls: NDArray[np.int8]
    arrays: Arrays
    seed: int | None = None
    race: int | None = None

    @property
    def driver(self) -> str:
        """Code of the car's driver."""
        return self.record.cars[self.car].driver
