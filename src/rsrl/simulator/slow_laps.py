"""Laps on which nobody races, compiled: behind the safety car, under a virtual one, under a red flag."""

import numpy as np

from rsrl.compiled import kernel
from rsrl.simulator import layout as at

NEVER = np.float32(-1.0e9)
ZERO = np.float32(0.0)


@kernel(inline=True)
def note_gaps(f, k, n):
    """F_GAP of the `n` running cars from the times at which they begin the lap; the leader's is out of reach."""
    ahead = NEVER
    for p in range(n):
        car = k[at.K_ORDER, p]
        f[at.F_GAP, car] = f[at.F_TIME, car] - ahead
        ahead = f[at.F_TIME, car]


@kernel(inline=True)
def follow_safety_car(fig, f, k, r):
    """A lap behind the safety car: the queue closes up, nobody passes, lapped cars unlap themselves before it goes in."""
    t = fig.track
    note_gaps(f, k, r[at.R_RUNNING])
    # The leader drives the reference lap, which is as slow as the safety car; the others catch up at their own, quicker pace until
    # they meet the queue. So a large gap takes several laps to close, as in real races.
    catch = (t[at.T_SC_CATCH] - t[at.T_SC_FACTOR]) * t[at.T_BASE]
    leader_time = f[at.F_TIME, k[at.K_ORDER, 0]]
    # on the last lap of a safety car that has been out for more than one: lapped cars are let past
    unlap = r[at.R_LEFT] == 1 and r[at.R_SINCE] > 0
    latest = leader_time
    for p in range(r[at.R_RUNNING]):
        car = k[at.K_ORDER, p]
        start = f[at.F_TIME, car]
        if unlap:
            start -= t[at.T_BASE] * np.floor((start - leader_time) / t[at.T_BASE])
        if p == 0:
            crossing = start
        else:
            crossing = max(start + catch, latest + t[at.T_SC_GAP])
        f[at.F_LAP, car] = crossing - start
        f[at.F_TIME, car] = crossing
        f[at.F_COLD, car] = ZERO
        latest = crossing


@kernel(inline=True)
def keep_delta(f, k, r):
    """A lap under a virtual safety car: everyone drives to the same delta time and keeps the gap."""
    note_gaps(f, k, r[at.R_RUNNING])
    for p in range(r[at.R_RUNNING]):
        car = k[at.K_ORDER, p]
        f[at.F_LAP, car] = ZERO
        f[at.F_COLD, car] = ZERO


@kernel(inline=True)
def line_up(fig, f, k, r):
    """A lap under a red flag: the field stands in the pit lane in order, and lapped cars have their laps back."""
    note_gaps(f, k, r[at.R_RUNNING])
    # all gaps are lost, as in a real stoppage: only the order and the tyres carry over to the restart
    leader_time = f[at.F_TIME, k[at.K_ORDER, 0]]
    for p in range(r[at.R_RUNNING]):
        car = k[at.K_ORDER, p]
        f[at.F_TIME, car] = leader_time + fig.track[at.T_SC_GAP] * np.float32(p)
        f[at.F_LAP, car] = ZERO
        f[at.F_COLD, car] = ZERO
