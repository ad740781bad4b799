"""What every way of calling a race has in common."""

from abc import ABC, abstractmethod
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.state import COLUMN

HARDEST_FIRST: Final = (3, 2, 1)
"""Box calls in the order in which they stand in for one that cannot be made."""


class Strategist(ABC):
    """Calls the races of an environment, one decision a lap each.

    It sees what a pit wall sees: `environment.raw`, `environment.legal` and `environment.record`; never the plans of
    the other cars nor what is to come. Anything random in it is a pure function of its own seed, the race and the
    lap, so a race is called the same in any batch.
    """

    name: str

    races_alone: bool = False
    """Whether each race is called by itself, so that a batch of another size cannot change a bit and none need be filled up."""

    @abstractmethod
    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        """Take up races just reset: number `races` int64 [B] of `seed`. The starting tyre stands in the raw rows."""

    @abstractmethod
    def decide(self, environment: RaceEnvironment) -> NDArray[np.int8]:
        """Calls for the coming lap, int8 [B], each legal where the race goes on."""


def column(environment: RaceEnvironment, name: str) -> NDArray[np.float32]:
    """One raw feature of every race, float32 [B], in its natural unit."""
    return environment.raw[:, COLUMN[name]]


def coming_lap(environment: RaceEnvironment) -> NDArray[np.int64]:
    """The lap about to be driven, 1 for the first, int64 [B]."""
    return environment.laps - column(environment, "laps_left").astype(np.int64) + 1


def made_legal(calls: NDArray[np.int8], legal: NDArray[np.bool_]) -> NDArray[np.int8]:
    """`calls` int8 [B] where legal [B, 4]; else staying out, and where that is not legal the hardest set there is."""
    answer = calls.copy()
    for fallback in (0, *HARDEST_FIRST):
        bad = ~legal[np.arange(len(answer)), answer]
        if not bad.any():
            return answer
        answer[bad & legal[:, fallback]] = fallback
    return answer
