"""Lap times: alone on the track, past lapped cars, in traffic, behind the safety car, under the virtual one."""

import numpy as np

from rsrl.compiled import kernel
from rsrl.simulator import random as rng
from rsrl.simulator.layout import (
    C_NOISE,
    CARS,
    F_COLD,
    F_GAP,
    F_LAP,
    F_LINEAR,
    F_OFFSET,
    F_PACE,
    F_QUADRATIC,
    F_RAW,
    F_TIME,
    F_WEAR,
    K_BITS,
    K_ORDER,
    R_LEFT,
    R_NO_DRS,
    R_RUNNING,
    R_SINCE,
    T_BASE,
    T_BLUE,
    T_DIRTY,
    T_DIRTY_WINDOW,
    T_DRS,
    T_DRS_WINDOW,
    T_FOLLOW,
    T_LAPPING,
    T_PASS,
    T_PASS_LOSS,
    T_PASS_SCALE,
    T_PASSED_LOSS,
    T_PER_PLACE,
    T_SC_CATCH,
    T_SC_FACTOR,
    T_SC_GAP,
    T_START_SD,
)

NEVER = np.float32(-1.0e9)
FAR = np.float32(1.0e9)
ZERO = np.float32(0.0)
ONE = np.float32(1.0)
LAPPED_MARGIN_S = np.float32(5.0)  # a car this close to being lapped may be lapped on the coming lap
LAPS_WITHOUT_DRS = 2  # sporting regulations 2022-23: after the start and after a safety car; a virtual one gives it back at once


@kernel(inline="always")
def free_air(fig, f, k, n, lap, key0, key1):  # type: ignore[no-untyped-def]
    """F_RAW: each car's lap alone on the track, relative to the reference lap.

    The first two loops are vectorised. The third goes by place so that it is not: a vector's gather from a table costs several times
    what the loads do one by one, on processors that guard it against leaks.
    """
    first = rng.counter(lap, 0, rng.NOISE)
    for car in range(CARS):
        k[K_BITS, car] = np.int32(rng.bits(key0, key1, np.uint32(first + np.uint32(car) * rng.PER_CAR)))
    for car in range(CARS):
        wear = f[F_WEAR, car]
        tyre = f[F_OFFSET, car] + f[F_COLD, car] + wear * (f[F_LINEAR, car] + wear * f[F_QUADRATIC, car])
        f[F_RAW, car] = f[F_PACE, car] + tyre
        f[F_COLD, car] = ZERO
    for p in range(n):
        car = np.uint32(k[K_ORDER, p])
        f[F_RAW, car] += rng.from_table(np.uint32(k[K_BITS, car]), rng.NORMAL) * fig.cars[C_NOISE, car]


@kernel(inline="always")
def wave_blue_flags(fig, f, k, n):  # type: ignore[no-untyped-def]
    """Lapped cars and those that lap them lose time on the laps where it happens."""
    base = fig.track[T_BASE]
    per_base = ONE / base
    blue, lapping = fig.track[T_BLUE], fig.track[T_LAPPING]
    lap_down = f[F_TIME, k[K_ORDER, 0]] + base - LAPPED_MARGIN_S
    for p in range(n - 1, 0, -1):
        lapped = k[K_ORDER, p]
        time = f[F_TIME, lapped]
        if time < lap_down:
            return
        raw = f[F_RAW, lapped]
        times = 0
        for car in range(CARS):  # all cars and no branch, so that it is vectorised; those behind have before < 0
            before = (time - f[F_TIME, car]) * per_base
            after = before + (raw - f[F_RAW, car]) * per_base
            laps_it = (before > ZERO) & (after >= np.floor(before) + ONE)
            times += np.int32(laps_it)
            f[F_RAW, car] += lapping if laps_it else ZERO
        f[F_RAW, lapped] += blue * np.float32(times)


