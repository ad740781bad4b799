"""Laps that go by, compiled, as everybody on the pit wall would reckon them.

Without luck: each car drives the pace that figures and laps so far tell of it, on tyres that age; rivals do not stop, and the car itself
only where it is told to; a car is held up by one that it is not quicker than by what a pass takes; a safety car that is out goes in after
CAUTION_LAPS, without bunching the field.
"""

import numpy as np

from rsrl.compiled import kernel
from rsrl.season import GREEN, SC
from rsrl.simulator import layout as at
from rsrl.state.outlook import lap_cost

F_TIME, F_LAP, F_WEAR, F_GAP, F_FORM, F_LUCK = at.F_TIME, at.F_LAP, at.F_WEAR, at.F_GAP, at.F_FORM, at.F_LUCK
F_OFFSET, F_LINEAR, F_QUADRATIC, F_COLD, F_DUE = at.F_OFFSET, at.F_LINEAR, at.F_QUADRATIC, at.F_COLD, at.F_DUE
F_SHOWN_SUM, F_SHOWN_LAPS = at.F_SHOWN_SUM, at.F_SHOWN_LAPS
K_ORDER, K_PLACE, K_COMPOUND, K_AGE, K_STOPS = at.K_ORDER, at.K_PLACE, at.K_COMPOUND, at.K_AGE, at.K_STOPS
K_USED, K_STOPPED, K_SOFT_SETS = at.K_USED, at.K_STOPPED, at.K_SOFT_SETS
R_LAP, R_STATUS, R_LEFT, R_SINCE, R_RUNNING, R_NO_DRS, R_RESTART = (
    at.R_LAP, at.R_STATUS, at.R_LEFT, at.R_SINCE, at.R_RUNNING, at.R_NO_DRS, at.R_RESTART,
)  # fmt: skip
Y_OFFSET, Y_LINEAR, Y_QUADRATIC, Y_COLD = at.Y_OFFSET, at.Y_LINEAR, at.Y_QUADRATIC, at.Y_COLD
T_BASE, T_FUEL, T_EVOLUTION, T_FOLLOW, T_PASS, T_WEAR_SC, T_WEAR_VSC, T_IN_SHARE = (
    at.T_BASE, at.T_FUEL, at.T_EVOLUTION, at.T_FOLLOW, at.T_PASS, at.T_WEAR_SC, at.T_WEAR_VSC, at.T_IN_SHARE,
)  # fmt: skip
C_PACE, I_LAPS = at.C_PACE, at.I_LAPS

ZERO, ONE, HALF = np.float32(0.0), np.float32(1.0), np.float32(0.5)
CAUTION_LAPS = np.int32(3)
"""Laps that a safety car is taken to last. A policy does not see it; a race run on draws it anew."""


@kernel(inline="always")
def swap_up(k, p):
    """Let the car in place p take the place ahead."""
    car, other = k[K_ORDER, p], k[K_ORDER, p - 1]
    k[K_ORDER, p - 1], k[K_ORDER, p] = car, other
    k[K_PLACE, car], k[K_PLACE, other] = p - 1, p


@kernel(inline="always")
def put_in_order(f, k, r):
    """Order the running cars by time, those level as they were."""
    for first in range(1, r[R_RUNNING]):
        p = first
        while p > 0 and f[F_TIME, k[K_ORDER, p]] < f[F_TIME, k[K_ORDER, p - 1]]:
            swap_up(k, p)
            p -= 1


@kernel(inline="always")
def gap_to_next(f, k, p):
    """Gap of the car in place p to the one ahead, s."""
    return f[F_TIME, k[K_ORDER, p]] - f[F_TIME, k[K_ORDER, p - 1]]


@kernel(inline="always")
def pace_of(fig, f, k, car):
    """What figures and laps so far tell of a car's coming racing lap, beyond the race's reference lap, s."""
    tyre = lap_cost(fig.tyres, k[K_COMPOUND, car], f[F_WEAR, car]) + f[F_COLD, car]
    return fig.cars[C_PACE, car] + f[F_FORM, car] + f[F_LUCK, car] + tyre


