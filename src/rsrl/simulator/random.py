"""Counter-based random numbers: every draw is a pure function of (seed, race, lap, car, purpose).

Two rounds of a 32-bit finaliser (constants: Wellons, "Prospecting for hash functions", lowbias32) over a counter
and the race's two 32-bit keys. There is no state: any draw can be made alone, in any order, on any thread. So two strategies can be
compared on the same race (common random numbers): a stop more or less does not shift the draws of any other car or lap.
"""

from typing import Final

import numpy as np
from scipy.special import ndtri

from rsrl.compiled import kernel

# purposes of draws; part of a race's identity, so append only
NOISE, PASS, STOP, REACT, FORM, RETIRE, PLAN, INCIDENT, DURATION, JITTER, STINT, RED, RESTART, BOX, CHOOSE, CAUSED = range(16)
PER_CAR = np.uint32(16)  # purposes per car in the counter
# stands for the car in the one draw that the whole field shares (lap 0, BOX); the car of this index has no such draw of its own
FIELD: Final = 20

# every constant is uint32: one int64 operand would turn the arithmetic into int64, with other bits and half the vector width
_M1, _M2, _GOLDEN = np.uint32(0x7FEB352D), np.uint32(0x846CA68B), np.uint32(0x9E3779B9)
_S15, _S16, _S9, _S22, _S6 = (np.uint32(s) for s in (15, 16, 9, 22, 6))
_LOW16 = np.uint32(0xFFFF)
_TO_UNIT = np.float32(2.0**-23)
_HALF = np.float32(0.5)
_TO_FRACTION = np.float32(2.0**-16)
_CELLS: Final = 1024


def _normal_table() -> np.ndarray:
    """Quantiles of the standard normal at 1,025 points, ends finite, scaled to unit variance under interpolation."""
    u = np.arange(_CELLS + 1) / _CELLS
    u[0], u[-1] = 0.15 / _CELLS, 1 - 0.15 / _CELLS
    z = ndtri(u)
    a, b = z[:-1], z[1:]
    variance = np.mean((a * a + a * b + b * b) / 3)
    return (z / np.sqrt(variance)).astype(np.float32)


def _logistic_table() -> np.ndarray:
    """Quantiles of the standard logistic at 1,025 points, ends finite."""
    u = np.arange(_CELLS + 1) / _CELLS
    u[0], u[-1] = 0.3 / _CELLS, 1 - 0.3 / _CELLS
    return np.log(u / (1 - u)).astype(np.float32)


NORMAL = _normal_table()
LOGISTIC = _logistic_table()


@kernel(inline=True)
def mix(x):
    """Finaliser: uint32 to uint32, every input bit reaches every output bit."""
    x = np.uint32(x ^ np.uint32(x >> _S16))
    x = np.uint32(x * _M1)
    x = np.uint32(x ^ np.uint32(x >> _S15))
    x = np.uint32(x * _M2)
    return np.uint32(x ^ np.uint32(x >> _S16))


@kernel(inline=True)
def counter(lap, car, purpose):
    """The number of a draw within its race: 32 cars a lap, 16 purposes a car."""
    return np.uint32(np.uint32(np.uint32(lap) * np.uint32(32) + np.uint32(car)) * PER_CAR + np.uint32(purpose))


@kernel(inline=True)
def bits(key0, key1, number):
    """32 random bits for the keys of a race and the number of a draw."""
    # neighbouring numbers are spread by the golden ratio before the first round (Weyl sequence); the second key enters between rounds,
    # so that two races whose first keys are close do not share shifted streams
    x = mix(np.uint32(np.uint32(number * _GOLDEN) + key0))
    return mix(np.uint32(x ^ key1))


@kernel(inline=True)
def draw(key0, key1, lap, car, purpose):
    """32 random bits for (race keys, lap, car, purpose)."""
    return bits(key0, key1, counter(lap, car, purpose))


@kernel(inline=True)
def unit(word):
    """Uniform float32 strictly between 0 and 1."""
    # 23 bits: with 24, float32 would round the half away, and the largest word up to 1 itself
    return (np.float32(np.uint32(word >> _S9)) + _HALF) * _TO_UNIT


@kernel(inline=True)
def from_table(word, table):
    """A draw from the distribution whose 1,025 quantiles are in `table`, linear between them."""
    # the upper 10 bits choose the cell, the next 16 the place within it
    i = np.int32(np.uint32(word >> _S22))
    fraction = np.float32(np.int32(np.uint32(np.uint32(word >> _S6) & _LOW16))) * _TO_FRACTION
    low = table[i]
    return low + fraction * (table[i + 1] - low)


@kernel(inline=True)
def other_end(word):
    """The same bits with their halves swapped, for a second draw: its cell comes from bits that only refine the first draw."""
    return np.uint32(np.uint32(word << _S16) | np.uint32(word >> _S16))


@kernel()
def race_keys(seed, race):
    """Two 32-bit keys of a race from seed and race number (SplitMix64, Steele et al. 2014)."""
    z = np.uint64(seed) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(race) * np.uint64(0xD1B54A32D192ED03) + np.uint64(0x632BE59BD9B4E019)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return np.uint32(z & np.uint64(0xFFFFFFFF)), np.uint32(z >> np.uint64(32))
