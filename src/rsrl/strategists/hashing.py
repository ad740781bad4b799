"""A strategist's own luck: uniform numbers that are a pure function of (seed, race, lap, purpose), for arrays of races."""

import numpy as np
from numpy.typing import NDArray

_MIX1, _MIX2 = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_S27, _S30, _S31, _S11 = (np.uint64(s) for s in (27, 30, 31, 11))


def _mix(x: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """SplitMix64's finaliser (Steele, Lea and Flood 2014)."""
    x = (x ^ (x >> _S30)) * _MIX1
    x = (x ^ (x >> _S27)) * _MIX2
    return x ^ (x >> _S31)


def uniform(seeds: tuple[int, ...], races: NDArray[np.int64], lap: NDArray[np.int64] | int = 0, purpose: int = 0) -> NDArray[np.float64]:
    """Numbers in [0, 1), one a race. `seeds`: what names the run; `lap` one for all or one a race; `purpose` tells draws of a lap apart."""
    x = np.zeros(len(races), np.uint64)
    for word in (*seeds, purpose):
        x = _mix(x * _GOLDEN + np.uint64(word % 2**64) + _GOLDEN)
    x = _mix(x * _GOLDEN + races.astype(np.uint64) + _GOLDEN)
    x = _mix(x * _GOLDEN + np.broadcast_to(np.asarray(lap), len(races)).astype(np.uint64) + _GOLDEN)
    return (x >> _S11).astype(np.float64) * 2.0**-53


def word_of(*words: int) -> int:
    """A 64-bit number that is a pure function of some whole numbers, each taken modulo 2**64: names a stream of random numbers."""
    x = np.zeros(1, np.uint64)
    for word in words:
        x = _mix(x * _GOLDEN + np.uint64(word % 2**64) + _GOLDEN)
    return int(x[0])
