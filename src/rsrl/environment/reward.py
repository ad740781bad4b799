"""The paper's reward, case by case and in its order; the first case that holds decides.

Read with these choices where the paper is silent: a terminal state is the one an action leads to; a pit call that
cannot be carried out ends the race as a failure; a car that retires is classified where it stopped and scored for that
place, not punished for a stop it could no longer make.
"""

from typing import Final

import numpy as np

from rsrl.compiled import kernel
from rsrl.season import POINTS

FAILURE: Final = np.float32(-1000.0)
EXTRA_STOP: Final = np.float32(-10.0)
STEP: Final = np.float32(1.0)
PER_POINT: Final = 100.0
FINISH: Final = np.array([0.0, *(PER_POINT * p for p in POINTS), *[0.0] * 10], np.float32)
"""Reward of a finishing position, index 0 unused."""


@kernel(inline="always")
def reward_of(action, available, valid_before, terminal, retired, valid_after, position):
    """Reward of one step. `available`: a set of the compound called is left; `position` 1..20 counts only at the end."""
    if action > 0 and not available:
        return FAILURE
    if terminal and not retired and not valid_after:
        return FAILURE
    if action > 0 and valid_before:
        return EXTRA_STOP
    if terminal:
        return FINISH[position]
    return STEP
