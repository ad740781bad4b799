"""Futures of a race side by side, which advance lap by lap under calls from outside."""

import numpy as np
from numpy.typing import NDArray

from rsrl.compiled import kernel
from rsrl.rollouts.futures import draw_future
from rsrl.simulator import Figures
from rsrl.simulator import layout as at
from rsrl.simulator import random as rng
from rsrl.simulator.race import advance_batch
from rsrl.simulator.race_arrays import RaceArrays


class FutureBatch:
    """n futures of one race and car. The car is sure to reach the flag; lap times are followed, so that features stay what they are.

    Attributes:
        races: their arrays, changed in place.

    Args:
        races: n states of the race; future i of `seed` is drawn in state i.
        belief: float32 [B_ROWS, 20], what is thought of the cars (`belief_of`).
        seed: non-negative.
    """

    def __init__(self, figures: Figures, car: int, races: RaceArrays, belief: NDArray[np.float32], seed: int) -> None:
        self.races, self._figures, self._car = races, figures, car
        self._actions = np.zeros((len(races.r), at.CARS), np.int8)
        _draw_futures(figures, figures.rival_plans, belief, races, car, np.uint64(seed))

    def advance(self, calls: NDArray[np.int8] | int) -> None:
        """Drive one lap of every future; `calls` int8 [n], 0 stay out, 1 + compound to box at its end."""
        self._actions[:, self._car] = calls
        advance_batch(self._figures, self._figures.rival_plans, *self.races, self._actions)


@kernel()
def _draw_futures(fig, plans, belief, races, car, seed):
    for i in range(races.f.shape[0]):
        key0, key1 = rng.race_keys(seed, i)
        draw_future(fig, plans, belief, races.f[i], races.k[i], races.r[i], car, car, key0, key1)
