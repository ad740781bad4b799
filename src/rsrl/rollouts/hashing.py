"""Counter-based random numbers outside the kernels: pure functions of (seed, race, lap, purpose), for arrays of races at once."""

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
    """One uniform number in [0, 1) for each race, float64 [B].

    Args:
        seeds: seeds of the strategist and of the races.
        races: race numbers, int64 [B].
        lap: one lap for all races, or one for each.
        purpose: separates several draws on the same lap.
    """
    x = np.zeros(len(races), np.uint64)
    for word in (*seeds, purpose):
        x = _mix(x * _GOLDEN + np.uint64(word % 2**64) + _GOLDEN)
    x = _mix(x * _GOLDEN + races.astype(np.uint64) + _GOLDEN)
    x = _mix(x * _GOLDEN + np.broadcast_to(np.asarray(lap), len(races)).astype(np.uint64) + _GOLDEN)
    return (x >> _S11).astype(np.float64) * 2.0**-53


def stream_seed(*keys: int) -> int:
    """A 64-bit seed for a stream of random numbers, hashed from integers; each key is taken modulo 2**64."""
    x = np.zeros(1, np.uint64)
    for key in keys:
        x = _mix(x * _GOLDEN + np.uint64(key % 2**64) + _GOLDEN)
    return int(x[0])
