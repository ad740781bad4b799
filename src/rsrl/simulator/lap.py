"""One lap of the race, compiled. Reads parameters from `fig`, changes only the race's own arrays f, k and r.

A lap, in order: retirements; who stops at its end; every car's time in free air; blue flags; traffic from the front
to the back; the stops; the new order; the track status of the next lap, which the next decisions may know.
Times of cars are relative to the race's reference clock, because float32 holds 5600 s only to half a millisecond.
"""

import numpy as np

from rsrl.compiled import kernel
from rsrl.season import GREEN, SC, VSC
from rsrl.simulator import random as rng
from rsrl.simulator.calls import decide, fit_tyre, load_next_stop
from rsrl.simulator.layout import (
    C_STOP,
    CARS,
    F_COLD,
    F_LAP,
    F_TIME,
    F_WEAR,
    I_LAPS,
    K_AGE,
    K_ORDER,
    K_PLACE,
    K_PLAN,
    K_POINTER,
    K_RETIRE,
    K_STOPPED,
    K_STOPS,
    K_WANT,
    NO_STOP,
    R_CLOCK_MS,
    R_FLAGGED,
    R_KEY0,
    R_KEY1,
    R_LAP,
    R_LEFT,
    R_NO_DRS,
    R_RETIREMENT,
    R_RUNNING,
    R_SC_LAPS,
    R_SINCE,
    R_STATUS,
    R_VSC_LAPS,
    T_BASE,
    T_FUEL,
    T_PIT,
    T_SC,
    T_SC_FACTOR,
    T_SC_LAP1,
    T_START,
    T_VSC,
    T_VSC_FACTOR,
    T_WEAR_SC,
    T_WEAR_VSC,
    Y_COLD,
)
from rsrl.simulator.traffic import (
    LAPPED_MARGIN_S,
    LAPS_WITHOUT_DRS,
    NEVER,
    ONE,
    follow_safety_car,
    free_air,
    keep_delta,
    race_traffic,
    start_lap,
    wave_blue_flags,
)

OUT = np.float32(1.0e6)  # race time of a car that has retired; later retirements stand ahead of earlier ones
HALF = np.float32(0.5)
THOUSAND = np.float32(1000.0)


@kernel(inline="always")
def retire_cars(k, f, r, lap):  # type: ignore[no-untyped-def]
    """Take out the cars whose race ends on this lap and find the next such lap."""
    soonest = NO_STOP
    n = r[R_RUNNING]
    for p in range(n - 1, -1, -1):
        car = k[K_ORDER, p]
        if k[K_RETIRE, car] > lap:
            soonest = min(soonest, k[K_RETIRE, car])
            continue
        n -= 1
        for q in range(p, n):
            k[K_ORDER, q] = k[K_ORDER, q + 1]
            k[K_PLACE, k[K_ORDER, q]] = q
        k[K_ORDER, n] = car
        k[K_PLACE, car] = n
        f[F_TIME, car] = OUT - THOUSAND * np.float32(lap)
    r[R_RUNNING] = n
    r[R_RETIREMENT] = soonest


@kernel(inline="always")
def take_stops(fig, plans, f, k, r, lap, key0, key1):  # type: ignore[no-untyped-def]
    """Pit-lane loss, stop time and new tyres for the cars that box at the end of this lap."""
    status = r[R_STATUS]
    for p in range(r[R_RUNNING]):
        car = k[K_ORDER, p]
        want = k[K_WANT, car]
        if want < 0:
            continue
        tail = rng.from_table(rng.draw(key0, key1, lap, car, rng.STOP), fig.tail)
        loss = fig.track[T_PIT + status] + fig.cars[C_STOP, car] + tail
        f[F_TIME, car] += loss
        f[F_LAP, car] += loss
        fit_tyre(fig, f, k, car, want)
        f[F_COLD, car] = fig.tyres[want, Y_COLD]
        k[K_STOPS, car] += 1
        k[K_STOPPED, car] = 1
        if k[K_PLAN, car] >= 0:
            k[K_POINTER, car] += 1
            load_next_stop(fig, plans, k, car, lap, key0, key1)


