"""The paper's reward, case by case and in its order; the first case that holds decides.

Where the paper leaves it open: a terminal state is the one that an action leads to; a pit call that cannot be carried out
ends the race as a failure; a car that retires is scored for the place where it stopped, not punished for a stop that it
could no longer make.
"""

from typing import Final

import numpy as np

from rsrl.compiled import kernel
from rsrl.season import MAX_CARS, POINTS

FAILURE: Final = np.float32(-1000.0)  # tyre rules not met at the flag, or a call that cannot be carried out
EXTRA_STOP: Final = np.float32(-10.0)  # a stop that the tyre rules no longer ask for
STEP: Final = np.float32(1.0)  # any other lap
PER_POINT: Final = 100.0  # at the flag, times the points of the position
FINISH: Final = np.array([0.0, *(PER_POINT * p for p in POINTS), *[0.0] * (MAX_CARS - len(POINTS))], np.float32)
"""Reward of a finishing position, index 0 unused."""


@kernel(inline=True)
def reward_of(action, available, valid_before, terminal, retired, valid_after, position):
    """Reward of one step.

    Args:
        action: 0 to stay out, 1 + compound to box.
        available: whether a set of the compound called is left.
        valid_before, valid_after: whether the tyre rules (two compounds, sets to be used) had been met before the step, and after it.
        terminal: whether the race is over for the car: flag, retirement or failed call.
        retired: whether the car has retired.
        position: 1 for the winner, read only at the end.
    """
    if action > 0 and not available:
        return FAILURE
    if terminal and not retired and not valid_after:
        return FAILURE
    if action > 0 and valid_before:
        return EXTRA_STOP
    if terminal:
        return FINISH[position]
    return STEP
