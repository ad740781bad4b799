"""A race changed by its causes, compiled: laps gone by, gaps, track status, tyre age, a neighbour's stop, sets left.

Laps go by as everybody on the pit wall would reckon them, without luck: each car drives the pace that figures and laps so far tell of it,
on tyres that age; nobody stops; a car is held up by one that it is not quicker than by what a pass takes; a safety car that is out stays
out.
"""

import numpy as np

from rsrl.compiled import kernel
from rsrl.environment.kernels import observe_race, write_legal
from rsrl.season import GREEN, RED, SC
from rsrl.simulator import layout as at
from rsrl.simulator.lookahead import copy_race
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
T_BASE, T_FUEL, T_EVOLUTION, T_FOLLOW, T_PASS, T_WEAR_SC, T_WEAR_VSC = (
    at.T_BASE, at.T_FUEL, at.T_EVOLUTION, at.T_FOLLOW, at.T_PASS, at.T_WEAR_SC, at.T_WEAR_VSC,
)  # fmt: skip
C_PACE, I_LAPS = at.C_PACE, at.I_LAPS

# columns of a change, in the order of `causes.Change`
LATER, AHEAD, BEHIND, STATUS, OLDER, BOXED_AHEAD, BOXED_BEHIND, SETS = range(8)
ZERO, ONE, HALF = np.float32(0.0), np.float32(1.0), np.float32(0.5)
STATUS_LAPS = np.int32(3)
"""Laps that a safety car newly out is taken to last. A policy does not see it; a race run on draws it anew."""
HARD, MEDIUM = np.int32(2), np.int32(1)


@kernel(inline="always")
def swap_up(k, p):  # type: ignore[no-untyped-def]
    """Let the car in place p take the place ahead."""
    car, other = k[K_ORDER, p], k[K_ORDER, p - 1]
    k[K_ORDER, p - 1], k[K_ORDER, p] = car, other
    k[K_PLACE, car], k[K_PLACE, other] = p - 1, p


@kernel(inline="always")
def put_in_order(f, k, r):  # type: ignore[no-untyped-def]
    """Order the running cars by time, those level as they were."""
    for first in range(1, r[R_RUNNING]):
        p = first
        while p > 0 and f[F_TIME, k[K_ORDER, p]] < f[F_TIME, k[K_ORDER, p - 1]]:
            swap_up(k, p)
            p -= 1


@kernel(inline="always")
def gap_to_next(f, k, p):  # type: ignore[no-untyped-def]
    """Gap of the car in place p to the one ahead, s."""
    return f[F_TIME, k[K_ORDER, p]] - f[F_TIME, k[K_ORDER, p - 1]]


@kernel(inline="always")
def pace_of(fig, f, k, car):  # type: ignore[no-untyped-def]
    """What figures and laps so far tell of a car's coming racing lap, beyond the race's reference lap, s."""
    return fig.cars[C_PACE, car] + f[F_FORM, car] + f[F_LUCK, car] + lap_cost(fig.tyres, k[K_COMPOUND, car], f[F_WEAR, car])


@kernel(inline="always")
def drive_racing_lap(fig, f, k, r):  # type: ignore[no-untyped-def]
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
def drive_lap(fig, f, k, r, own):  # type: ignore[no-untyped-def]
    """One lap without luck, with everybody staying out."""
    status, place = r[R_STATUS], k[K_PLACE, own]
    gap = gap_to_next(f, k, place) if place > 0 else f[F_GAP, own]
    wears = ONE
    r[R_LAP] += 1
    if status == GREEN:
        to_go = np.float32(fig.whole[I_LAPS] - r[R_LAP])
        common = fig.track[T_BASE] + fig.track[T_FUEL] * (to_go + HALF) + fig.track[T_EVOLUTION] * to_go / np.float32(fig.whole[I_LAPS])
        for p in range(r[R_RUNNING]):
            car = k[K_ORDER, p]
            f[F_LAP, car] = common + pace_of(fig, f, k, car)
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


@kernel(inline="always")
def set_gap_ahead(fig, f, k, own, gap):  # type: ignore[no-untyped-def]
    """Put the car ahead `gap` seconds ahead; a car it would come too close to goes on with it. The gap a lap ago moves by as much."""
    p = k[K_PLACE, own]
    f[F_GAP, own] += gap - gap_to_next(f, k, p)
    time = f[F_TIME, own] - gap
    for q in range(p - 1, -1, -1):
        car = k[K_ORDER, q]
        least = min(fig.track[T_FOLLOW], gap_to_next(f, k, q)) if q > 0 else ZERO
        if q == p - 1 or f[F_TIME, car] > time:
            f[F_TIME, car] = time
        time = f[F_TIME, car] - least


