"""The changing state of a race as one value that kernels take: the arrays whose rows `layout` lists."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.simulator import layout as at


class RaceArrays(NamedTuple):
    """State of one race, or of n races side by side.

    Attributes:
        f: float32 [F_ROWS, CARS] or [n, F_ROWS, CARS].
        k: int32 [K_ROWS, CARS] or [n, K_ROWS, CARS].
        r: int32 [R_SIZE] or [n, R_SIZE].
    """

    f: NDArray[np.float32]
    k: NDArray[np.int32]
    r: NDArray[np.int32]


def empty_race() -> RaceArrays:
    """Arrays of one race, not filled."""
    return RaceArrays(np.empty((at.F_ROWS, at.CARS), np.float32), np.empty((at.K_ROWS, at.CARS), np.int32), np.empty(at.R_SIZE, np.int32))


def empty_races(n: int) -> RaceArrays:
    """Arrays of n races side by side, not filled."""
    return RaceArrays(
        np.empty((n, at.F_ROWS, at.CARS), np.float32), np.empty((n, at.K_ROWS, at.CARS), np.int32), np.empty((n, at.R_SIZE), np.int32)
    )
