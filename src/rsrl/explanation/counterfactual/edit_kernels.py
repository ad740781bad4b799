"""A race changed by its causes, compiled.

First what only could have been otherwise (an older set, the compounds used, the sets left), then the laps that go by from there
(`driving`), then what is to hold at that time: time lost, a neighbour's stop, gaps, track status.
"""

import numpy as np

from rsrl.compiled import kernel
from rsrl.environment.kernels import observe_race, write_legal
from rsrl.explanation.counterfactual.driving import CAUTION_LAPS, box, drive_lap, gap_to_next, put_in_order
from rsrl.season import GREEN, RED
from rsrl.simulator import layout as at
from rsrl.simulator.race import copy_race

F_TIME, F_WEAR, F_GAP = at.F_TIME, at.F_WEAR, at.F_GAP
K_ORDER, K_PLACE, K_COMPOUND, K_AGE = at.K_ORDER, at.K_PLACE, at.K_COMPOUND, at.K_AGE
K_USED, K_STOPPED, K_SOFT_SETS = at.K_USED, at.K_STOPPED, at.K_SOFT_SETS
R_LAP, R_STATUS, R_LEFT, R_SINCE, R_RUNNING = at.R_LAP, at.R_STATUS, at.R_LEFT, at.R_SINCE, at.R_RUNNING
T_FOLLOW, I_LAPS, I_MAX_LAPS_PER_SET = at.T_FOLLOW, at.I_LAPS, at.I_MAX_LAPS_PER_SET

# columns of a change, in the order of `causes.Change`
LATER, CALLED, LOST, AHEAD, BEHIND, STATUS, BOXED_AHEAD, BOXED_BEHIND, OLDER, USED, SETS = range(11)
ZERO, ONE = np.float32(0.0), np.float32(1.0)
HARD, MEDIUM = np.int32(2), np.int32(1)
OLDEST = np.int32(40)
"""Laps that a set runs at most: the range in which policies read its age. A race's own limit comes first."""
USED_BEFORE = np.int32(5)
"""Laps that a set may have run before the race, in qualifying."""


@kernel(inline="always")
def lose_time(f, k, r, own, lost):
    """Let the car have lost so many seconds by now; whom it falls behind is ahead. The gap a lap ago moves as the gap ahead does."""
    p = k[K_PLACE, own]
    closed = f[F_GAP, own] - gap_to_next(f, k, p) if p > 0 else ZERO
    f[F_TIME, own] += lost
    put_in_order(f, k, r)
    if k[K_PLACE, own] > 0:
        f[F_GAP, own] = gap_to_next(f, k, k[K_PLACE, own]) + closed


@kernel(inline="always")
def set_gap_ahead(fig, f, k, own, gap):
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
def set_gap_behind(fig, f, k, r, own, gap):
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
def box_rival(fig, seen, f, k, r, car):
    """Let a rival have boxed on a racing lap for the hard, or the medium where it was on the hard."""
    box(fig, seen, f, k, r, car, MEDIUM if k[K_COMPOUND, car] == HARD else HARD, GREEN)


@kernel(inline="always")
def is_feasible(fig, k, r, own, change):
    """Whether a race has the laps that a change speaks of, and what could have been otherwise is and could have."""
    later = change[LATER] if np.isnan(change[CALLED]) else change[CALLED]
    fits = np.isnan(later) or (r[R_STATUS] != RED and later >= ONE and r[R_LAP] + np.int32(later) <= fig.whole[I_LAPS] - 1)
    fits &= np.isnan(change[LATER]) or np.isnan(change[CALLED])
    fits &= np.isnan(change[LOST]) or change[LOST] > ZERO
    fits &= np.isnan(change[OLDER]) or k[K_AGE, own] + np.int32(change[OLDER]) <= r[R_LAP] + USED_BEFORE
    two = (k[K_USED, own] & (k[K_USED, own] - 1)) != 0
    return fits and (np.isnan(change[USED]) or two == (change[USED] == ONE))


