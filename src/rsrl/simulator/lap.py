"""One lap of the race, compiled. Reads parameters from `fig`, changes only the race's own arrays f, k and r.

A lap, in order: retirements; who stops at its end; every car's time in free air; blue flags; traffic from the front
to the back; the stops; the new order; the track status of the next lap, which the next decisions may know.
Times of cars are relative to the race's reference clock, because float32 holds 5600 s only to half a millisecond.
"""

import numpy as np

from rsrl.compiled import kernel
from rsrl.season import GREEN, RED, SC, VSC
from rsrl.simulator import layout as at
from rsrl.simulator.calls import decide
from rsrl.simulator.pace_watch import note_places, watch_pace
from rsrl.simulator.status import next_status
from rsrl.simulator.stops import take_stops
from rsrl.simulator.traffic import (
    LAPPED_MARGIN_S,
    NEVER,
    ONE,
    ZERO,
    follow_safety_car,
    free_air,
    keep_delta,
    line_up,
    race_traffic,
    restart_lap,
    start_lap,
    wave_blue_flags,
)

OUT = np.float32(1.0e6)  # race time of a car that has retired; later retirements stand ahead of earlier ones
HALF = np.float32(0.5)
THOUSAND = np.float32(1000.0)


@kernel(inline="always")
def retire_cars(k, f, r, lap):
    """Take out the cars whose race ends on this lap and find the next such lap."""
    soonest = at.NO_STOP
    n = r[at.R_RUNNING]
    for p in range(n - 1, -1, -1):
        car = k[at.K_ORDER, p]
        if k[at.K_RETIRE, car] > lap:
            soonest = min(soonest, k[at.K_RETIRE, car])
            continue
        n -= 1
        for q in range(p, n):
            k[at.K_ORDER, q] = k[at.K_ORDER, q + 1]
            k[at.K_PLACE, k[at.K_ORDER, q]] = q
        k[at.K_ORDER, n] = car
        k[at.K_PLACE, car] = n
        f[at.F_TIME, car] = OUT - THOUSAND * np.float32(lap)
    r[at.R_RUNNING] = n
    r[at.R_RETIREMENT] = soonest


@kernel(inline="always")
def sort_order(f, k, n):
    """Insertion sort of the running cars by race time: few change place on a lap. Ties keep the old order."""
    latest = NEVER
    for p in range(n):
        car = k[at.K_ORDER, p]
        time = f[at.F_TIME, np.uint32(car)]
        if time >= latest:
            latest = time
            continue
        q = p
        while q > 0 and f[at.F_TIME, np.uint32(k[at.K_ORDER, q - 1])] > time:
            k[at.K_ORDER, q] = k[at.K_ORDER, q - 1]
            q -= 1
        k[at.K_ORDER, q] = car
    for p in range(n):
        k[at.K_PLACE, np.uint32(k[at.K_ORDER, p])] = p


@kernel(inline="always")
def run_green(fig, f, k, r, lap, key0, key1):
    """Lap times of a racing lap, relative to the reference lap."""
    free_air(fig, f, k, r[at.R_RUNNING], lap, key0, key1)
    n = r[at.R_RUNNING]
    if lap == 1:
        start_lap(fig, f, k, r, key0, key1)
    elif r[at.R_RESTART] == 1:
        restart_lap(fig, f, k, r, lap, key0, key1)
    elif n > 0:
        if f[at.F_TIME, k[at.K_ORDER, n - 1]] - f[at.F_TIME, k[at.K_ORDER, 0]] > fig.track[at.T_BASE] - LAPPED_MARGIN_S:
            wave_blue_flags(fig, f, k, n)
        race_traffic(fig, f, k, r)


@kernel(inline="always")
def run_caution(fig, f, k, r, lap, key0, key1):
    """Lap times of a lap behind a safety car, under a virtual one or a red flag. Lap 1 is a start whatever follows on it."""
    status = r[at.R_STATUS]
    if lap == 1:
        free_air(fig, f, k, r[at.R_RUNNING], lap, key0, key1)
        start_lap(fig, f, k, r, key0, key1)
        sort_order(f, k, r[at.R_RUNNING])
    if status == RED:
        line_up(fig, f, k, r)
    elif lap > 1 and status == SC:
        follow_safety_car(fig, f, k, r)
    elif lap > 1:
        keep_delta(f, k, r)
    r[at.R_SC_LAPS] += np.int32(status == SC)
    r[at.R_VSC_LAPS] += np.int32(status == VSC)
    r[at.R_RED_LAPS] += np.int32(status == RED)


@kernel(inline="always")
def reference_lap(fig, r, lap):
    """The lap by which the race's clock goes on, s: a racing lap with its fuel and the state of the track, or a slow one."""
    t = fig.track
    status = r[at.R_STATUS]
    reference = t[at.T_BASE]
    if status == VSC:
        return reference * t[at.T_VSC_FACTOR]
    if status != GREEN:
        return reference * t[at.T_SC_FACTOR]
    to_go = np.float32(fig.whole[at.I_LAPS] - lap)
    reference += t[at.T_FUEL] * (to_go + HALF) + t[at.T_EVOLUTION] * to_go / np.float32(fig.whole[at.I_LAPS])
    if lap == 1 or r[at.R_RESTART] == 1:
        reference += t[at.T_START]
    return reference


@kernel(inline="always")
def advance(fig, plans, f, k, r, actions):
    """Run one lap. `actions` int8 [20] calls the cars without a plan: 0 stay, 1 + compound to box at its end."""
    if r[at.R_FLAGGED]:
        return
    lap = r[at.R_LAP] + 1
    key0, key1 = np.uint32(r[at.R_KEY0]), np.uint32(r[at.R_KEY1])
    status = r[at.R_STATUS]
    t = fig.track
    if r[at.R_RETIREMENT] <= lap:
        retire_cars(k, f, r, lap)
    boxing = decide(fig, plans, f, k, r, actions, lap, key0, key1) if lap < fig.whole[at.I_LAPS] else 0  # the flag comes first
    for car in range(at.CARS):
        k[at.K_STOPPED, car] = 0
    reference = reference_lap(fig, r, lap)
    ageing = ONE
    if status == GREEN:
        run_green(fig, f, k, r, lap, key0, key1)
    else:
        ageing = t[at.T_WEAR_VSC] if status == VSC else t[at.T_WEAR_SC]
        run_caution(fig, f, k, r, lap, key0, key1)
    for car in range(at.CARS):
        f[at.F_LAP, car] += reference + f[at.F_DUE, car]
        f[at.F_DUE, car] = ZERO
        f[at.F_WEAR, car] += ageing
        k[at.K_AGE, car] += 1
    if boxing > 0:
        take_stops(fig, plans, f, k, r, lap, key0, key1)
    note_places(k)
    sort_order(f, k, r[at.R_RUNNING])
    if r[at.R_WATCHED] == 1 and status == GREEN and lap > 1 and r[at.R_RESTART] == 0:
        watch_pace(fig, f, k, r, reference)
    r[at.R_CLOCK_MS] += np.int32(np.rint(reference * THOUSAND))
    r[at.R_LAP] = lap
    if lap >= fig.whole[at.I_LAPS]:
        r[at.R_FLAGGED] = 1
    else:
        next_status(fig, r, lap, key0, key1)


@kernel()
def advance_lap(fig, plans, f, k, r, actions):
    """`advance`, compiled once for all callers that step lap by lap; whole races inline it, which is a third quicker."""
    advance(fig, plans, f, k, r, actions)