@kernel(inline="always")
def set_gap_behind(fig, f, k, r, own, gap):  # type: ignore[no-untyped-def]
    """Put the car behind `gap` seconds behind; a car it would come too close to falls back with it."""
    p = k[K_PLACE, own]
    time = f[F_TIME, own] + gap
    for q in range(p + 1, r[R_RUNNING]):
        car = k[K_ORDER, q]
        least = min(fig.track[T_FOLLOW], gap_to_next(f, k, q + 1)) if q + 1 < r[R_RUNNING] else ZERO
        if q == p + 1 or f[F_TIME, car] < time:
            f[F_TIME, car] = time
        time = f[F_TIME, car] + least


@kernel(inline="always")
def box(fig, seen, f, k, r, car):  # type: ignore[no-untyped-def]
    """Let a car have boxed at the end of the last lap, a racing one, for the hard, or the medium where it was on the hard."""
    new = MEDIUM if k[K_COMPOUND, car] == HARD else HARD
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
    f[F_TIME, car] += seen.pit_cost_s[GREEN]
    put_in_order(f, k, r)


@kernel(inline="always")
def is_there(fig, f, k, r, own, change):  # type: ignore[no-untyped-def]
    """Whether there are the cars and laps that a change speaks of, and a gap as asked for is one."""
    p = k[K_PLACE, own]
    later = change[LATER]
    fits = np.isnan(later) or (r[R_STATUS] != RED and later >= ONE and r[R_LAP] + np.int32(later) <= fig.whole[I_LAPS] - 1)
    fits &= np.isnan(change[AHEAD]) or (p > 0 and change[AHEAD] >= ZERO)
    fits &= np.isnan(change[BEHIND]) or (p + 1 < r[R_RUNNING] and change[BEHIND] >= ZERO)
    fits &= np.isnan(change[BOXED_AHEAD]) or (p > 0 and r[R_LAP] > 0 and k[K_STOPPED, k[K_ORDER, p - 1]] == 0)
    behind = k[K_ORDER, min(p + 1, r[R_RUNNING] - 1)]
    return fits and (np.isnan(change[BOXED_BEHIND]) or (p + 1 < r[R_RUNNING] and r[R_LAP] > 0 and k[K_STOPPED, behind] == 0))


@kernel(inline="always")
def set_status(r, status):  # type: ignore[no-untyped-def]
    """Let a track status begin with the coming lap."""
    if r[R_STATUS] != status:
        r[R_STATUS], r[R_SINCE], r[R_LEFT] = status, 0, 0 if status == GREEN else STATUS_LAPS


@kernel(inline="always")
def alter_race(fig, seen, f, k, r, own, change):  # type: ignore[no-untyped-def]
    """Change a race in place; returns whether it could be. What is to be in some laps' time is as said at that time."""
    if not is_there(fig, f, k, r, own, change):
        return False
    if not np.isnan(change[LATER]):
        for _ in range(np.int32(change[LATER])):
            drive_lap(fig, f, k, r, own)
    p = k[K_PLACE, own]
    if (p == 0 and not (np.isnan(change[AHEAD]) and np.isnan(change[BOXED_AHEAD]))) or (
        p + 1 >= r[R_RUNNING] and not (np.isnan(change[BEHIND]) and np.isnan(change[BOXED_BEHIND]))
    ):
        return False
    if not np.isnan(change[BOXED_AHEAD]):
        box(fig, seen, f, k, r, k[K_ORDER, p - 1])
    elif not np.isnan(change[BOXED_BEHIND]):
        box(fig, seen, f, k, r, k[K_ORDER, p + 1])
    if not np.isnan(change[AHEAD]) and k[K_PLACE, own] > 0:
        set_gap_ahead(fig, f, k, own, change[AHEAD])
    if not np.isnan(change[BEHIND]) and k[K_PLACE, own] + 1 < r[R_RUNNING]:
        set_gap_behind(fig, f, k, r, own, change[BEHIND])
    if not np.isnan(change[STATUS]):
        set_status(r, np.int32(change[STATUS]))
    if not np.isnan(change[OLDER]):
        k[K_AGE, own] += np.int32(change[OLDER])
        f[F_WEAR, own] += change[OLDER]
    for c in range(3):
        if not np.isnan(change[SETS + c]):
            k[K_SOFT_SETS + c, own] = np.int32(change[SETS + c])
    return True


@kernel()
def alter_races(fig, seen, f, k, r, own, changes, f1, k1, r1, raw, legal, possible):  # type: ignore[no-untyped-def]
    """A race f, k, r changed in each of `changes` [N, causes]: raw rows, legal calls, whether it can be.

    f1, k1, r1: room for the changed races, [N, ...] to keep them all, [1, ...] to keep none.
    """
    for i in range(changes.shape[0]):
        j = min(i, f1.shape[0] - 1)
        copy_race(f, k, r, f1[j], k1[j], r1[j])
        possible[i] = alter_race(fig, seen, f1[j], k1[j], r1[j], own, changes[i])
        write_legal(fig.whole, k1[j], r1[j], own, legal[i])
        observe_race(fig, raw[i], f1[j], k1[j], r1[j], own, seen)