@kernel(inline="always")
def has_neighbours(k, r, own, change):
    """Whether there are the cars that a change speaks of when it is to hold, they can have boxed, and a gap as asked for is one."""
    p = k[K_PLACE, own]
    ahead, behind = k[K_ORDER, max(p - 1, 0)], k[K_ORDER, min(p + 1, r[R_RUNNING] - 1)]
    fits = np.isnan(change[AHEAD]) or (p > 0 and change[AHEAD] >= ZERO)
    fits &= np.isnan(change[BEHIND]) or (p + 1 < r[R_RUNNING] and change[BEHIND] >= ZERO)
    fits &= np.isnan(change[BOXED_AHEAD]) or (p > 0 and r[R_LAP] > 0 and k[K_STOPPED, ahead] == 0)
    return fits and (np.isnan(change[BOXED_BEHIND]) or (p + 1 < r[R_RUNNING] and r[R_LAP] > 0 and k[K_STOPPED, behind] == 0))


@kernel(inline="always")
def set_status(r, status):
    """Let a track status begin with the coming lap."""
    if r[R_STATUS] != status:
        r[R_STATUS], r[R_SINCE], r[R_LEFT] = status, 0, 0 if status == GREEN else CAUTION_LAPS


@kernel(inline="always")
def rewrite_past(f, k, own, change):
    """Put in what only could have been otherwise: the set's age, how many compounds have been used, the sets left."""
    if not np.isnan(change[OLDER]):
        k[K_AGE, own] += np.int32(change[OLDER])
        f[F_WEAR, own] += change[OLDER]
    if not np.isnan(change[USED]):
        fitted = k[K_COMPOUND, own]
        other = HARD if fitted != HARD else MEDIUM
        k[K_USED, own] = (1 << fitted) if change[USED] == ONE else (1 << fitted) | (1 << other)
    for c in range(3):
        if not np.isnan(change[SETS + c]):
            k[K_SOFT_SETS + c, own] = np.int32(change[SETS + c])


@kernel(inline="always")
def alter_race(fig, seen, f, k, r, own, change, calls):
    """Change a race in place; returns whether it could be. What is to be in some laps' time is as said at that time."""
    if not is_feasible(fig, k, r, own, change):
        return False
    limit = fig.whole[I_MAX_LAPS_PER_SET] if fig.whole[I_MAX_LAPS_PER_SET] > 0 else OLDEST
    limit = max(limit, k[K_AGE, own])
    rewrite_past(f, k, own, change)
    if not np.isnan(change[LATER]):
        for _ in range(np.int32(change[LATER])):
            drive_lap(fig, seen, f, k, r, own, np.int32(0))
    elif not np.isnan(change[CALLED]):
        for n in range(np.int32(change[CALLED])):
            drive_lap(fig, seen, f, k, r, own, np.int32(calls[n]))
    if not np.isnan(change[LOST]):
        lose_time(f, k, r, own, change[LOST])
    if k[K_AGE, own] > limit or not has_neighbours(k, r, own, change):
        return False
    p = k[K_PLACE, own]
    if not np.isnan(change[BOXED_AHEAD]):
        box_rival(fig, seen, f, k, r, k[K_ORDER, p - 1])
    elif not np.isnan(change[BOXED_BEHIND]):
        box_rival(fig, seen, f, k, r, k[K_ORDER, p + 1])
    if not np.isnan(change[AHEAD]) and k[K_PLACE, own] > 0:
        set_gap_ahead(fig, f, k, own, change[AHEAD])
    if not np.isnan(change[BEHIND]) and k[K_PLACE, own] + 1 < r[R_RUNNING]:
        set_gap_behind(fig, f, k, r, own, change[BEHIND])
    if not np.isnan(change[STATUS]):
        set_status(r, np.int32(change[STATUS]))
    return True


@kernel()
def alter_races(fig, seen, f, k, r, own, changes, calls, f1, k1, r1, raw, legal, possible):
    """A race f, k, r changed in each of `changes` [N, causes]: raw rows, legal calls, whether it can be.

    calls: the car's calls lap by lap from now, int8 [N, laps], read by changes that drive on by them.
    f1, k1, r1: room for the changed races, [N, ...] to keep them all, [1, ...] to keep none.
    """
    for i in range(changes.shape[0]):
        j = min(i, f1.shape[0] - 1)
        copy_race(f, k, r, f1[j], k1[j], r1[j])
        possible[i] = alter_race(fig, seen, f1[j], k1[j], r1[j], own, changes[i], calls[i])
        write_legal(fig.whole, k1[j], r1[j], own, legal[i])
        observe_race(fig, raw[i], f1[j], k1[j], r1[j], own, seen)
