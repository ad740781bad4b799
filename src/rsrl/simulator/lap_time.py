"""A car's lap alone on the track, compiled: the reference lap of the race, and pace, tyres and noise relative to it."""

import numpy as np

from rsrl.compiled import kernel
from rsrl.season import GREEN, VSC
from rsrl.simulator import layout as at
from rsrl.simulator import random as rng
from rsrl.simulator.tyres import tyre_loss

ZERO = np.float32(0.0)
HALF = np.float32(0.5)


@kernel(inline=True)
def reference_lap(fig, r, lap):
    """The lap by which the race's clock advances, s: a racing lap with its fuel and track evolution, or a slow one."""
    t = fig.track
    status = r[at.R_STATUS]
    reference = t[at.T_BASE]
    if status == VSC:
        return reference * t[at.T_VSC_FACTOR]
    if status != GREEN:
        return reference * t[at.T_SC_FACTOR]
    to_go = np.float32(fig.whole[at.I_LAPS] - lap)
    # fuel burns evenly: half a lap's worth is still on board in the middle of the last lap
    reference += t[at.T_FUEL] * (to_go + HALF) + t[at.T_EVOLUTION] * to_go / np.float32(fig.whole[at.I_LAPS])
    if lap == 1 or r[at.R_RESTART] == 1:
        reference += t[at.T_START]
    return reference


@kernel(inline=True)
def free_air(fig, f, k, n, lap, key0, key1):
    """F_RAW: each car's lap alone on the track, s, relative to the reference lap. Only the `n` running cars get noise."""
    # Loops over all slots without branches are vectorised by the compiler; retired cars and empty slots cost less than testing for them.
    first = rng.counter(lap, 0, rng.NOISE)
    for car in range(at.CARS):
        k[at.K_BITS, car] = np.int32(rng.bits(key0, key1, np.uint32(first + np.uint32(car) * rng.PER_CAR)))
    for car in range(at.CARS):
        f[at.F_RAW, car] = f[at.F_PACE, car] + tyre_loss(f, car)
        f[at.F_COLD, car] = ZERO
    # The table of normal quantiles is read one car at a time: as a vector "gather" the same loads take several times as long on
    # processors that guard gathers against data leaks (Downfall). Going by place keeps the compiler from vectorising the loop.
    for p in range(n):
        car = np.uint32(k[at.K_ORDER, p])  # unsigned, so that no code is needed for negative indices
        f[at.F_RAW, car] += rng.from_table(np.uint32(k[at.K_BITS, car]), rng.NORMAL) * fig.cars[at.C_NOISE, car]
