"""Laps that begin from a standing grid, compiled: lap 1, and the restart after a red flag."""

import numpy as np

from rsrl.compiled import kernel
from rsrl.simulator import layout as at
from rsrl.simulator import random as rng
from rsrl.simulator.slow_laps import note_gaps

ZERO = np.float32(0.0)


@kernel()
def start_lap(fig, f, k, r, key0, key1):
    """Lap 1 from the grid; F_RAW holds noise, pace and tyres already, F_TIME the loss by grid place."""
    for p in range(r[at.R_RUNNING]):
        car = k[at.K_ORDER, p]
        # lap 0 in the draw: the lap's own noise has lap 1
        z = rng.from_table(rng.draw(key0, key1, 0, car, rng.NOISE), rng.NORMAL)
        f[at.F_LAP, car] = f[at.F_RAW, car] + f[at.F_TIME, car] + z * fig.track[at.T_START_SD]
        f[at.F_TIME, car] = f[at.F_LAP, car]
        f[at.F_GAP, car] = ZERO


@kernel()
def restart_lap(fig, f, k, r, lap, key0, key1):
    """The lap after a red flag, a standing start in the order of the queue: as lap 1, without the drivers' own start gains."""
    note_gaps(f, k, r[at.R_RUNNING])
    leader_time = f[at.F_TIME, k[at.K_ORDER, 0]]
    for p in range(r[at.R_RUNNING]):
        car = k[at.K_ORDER, p]
        z = rng.from_table(rng.draw(key0, key1, lap, car, rng.RESTART), rng.NORMAL)
        crossing = leader_time + f[at.F_RAW, car] + np.float32(p) * fig.track[at.T_PER_PLACE] + z * fig.track[at.T_START_SD]
        f[at.F_LAP, car] = crossing - f[at.F_TIME, car]
        f[at.F_TIME, car] = crossing
