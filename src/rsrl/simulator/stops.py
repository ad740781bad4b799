"""Pit stops, compiled: time lost, waiting behind the team's other car, and the new tyres."""

import numpy as np

from rsrl.compiled import kernel
from rsrl.season import RED
from rsrl.simulator import layout as at
from rsrl.simulator import random as rng
from rsrl.simulator.calls import load_next_stop
from rsrl.simulator.pace_posterior import start_new_set
from rsrl.simulator.tyres import fit_tyre

ZERO = np.float32(0.0)


@kernel(inline=True)
def stop_excess(fig, car, lap, key0, key1):
    """Stop time of a car beyond the quickest, s."""
    # the law is drawn for an average team; the team's factor stretches it
    return rng.from_table(rng.draw(key0, key1, lap, car, rng.STOP), fig.tail) * fig.cars[at.C_TAIL, car]


@kernel(inline=True)
def list_stops(k, n):
    """K_BOX: the running cars that box at the end of this lap; returns how many."""
    # every car is written and the end of the list moved on only for those that box: no branch for the processor to mispredict
    boxing = np.int32(0)
    for p in range(n):
        car = k[at.K_ORDER, p]
        k[at.K_BOX, boxing] = car
        boxing += np.int32(k[at.K_WANT, car] >= 0)
    return boxing


@kernel(inline=True)
def wait_for_mates(fig, f, k, boxing, n, lap, key0, key1):
    """F_RAW of a car that boxes: how long it waits behind its team's other car, s, if that came in shortly before on the same lap."""
    for i in range(boxing):
        car = k[at.K_BOX, i]
        mate = fig.mates[car]
        f[at.F_RAW, car] = ZERO
        if mate < 0 or k[at.K_WANT, mate] < 0 or k[at.K_PLACE, mate] >= n:
            continue
        gap = f[at.F_TIME, car] - f[at.F_TIME, mate]
        # the crew is free again after its own time for the first car and that stop's excess, less what the second car arrives later
        if gap > ZERO or (gap == ZERO and k[at.K_PLACE, mate] < k[at.K_PLACE, car]):
            f[at.F_RAW, car] = max(fig.track[at.T_STACK] + stop_excess(fig, mate, lap, key0, key1) - gap, ZERO)


@kernel(inline=True)
def take_stops(fig, plans, f, k, r, lap, key0, key1):
    """Pit-lane loss, stop time, wait and new tyres for the cars that box at the end of this lap. Under a red flag a stop costs nothing."""
    # The whole loss counts in the race time at once, so that the car meets the traffic it rejoins in; lap times show it over the in-lap
    # and the out-lap (F_DUE), as real ones do, since the pit lane lies on both sides of the line.
    status = r[at.R_STATUS]
    boxing = list_stops(k, r[at.R_RUNNING])
    if status != RED:
        wait_for_mates(fig, f, k, boxing, r[at.R_RUNNING], lap, key0, key1)
    for i in range(boxing):
        car = k[at.K_BOX, i]
        want = k[at.K_WANT, car]
        if status != RED:
            loss = fig.track[at.T_PIT + status] + fig.cars[at.C_STOP, car] + stop_excess(fig, car, lap, key0, key1) + f[at.F_RAW, car]
            shown = loss * fig.track[at.T_IN_SHARE]
            f[at.F_TIME, car] += loss
            f[at.F_LAP, car] += shown
            f[at.F_DUE, car] = loss - shown
        k[at.K_STOPS, car] += 1
        k[at.K_STOPPED, car] = 1
        if r[at.R_WATCHED] == 1:
            start_new_set(fig, f, car)
        fit_tyre(fig, f, k, car, want, key0, key1)
        f[at.F_COLD, car] = fig.tyres[want, at.Y_COLD]
        if k[at.K_PLAN, car] >= 0:
            k[at.K_POINTER, car] += 1
            load_next_stop(fig, plans, k, car, lap, key0, key1)
