"""Sampled futures of one race, rolled out side by side, lap by lap, with one car called from outside.

For callers that look at every race between two laps, as the check of a counterfactual does. Where options are compared to the flag,
`batch_kernels` rolls them out faster.
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

Arrays = tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.int32]]


class SampledFutures:
    """Futures of one race; what the pit wall of `car` cannot see is drawn anew in each of them.

    Args:
        figures: of the race.
        state: the race's arrays f [F_ROWS, 20], k [K_ROWS, 20], r [R_SIZE] (`simulator.layout`).
        car: the car called from outside; it does not retire.
        count: number of futures.
        seed: future i is a function of the state, the seed and i.

    Attributes:
        f, k, r: arrays of all futures, [count, ...].
    """

    def __init__(self, figures: Figures, state: Arrays, car: int, count: int, seed: int) -> None:
        self.f, self.k, self.r = (np.repeat(array[None], count, axis=0) for array in state)
        self._figures, self._car = figures, car
        self._actions = np.zeros((count, at.CARS), np.int8)
        draw_futures(figures, figures.rival_plans, belief_of(figures, state[0]), self.f, self.k, self.r, car, np.uint64(seed))

    def __len__(self) -> int:
        return len(self.f)

    def advance(self, calls: NDArray[np.int8] | int) -> None:
        """Run the next lap of every future under the car's calls int8 [count], or one call for all."""
        self._actions[:, self._car] = calls
        advance_batch(self._figures, self._figures.rival_plans, self.f, self.k, self.r, self._actions)


@kernel()
def draw_futures(fig, plans, belief, f, k, r, car, seed):
    """Draw what is hidden in each race of a batch, in place."""
    for i in range(f.shape[0]):
        key0, key1 = rng.race_keys(seed, i)
        draw_future(fig, plans, belief, f[i], k[i], r[i], car, car, key0, key1)
        r[i, at.R_WATCHED] = 1  # a policy goes on reading the pace that lap times show
