"""Track status of the next lap, compiled: drawn, or read from a script; and for how long DRS stays off after it."""

import numpy as np

from rsrl.compiled import kernel
from rsrl.season import GREEN, RED, SC, VSC
from rsrl.simulator import layout as at
from rsrl.simulator import random as rng


@kernel(inline=True)
def read_script(fig, r, lap):
    """Track status of `lap` as in the script, and how long it lasts."""
    status = np.int32(fig.script_status[lap])
    if lap == 1 or status != r[at.R_STATUS]:
        r[at.R_SINCE] = 0
        # a script knows when the status ends, which lapped cars need to know to unlap themselves on its last lap
        last = lap
        while last < fig.whole[at.I_LAPS] and fig.script_status[last + 1] == status:
            last += 1
        r[at.R_LEFT] = last + 1 - lap if status != GREEN else 0
    r[at.R_STATUS] = status


@kernel(inline=True)
def kind_drawn(u, sc, vsc):
    """SC, VSC or GREEN: one draw for both kinds, the safety car at its low end, so that at most one of them follows."""
    return SC if u < sc else (VSC if u < sc + vsc else GREEN)


@kernel()
def caused(fig, r, lap, key0, key1):
    """What the cars that retired on this lap bring out: SC, VSC, or GREEN for nothing."""
    t = fig.track
    sc = t[at.T_SC_BY_OUT_LAP1] if lap == 1 else t[at.T_SC_BY_OUT]
    vsc = np.float32(0.0) if lap == 1 else t[at.T_VSC_BY_OUT]
    # each of them brings out a safety car, else a virtual one, else nothing; the gravest counts
    one = np.float32(1.0)
    no_sc, nothing = one, one
    for _ in range(r[at.R_OUT]):
        no_sc *= one - sc
        nothing *= one - sc - vsc
    return kind_drawn(rng.unit(rng.draw(key0, key1, lap, 0, rng.CAUSED)), one - no_sc, no_sc - nothing)


@kernel(inline=True)
def draw_incident(fig, r, lap, key0, key1):
    """Draw what follows a racing lap: mostly another one, else a virtual safety car or a safety car, which may become a red flag.

    It comes with a car that retired on this lap, or without one. Either shows in the coming lap's status and no earlier.
    """
    t = fig.track
    kind = caused(fig, r, lap, key0, key1) if r[at.R_OUT] > 0 else GREEN
    if kind == GREEN:
        u = rng.unit(rng.draw(key0, key1, lap, 0, rng.INCIDENT))
        kind = kind_drawn(u, t[at.T_SC_LAP1_ALONE] if lap == 1 else t[at.T_SC_ALONE], t[at.T_VSC_ALONE])
    if kind == GREEN:
        return
    # the number of laps at whose cumulative share the draw falls
    length = rng.unit(rng.draw(key0, key1, lap, 0, rng.DURATION))
    shares = fig.sc_laps if kind == SC else fig.vsc_laps
    n = 1
    while n < shares.shape[0] and length > shares[n - 1]:
        n += 1
    r[at.R_STATUS] = kind
    if kind == SC and rng.unit(rng.draw(key0, key1, lap, 0, rng.RED)) < t[at.T_RED]:
        r[at.R_STATUS] = RED
        n = 1  # the stoppage takes no laps: one stands for the laps driven to the pit lane
    r[at.R_LEFT] = n
    r[at.R_SINCE] = 0


@kernel(inline=True)
def next_status(fig, r, lap, key0, key1):
    """Track status of the lap after `lap`, and the laps for which DRS stays off.

    DRS is off for the first `drs_off_laps` laps of the race, and as long after a safety car or a standing restart; a virtual safety car
    gives it back at once. Two laps until 2023, one from 2024 (FIA Formula One Sporting Regulations, article on driver adjustable
    bodywork), so it is a figure of the season file.
    """
    before = r[at.R_STATUS]
    r[at.R_SINCE] += 1
    r[at.R_NO_DRS] = max(r[at.R_NO_DRS] - 1, 0)
    r[at.R_LEFT] = max(r[at.R_LEFT] - 1, 0)
    # drawn from (seed, race, lap) alone: two strategies are compared on the same safety cars
    if fig.script_status.shape[0] > 0:
        read_script(fig, r, lap + 1)
    elif before == GREEN:
        draw_incident(fig, r, lap, key0, key1)
    elif r[at.R_LEFT] == 0:
        r[at.R_STATUS] = GREEN
        r[at.R_SINCE] = 0
    r[at.R_OUT] = 0
    now = r[at.R_STATUS]
    if now == GREEN and before >= SC:
        r[at.R_NO_DRS] = fig.whole[at.I_DRS_OFF_LAPS]
    r[at.R_RESTART] = np.int32(now == GREEN and before == RED)
