"""Futures of one race side by side, rolled out lap by lap under calls from outside.

For callers that look at every race between two laps, as the check of a counterfactual does. Where options are compared to the flag,
`OptionRollouts` is faster.
"""

import numpy as np
from numpy.typing import NDArray

from rsrl.compiled import kernel
from rsrl.rollouts.belief import belief_of
from rsrl.rollouts.futures import draw_future
from rsrl.simulator import Figures
from rsrl.simulator import layout as at
from rsrl.simulator import random as rng
from rsrl.simulator.race import advance_batch
from rsrl.simulator.race_arrays import RaceArrays, empty_races


class FutureBatch:
    """Futures of one race; what the pit wall of `car` cannot see is drawn anew in each of them.

    Args:
        state: arrays of the race, not changed.
        car: the car called from outside; it does not retire.
        count: number of futures.
        seed: non-negative; future i is a function of the state, the seed and i.

    Attributes:
        races: arrays of all futures, [count, ...].
    """

    def __init__(self, figures: Figures, car: int, state: RaceArrays, count: int, seed: int) -> None:
        self.races = empty_races(count)
        for array, one in zip(self.races, state, strict=True):
            array[:] = one
        self._figures, self._car = figures, car
        self._actions = np.zeros((count, at.CARS), np.int8)
        _draw_futures(figures, figures.rival_plans, belief_of(figures, state.f), self.races, car, np.uint64(seed))

    def __len__(self) -> int:
        return len(self.races.r)

    def advance(self, calls: NDArray[np.int8] | int) -> None:
        """Drive one lap of every future; `calls` int8 [n], 0 stay out, 1 + compound to box at its end."""
        self._actions[:, self._car] = calls
        advance_batch(self._figures, self._figures.rival_plans, *self.races, self._actions)


@kernel()
def _draw_futures(fig, plans, belief, races, car, seed):
    for i in range(races.f.shape[0]):
        key0, key1 = rng.race_keys(seed, i)
        draw_future(fig, plans, belief, races.f[i], races.k[i], races.r[i], car, car, key0, key1)
