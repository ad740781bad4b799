"""One lap of the race, compiled. Reads parameters from `fig`, changes only the race's own arrays f, k and r.

A lap, in order: retirements (here); who stops at its end (calls.py, rivals.py); every car's lap in free air (lap_time.py, tyres.py);
blue flags and traffic from the front to the back (traffic.py), or a start (starts.py) or a slow lap (slow_laps.py) instead; the stops
(stops.py); the new order (here); what the lap shows of each car's pace (pace_posterior.py); the track status of the next lap
(status.py), which the next decisions may know.

Times of cars are relative to the race's reference clock, because float32 holds 5600 s only to half a millisecond.
"""

import numpy as np

from rsrl.compiled import kernel
from rsrl.season import GREEN, RED, SC, VSC
from rsrl.simulator import layout as at
from rsrl.simulator.calls import decide
from rsrl.simulator.lap_time import free_air, reference_lap
from rsrl.simulator.pace_posterior import note_places, observe_lap
from rsrl.simulator.slow_laps import follow_safety_car, keep_delta, line_up
from rsrl.simulator.starts import restart_lap, start_lap
from rsrl.simulator.status import next_status
from rsrl.simulator.stops import take_stops
from rsrl.simulator.traffic import LAPPED_MARGIN_S, race_traffic, wave_blue_flags
from rsrl.simulator.tyres import wear_tyre

OUT = np.float32(1.0e6)  # race time of a car that has retired; later retirements stand ahead of earlier ones
NEVER = np.float32(-1.0e9)
ZERO, ONE = np.float32(0.0), np.float32(1.0)
THOUSAND = np.float32(1000.0)


@kernel()
def retire_cars(k, f, r, lap):
    """Take out the cars whose race ends on this lap and find the next such lap."""
    soonest = at.NO_STOP
    n = r[at.R_RUNNING]
    # from the back, so that cars moved forward by a retirement have been looked at already
    for p in range(n - 1, -1, -1):
        car = k[at.K_ORDER, p]
        if k[at.K_RETIRE, car] > lap:
            soonest = min(soonest, k[at.K_RETIRE, car])
            continue
        n -= 1
        # to the end of the running cars: K_ORDER stays a permutation, retired cars in reverse order of their retirement
        for q in range(p, n):
            k[at.K_ORDER, q] = k[at.K_ORDER, q + 1]
            k[at.K_PLACE, k[at.K_ORDER, q]] = q
        k[at.K_ORDER, n] = car
        k[at.K_PLACE, car] = n
        f[at.F_TIME, car] = OUT - THOUSAND * np.float32(lap)
    r[at.R_OUT] = r[at.R_RUNNING] - n
    r[at.R_RUNNING] = n
    r[at.R_RETIREMENT] = soonest


@kernel(inline=True)
def sort_order(f, k, n):
    """Sort the running cars by race time. Ties keep the old order."""
    # insertion sort: few cars change place on a lap, so it is close to one pass without moves
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


@kernel(inline=True)
def run_green(fig, f, k, r, lap, key0, key1):
    """Lap times of a racing lap, s, relative to the reference lap."""
    free_air(fig, f, k, r[at.R_RUNNING], lap, key0, key1)
    n = r[at.R_RUNNING]
    if lap == 1:
        start_lap(fig, f, k, r, key0, key1)
    elif r[at.R_RESTART] == 1:
        restart_lap(fig, f, k, r, lap, key0, key1)
    elif n > 0:
        # most laps: the last car is not about to be lapped, and the loop over pairs of cars is skipped
        if f[at.F_TIME, k[at.K_ORDER, n - 1]] - f[at.F_TIME, k[at.K_ORDER, 0]] > fig.track[at.T_BASE] - LAPPED_MARGIN_S:
            wave_blue_flags(fig, f, k, n)
        race_traffic(fig, f, k, r)


@kernel()
def run_caution(fig, f, k, r, lap, key0, key1):
    """Lap times of a lap behind a safety car, under a virtual one or under a red flag. Lap 1 is a start whatever happens on it."""
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


@kernel(inline=True)
def advance(fig, plans, f, k, r, actions):
    """Run one lap. `actions` int8 [CARS] calls the cars without a plan: 0 to stay out, 1 + compound to box at its end."""
    if r[at.R_FLAGGED]:
        return
    lap = r[at.R_LAP] + 1
    key0, key1 = np.uint32(r[at.R_KEY0]), np.uint32(r[at.R_KEY1])
    status = r[at.R_STATUS]
    t = fig.track
    # laps of retirements are drawn at the start, so most laps know at once that nobody stops
    if r[at.R_RETIREMENT] <= lap:
        retire_cars(k, f, r, lap)
    # a stop happens at the end of a lap, and at the end of the last one comes the flag
    boxing = decide(fig, plans, f, k, r, actions, lap, key0, key1) if lap < fig.whole[at.I_LAPS] else 0
    for car in range(at.CARS):
        k[at.K_STOPPED, car] = 0
    reference = reference_lap(fig, r, lap)
    wear = ONE
    if status == GREEN:
        run_green(fig, f, k, r, lap, key0, key1)
    else:
        wear = t[at.T_WEAR_VSC] if status == VSC else t[at.T_WEAR_SC]
        run_caution(fig, f, k, r, lap, key0, key1)
    for car in range(at.CARS):
        f[at.F_LAP, car] += reference + f[at.F_DUE, car]
        f[at.F_DUE, car] = ZERO
        wear_tyre(f, k, car, wear)
    if boxing > 0:
        take_stops(fig, plans, f, k, r, lap, key0, key1)
    note_places(k)
    sort_order(f, k, r[at.R_RUNNING])
    # only whoever calls a car from outside sees the posterior: races on plans alone save the work
    if r[at.R_WATCHED] == 1 and status == GREEN and lap > 1 and r[at.R_RESTART] == 0:
        observe_lap(fig, f, k, r, reference)
    # lap times show the exact reference, the clock whole milliseconds: times of cars are relative to it, so gaps are exact
    r[at.R_CLOCK_MS] += np.int32(np.rint(reference * THOUSAND))
    r[at.R_LAP] = lap
    if lap >= fig.whole[at.I_LAPS]:
        r[at.R_FLAGGED] = 1
    else:
        next_status(fig, r, lap, key0, key1)


@kernel()
def advance_lap(fig, plans, f, k, r, actions):
    """`advance`, compiled once for all callers that step lap by lap; loops over whole races inline it, which is a tenth faster."""
    advance(fig, plans, f, k, r, actions)