@kernel(inline="always")
def sort_order(f, k, n):  # type: ignore[no-untyped-def]
    """Insertion sort of the running cars by race time: few change place on a lap. Ties keep the old order."""
    latest = NEVER
    for p in range(n):
        car = k[K_ORDER, p]
        time = f[F_TIME, np.uint32(car)]
        if time >= latest:
            latest = time
            continue
        q = p
        while q > 0 and f[F_TIME, np.uint32(k[K_ORDER, q - 1])] > time:
            k[K_ORDER, q] = k[K_ORDER, q - 1]
            q -= 1
        k[K_ORDER, q] = car
    for p in range(n):
        k[K_PLACE, np.uint32(k[K_ORDER, p])] = p


@kernel(inline="always")
def next_status(fig, r, lap, key0, key1):  # type: ignore[no-untyped-def]
    """Track status of the lap after `lap`: drawn from (seed, race, lap) alone, whatever anyone's strategy was."""
    r[R_SINCE] += 1
    r[R_NO_DRS] = max(r[R_NO_DRS] - 1, 0)
    if r[R_STATUS] != GREEN:
        r[R_LEFT] -= 1
        if r[R_LEFT] > 0:
            return
        if r[R_STATUS] == SC:
            r[R_NO_DRS] = LAPS_WITHOUT_DRS
        r[R_STATUS] = GREEN
        r[R_SINCE] = 0
        return
    t = fig.track
    u = rng.unit(rng.draw(key0, key1, lap, 0, rng.INCIDENT))
    sc = t[T_SC_LAP1] if lap == 1 else t[T_SC]
    if u >= sc + t[T_VSC]:
        return
    length = rng.unit(rng.draw(key0, key1, lap, 0, rng.DURATION))
    shares = fig.sc_laps if u < sc else fig.vsc_laps
    n = 1
    while n < shares.shape[0] and length > shares[n - 1]:
        n += 1
    r[R_STATUS] = SC if u < sc else VSC
    r[R_LEFT] = n
    r[R_SINCE] = 0


@kernel(inline="always")
def advance(fig, plans, f, k, r, actions):  # type: ignore[no-untyped-def]
    """Run one lap. `actions` int8 [20] calls the cars without a plan: 0 stay, 1 + compound to box at its end."""
    if r[R_FLAGGED]:
        return
    lap = r[R_LAP] + 1
    key0, key1 = np.uint32(r[R_KEY0]), np.uint32(r[R_KEY1])
    status = r[R_STATUS]
    t = fig.track
    if r[R_RETIREMENT] <= lap:
        retire_cars(k, f, r, lap)
    boxing = decide(fig, plans, k, r, actions, lap, key0, key1) if lap < fig.whole[I_LAPS] else 0  # the flag comes first
    for car in range(CARS):
        k[K_STOPPED, car] = 0
    reference = t[T_BASE]
    ageing = ONE
    if status == GREEN:
        reference += t[T_FUEL] * (np.float32(fig.whole[I_LAPS] - lap) + HALF)
        free_air(fig, f, k, lap, key0, key1)
        n = r[R_RUNNING]
        if lap == 1:
            reference += t[T_START]
            start_lap(fig, f, k, r, key0, key1)
        else:
            if n > 0 and f[F_TIME, k[K_ORDER, n - 1]] - f[F_TIME, k[K_ORDER, 0]] > t[T_BASE] - LAPPED_MARGIN_S:
                wave_blue_flags(fig, f, k, n)
            race_traffic(fig, f, k, r, lap, key0, key1)
    elif status == SC:
        reference *= t[T_SC_FACTOR]
        ageing = t[T_WEAR_SC]
        r[R_SC_LAPS] += 1
        follow_safety_car(fig, f, k, r)
    else:
        reference *= t[T_VSC_FACTOR]
        ageing = t[T_WEAR_VSC]
        r[R_VSC_LAPS] += 1
        keep_delta(f, k, r)
    for car in range(CARS):
        f[F_LAP, car] += reference
        f[F_WEAR, car] += ageing
        k[K_AGE, car] += 1
    if boxing > 0:
        take_stops(fig, plans, f, k, r, lap, key0, key1)
    sort_order(f, k, r[R_RUNNING])
    r[R_CLOCK_MS] += np.int32(np.rint(reference * THOUSAND))
    r[R_LAP] = lap
    if lap >= fig.whole[I_LAPS]:
        r[R_FLAGGED] = 1
    else:
        next_status(fig, r, lap, key0, key1)


@kernel()
def advance_lap(fig, plans, f, k, r, actions):  # type: ignore[no-untyped-def]
    """`advance`, compiled once for all callers that step lap by lap; whole races inline it, which is a third quicker."""
    advance(fig, plans, f, k, r, actions)
