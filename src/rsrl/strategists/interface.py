"""The interface of every strategist, and helpers they share."""

from abc import ABC, abstractmethod
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.simulator import layout as at
from rsrl.state import COLUMN

HARDEST_FIRST: Final = (3, 2, 1)
"""Box calls in the order in which they replace an illegal one."""


class Strategist(ABC):
    """Calls a batch of races, one decision per lap and race.

    It sees what a pit wall sees: `environment.raw`, `environment.legal` and `environment.record`, never other cars' plans or the future.
    Its random numbers are a pure function of its own seed, the race and the lap, so a race gets the same calls in any batch.
    """

    name: str

    batch_invariant: bool = False
    """Whether races are called one by one, so that calls do not depend on the batch size to the bit and batches need no padding."""

    @abstractmethod
    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        """Start a batch of races that were just reset: race numbers int64 [B] of `seed`. The starting tyre is in `environment.raw`."""

    @abstractmethod
    def decide(self, environment: RaceEnvironment) -> NDArray[np.int8]:
        """Calls for the coming lap, int8 [B]; legal in every race that is still running."""


def column(environment: RaceEnvironment, name: str) -> NDArray[np.float32]:
    """One unscaled feature of every race, float32 [B], in its natural unit."""
    return environment.raw[:, COLUMN[name]]


def coming_lap(environment: RaceEnvironment) -> NDArray[np.int64]:
    """The lap about to start, counted from 1, int64 [B]."""
    return environment.laps - column(environment, "laps_left").astype(np.int64) + 1


def stint_laps(environment: RaceEnvironment) -> NDArray[np.int32]:
    """Laps since the called car's set was fitted, int32 [B]; less than its age where it had run before the race."""
    k = environment.races.k[:, :, environment.car]
    return k[:, at.K_AGE] - k[:, at.K_BEFORE]


def made_legal(calls: NDArray[np.int8], legal: NDArray[np.bool_]) -> NDArray[np.int8]:
    """`calls` int8 [B] where `legal` [B, 4] allows them; otherwise staying out, and where that is illegal too, the hardest set left."""
    answer = calls.copy()
    for fallback in (0, *HARDEST_FIRST):
        bad = ~legal[np.arange(len(answer)), answer]
        if not bad.any():
            return answer
        answer[bad & legal[:, fallback]] = fallback
    return answer
