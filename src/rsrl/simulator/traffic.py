"""Lap times: alone on the track, past lapped cars, in traffic, behind the safety car, under the virtual one."""

import numpy as np

from rsrl.compiled import kernel
from rsrl.simulator import layout as at
from rsrl.simulator import random as rng

NEVER = np.float32(-1.0e9)
FAR = np.float32(1.0e9)
ZERO = np.float32(0.0)
ONE = np.float32(1.0)
LAPPED_MARGIN_S = np.float32(5.0)  # a car this close to being lapped may be lapped on the coming lap
LAPS_WITHOUT_DRS = 2  # sporting regulations 2022-23: after the start and after a safety car; a virtual one gives it back at once


@kernel(inline="always")
def free_air(fig, f, k, n, lap, key0, key1):
    """F_RAW: each car's lap alone on the track, relative to the reference lap.

    The first two loops are vectorised. The third goes by place so that it is not: a vector's gather from a table costs several times
    what the loads do one by one, on processors that guard it against leaks.
    """
    first = rng.counter(lap, 0, rng.NOISE)
    for car in range(at.CARS):
        k[at.K_BITS, car] = np.int32(rng.bits(key0, key1, np.uint32(first + np.uint32(car) * rng.PER_CAR)))
    for car in range(at.CARS):
        wear = f[at.F_WEAR, car]
        tyre = f[at.F_OFFSET, car] + f[at.F_COLD, car] + wear * (f[at.F_LINEAR, car] + wear * f[at.F_QUADRATIC, car])
        f[at.F_RAW, car] = f[at.F_PACE, car] + tyre
        f[at.F_COLD, car] = ZERO
    for p in range(n):
        car = np.uint32(k[at.K_ORDER, p])
        f[at.F_RAW, car] += rng.from_table(np.uint32(k[at.K_BITS, car]), rng.NORMAL) * fig.cars[at.C_NOISE, car]


@kernel(inline="always")
def wave_blue_flags(fig, f, k, n):
    """Lapped cars and those that lap them lose time on the laps where it happens."""
    base = fig.track[at.T_BASE]
    per_base = ONE / base
    blue, lapping = fig.track[at.T_BLUE], fig.track[at.T_LAPPING]
    lap_down = f[at.F_TIME, k[at.K_ORDER, 0]] + base - LAPPED_MARGIN_S
    for p in range(n - 1, 0, -1):
        lapped = k[at.K_ORDER, p]
        time = f[at.F_TIME, lapped]
        if time < lap_down:
            return
        raw = f[at.F_RAW, lapped]
        times = 0
        for car in range(at.CARS):  # all cars and no branch, so that it is vectorised; those behind have before < 0
            before = (time - f[at.F_TIME, car]) * per_base
            after = before + (raw - f[at.F_RAW, car]) * per_base
            laps_it = (before > ZERO) & (after >= np.floor(before) + ONE)
            times += np.int32(laps_it)
            f[at.F_RAW, car] += lapping if laps_it else ZERO
        f[at.F_RAW, lapped] += blue * np.float32(times)


@kernel(inline="always")
def race_traffic(fig, f, k, r):
    """Cross the line from the front: a car that reaches the one ahead passes it or is held behind it.

    The sweep has no branches: who is held up is what a processor cannot predict. What a car needs to pass is drawn from the bits that
    drew its noise, read from the other end.
    """
    t = fig.track
    # copies, since the compiler cannot know that the stores below leave the figures alone
    dirty, dirty_window, drs, follow = t[at.T_DIRTY], t[at.T_DIRTY_WINDOW], t[at.T_DRS], t[at.T_FOLLOW]
    threshold, scale, pass_loss, passed_loss = t[at.T_PASS], t[at.T_PASS_SCALE], t[at.T_PASS_LOSS], t[at.T_PASSED_LOSS]
    dirty_slope = dirty / dirty_window
    drs_window = t[at.T_DRS_WINDOW]
    if r[at.R_NO_DRS] > 0:
        drs_window = NEVER
    latest = NEVER  # the latest crossing so far
    ahead = np.uint32(k[at.K_ORDER, 0])
    ahead_start, ahead_crossing = NEVER, ZERO
    ahead_raw = ZERO
    for p in range(r[at.R_RUNNING]):
        car = np.uint32(k[at.K_ORDER, p])
        start = f[at.F_TIME, car]
        gap = start - ahead_start
        raw = f[at.F_RAW, car] + max(dirty - gap * dirty_slope, ZERO)
        raw -= drs if gap < drs_window else ZERO
        needed = threshold + scale * rng.from_table(rng.other_end(np.uint32(k[at.K_BITS, car])), rng.LOGISTIC)
        free = start + raw
        past = free + pass_loss
        tries = free if ahead_raw - raw > needed else FAR
        held = latest + follow
        passes = tries < held  # the one comparison that waits for the car before
        queued = max(free, held)
        crossing = past if passes else queued
        latest = max(latest, past) if passes else queued
        f[at.F_GAP, car] = gap
        settled = ahead_crossing + (passed_loss if passes else ZERO)
        f[at.F_LAP, ahead] = settled - ahead_start  # of the first car's first turn nothing is left
        f[at.F_TIME, ahead] = settled if p > 0 else start
        ahead = car
        ahead_start = start
        ahead_raw = raw
        ahead_crossing = crossing
    f[at.F_LAP, ahead] = ahead_crossing - ahead_start
    f[at.F_TIME, ahead] = ahead_crossing