@kernel(inline="always")
def drive_racing_lap(fig, f, k, r):
    """Race times after a racing lap on which everybody drives the expected pace, or is held up."""
    follow, takes = fig.track[T_FOLLOW], fig.track[T_PASS]
    before, time_before = ZERO, ZERO
    for p in range(r[R_RUNNING]):
        car = k[K_ORDER, p]
        pace = pace_of(fig, f, k, car)
        time = f[F_TIME, car] + pace
        if p > 0 and time < time_before + follow and before - pace < takes:
            time = max(time, time_before + min(follow, f[F_TIME, car] - time_before + before))
        f[F_TIME, car] = time
        before, time_before = pace, time
    put_in_order(f, k, r)


@kernel(inline="always")
def box(fig, seen, f, k, r, car, new, status):
    """Let a car have boxed at the end of the last lap for compound `new`, at the mean cost of a stop under a track status."""
    k[K_COMPOUND, car] = new
    k[K_USED, car] |= 1 << new
    k[K_AGE, car] = 0
    k[K_STOPS, car] += 1
    k[K_STOPPED, car] = 1
    k[K_SOFT_SETS + new, car] = max(k[K_SOFT_SETS + new, car] - 1, 0)
    tyre = fig.tyres[new]
    f[F_OFFSET, car], f[F_LINEAR, car], f[F_QUADRATIC, car] = tyre[Y_OFFSET], tyre[Y_LINEAR], tyre[Y_QUADRATIC]
    f[F_COLD, car], f[F_WEAR, car], f[F_LUCK, car] = tyre[Y_COLD], ZERO, ZERO
    f[F_SHOWN_SUM, car], f[F_SHOWN_LAPS, car] = ZERO, ZERO
    loss = seen.pit_cost_s[status]
    shown = loss * fig.track[T_IN_SHARE]
    f[F_TIME, car] += loss
    f[F_LAP, car] += shown
    f[F_DUE, car] = loss - shown
    put_in_order(f, k, r)


@kernel(inline="always")
def drive_lap(fig, seen, f, k, r, own, call):
    """One lap without luck, with the car itself called for `call` at its end: 0 stays out, 1 to 3 box for soft to hard."""
    status, place = r[R_STATUS], k[K_PLACE, own]
    gap = gap_to_next(f, k, place) if place > 0 else f[F_GAP, own]
    wears = ONE
    r[R_LAP] += 1
    if status == GREEN:
        to_go = np.float32(fig.whole[I_LAPS] - r[R_LAP])
        common = fig.track[T_BASE] + fig.track[T_FUEL] * (to_go + HALF) + fig.track[T_EVOLUTION] * to_go / np.float32(fig.whole[I_LAPS])
        for p in range(r[R_RUNNING]):
            car = k[K_ORDER, p]
            f[F_LAP, car] = common + pace_of(fig, f, k, car) + f[F_DUE, car]
        drive_racing_lap(fig, f, k, r)
    else:
        wears = fig.track[T_WEAR_SC] if status == SC else fig.track[T_WEAR_VSC]
    for p in range(r[R_RUNNING]):
        car = k[K_ORDER, p]
        k[K_AGE, car] += 1
        f[F_WEAR, car] += wears
        f[F_COLD, car], f[F_DUE, car] = ZERO, ZERO
        k[K_STOPPED, car] = 0
    f[F_GAP, own] = gap
    r[R_SINCE] += 1
    r[R_NO_DRS] = max(r[R_NO_DRS] - 1, 0)
    r[R_RESTART] = 0
    if status != GREEN and r[R_SINCE] >= CAUTION_LAPS:
        r[R_STATUS], r[R_SINCE], r[R_LEFT] = GREEN, 0, 0
    if call > 0:
        box(fig, seen, f, k, r, own, call - 1, status)