@kernel(inline="always")
def race_traffic(fig, f, k, r):  # type: ignore[no-untyped-def]
    """Cross the line from the front: a car that reaches the one ahead passes it or is held behind it.

    The sweep has no branches: who is held up is what a processor cannot predict. What a car needs to pass is drawn from the bits that
    drew its noise, read from the other end.
    """
    t = fig.track
    # copies, since the compiler cannot know that the stores below leave the figures alone
    dirty, dirty_window, drs, follow = t[T_DIRTY], t[T_DIRTY_WINDOW], t[T_DRS], t[T_FOLLOW]
    threshold, scale, pass_loss, passed_loss = t[T_PASS], t[T_PASS_SCALE], t[T_PASS_LOSS], t[T_PASSED_LOSS]
    dirty_slope = dirty / dirty_window
    drs_window = t[T_DRS_WINDOW]
    if r[R_NO_DRS] > 0:
        drs_window = NEVER
    latest = NEVER  # the latest crossing so far
    ahead = np.uint32(k[K_ORDER, 0])
    ahead_start, ahead_crossing = NEVER, ZERO
    ahead_raw = ZERO
    for p in range(r[R_RUNNING]):
        car = np.uint32(k[K_ORDER, p])
        start = f[F_TIME, car]
        gap = start - ahead_start
        raw = f[F_RAW, car] + max(dirty - gap * dirty_slope, ZERO)
        raw -= drs if gap < drs_window else ZERO
        needed = threshold + scale * rng.from_table(rng.other_end(np.uint32(k[K_BITS, car])), rng.LOGISTIC)
        free = start + raw
        past = free + pass_loss
        tries = free if ahead_raw - raw > needed else FAR
        held = latest + follow
        passes = tries < held  # the one comparison that waits for the car before
        queued = max(free, held)
        crossing = past if passes else queued
        latest = max(latest, past) if passes else queued
        f[F_GAP, car] = gap
        settled = ahead_crossing + (passed_loss if passes else ZERO)
        f[F_LAP, ahead] = settled - ahead_start  # of the first car's first turn nothing is left
        f[F_TIME, ahead] = settled if p > 0 else start
        ahead = car
        ahead_start = start
        ahead_raw = raw
        ahead_crossing = crossing
    f[F_LAP, ahead] = ahead_crossing - ahead_start
    f[F_TIME, ahead] = ahead_crossing


@kernel(inline="always")
def follow_safety_car(fig, f, k, r):  # type: ignore[no-untyped-def]
    """A lap behind the safety car: the queue closes up, nobody passes, lapped cars get their lap back before it goes in."""
    t = fig.track
    catch = (t[T_SC_CATCH] - t[T_SC_FACTOR]) * t[T_BASE]
    leader_time = f[F_TIME, k[K_ORDER, 0]]
    unlap = r[R_LEFT] == 1 and r[R_SINCE] > 0
    latest = leader_time
    ahead = NEVER
    for p in range(r[R_RUNNING]):
        car = k[K_ORDER, p]
        start = f[F_TIME, car]
        f[F_GAP, car] = start - ahead
        ahead = start
        if unlap:
            start -= t[T_BASE] * np.floor((start - leader_time) / t[T_BASE])
        if p == 0:
            crossing = start
        else:
            crossing = max(start + catch, latest + t[T_SC_GAP])
        f[F_LAP, car] = crossing - start
        f[F_TIME, car] = crossing
        f[F_COLD, car] = ZERO
        latest = crossing


@kernel(inline="always")
def keep_delta(f, k, r):  # type: ignore[no-untyped-def]
    """A lap of virtual safety car: everyone keeps the gap."""
    ahead = NEVER
    for p in range(r[R_RUNNING]):
        car = k[K_ORDER, p]
        f[F_GAP, car] = f[F_TIME, car] - ahead
        ahead = f[F_TIME, car]
        f[F_LAP, car] = ZERO
        f[F_COLD, car] = ZERO


@kernel(inline="always")
def start_lap(fig, f, k, r, key0, key1):  # type: ignore[no-untyped-def]
    """Lap 1: standing start from the grid; `F_RAW` holds noise, pace and tyre already, F_TIME the grid's loss."""
    for p in range(r[R_RUNNING]):
        car = k[K_ORDER, p]
        z = rng.from_table(rng.draw(key0, key1, 0, car, rng.NOISE), rng.NORMAL)
        f[F_LAP, car] = f[F_RAW, car] + f[F_TIME, car] + z * fig.track[T_START_SD]
        f[F_TIME, car] = f[F_LAP, car]
        f[F_GAP, car] = ZERO


@kernel(inline="always")
def line_up(fig, f, k, r):  # type: ignore[no-untyped-def]
    """A lap under a red flag: the field stands in the pit lane in order, lapped cars have their laps back."""
    leader_time = f[F_TIME, k[K_ORDER, 0]]
    ahead = NEVER
    for p in range(r[R_RUNNING]):
        car = k[K_ORDER, p]
        start = f[F_TIME, car]
        f[F_GAP, car] = start - ahead
        ahead = start
        f[F_TIME, car] = leader_time + fig.track[T_SC_GAP] * np.float32(p)
        f[F_LAP, car] = ZERO
        f[F_COLD, car] = ZERO


@kernel(inline="always")
def restart_lap(fig, f, k, r, lap, key0, key1):  # type: ignore[no-untyped-def]
    """The lap after a red flag, a standing start in the order of the queue: as lap 1, without the drivers' own gains."""
    leader_time = f[F_TIME, k[K_ORDER, 0]]
    ahead = NEVER
    for p in range(r[R_RUNNING]):
        car = k[K_ORDER, p]
        start = f[F_TIME, car]
        z = rng.from_table(rng.draw(key0, key1, lap, car, rng.RESTART), rng.NORMAL)
        crossing = leader_time + f[F_RAW, car] + np.float32(p) * fig.track[T_PER_PLACE] + z * fig.track[T_START_SD]
        f[F_GAP, car] = start - ahead
        ahead = start
        f[F_LAP, car] = crossing - start
        f[F_TIME, car] = crossing