@kernel(inline="always")
def follow_safety_car(fig, f, k, r):
    """A lap behind the safety car: the queue closes up, nobody passes, lapped cars get their lap back before it goes in."""
    t = fig.track
    catch = (t[at.T_SC_CATCH] - t[at.T_SC_FACTOR]) * t[at.T_BASE]
    leader_time = f[at.F_TIME, k[at.K_ORDER, 0]]
    unlap = r[at.R_LEFT] == 1 and r[at.R_SINCE] > 0
    latest = leader_time
    ahead = NEVER
    for p in range(r[at.R_RUNNING]):
        car = k[at.K_ORDER, p]
        start = f[at.F_TIME, car]
        f[at.F_GAP, car] = start - ahead
        ahead = start
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


@kernel(inline="always")
def keep_delta(f, k, r):
    """A lap of virtual safety car: everyone keeps the gap."""
    ahead = NEVER
    for p in range(r[at.R_RUNNING]):
        car = k[at.K_ORDER, p]
        f[at.F_GAP, car] = f[at.F_TIME, car] - ahead
        ahead = f[at.F_TIME, car]
        f[at.F_LAP, car] = ZERO
        f[at.F_COLD, car] = ZERO


@kernel(inline="always")
def start_lap(fig, f, k, r, key0, key1):
    """Lap 1: standing start from the grid; `F_RAW` holds noise, pace and tyre already, F_TIME the grid's loss."""
    for p in range(r[at.R_RUNNING]):
        car = k[at.K_ORDER, p]
        z = rng.from_table(rng.draw(key0, key1, 0, car, rng.NOISE), rng.NORMAL)
        f[at.F_LAP, car] = f[at.F_RAW, car] + f[at.F_TIME, car] + z * fig.track[at.T_START_SD]
        f[at.F_TIME, car] = f[at.F_LAP, car]
        f[at.F_GAP, car] = ZERO


@kernel(inline="always")
def line_up(fig, f, k, r):
    """A lap under a red flag: the field stands in the pit lane in order, lapped cars have their laps back."""
    leader_time = f[at.F_TIME, k[at.K_ORDER, 0]]
    ahead = NEVER
    for p in range(r[at.R_RUNNING]):
        car = k[at.K_ORDER, p]
        start = f[at.F_TIME, car]
        f[at.F_GAP, car] = start - ahead
        ahead = start
        f[at.F_TIME, car] = leader_time + fig.track[at.T_SC_GAP] * np.float32(p)
        f[at.F_LAP, car] = ZERO
        f[at.F_COLD, car] = ZERO


@kernel(inline="always")
def restart_lap(fig, f, k, r, lap, key0, key1):
    """The lap after a red flag, a standing start in the order of the queue: as lap 1, without the drivers' own gains."""
    leader_time = f[at.F_TIME, k[at.K_ORDER, 0]]
    ahead = NEVER
    for p in range(r[at.R_RUNNING]):
        car = k[at.K_ORDER, p]
        start = f[at.F_TIME, car]
        z = rng.from_table(rng.draw(key0, key1, lap, car, rng.RESTART), rng.NORMAL)
        crossing = leader_time + f[at.F_RAW, car] + np.float32(p) * fig.track[at.T_PER_PLACE] + z * fig.track[at.T_START_SD]
        f[at.F_GAP, car] = start - ahead
        ahead = start
        f[at.F_LAP, car] = crossing - start
        f[at.F_TIME, car] = crossing
