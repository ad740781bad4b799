"""Edits of a race state, compiled.

In this order: what only another past could have brought (an older set, other compounds used, other sets left), then the laps until the
change is to hold (`rollouts.expected_laps`), then what is to hold at that time: time lost, a neighbour's stop, gaps, track status.
"""

import numpy as np

from rsrl.compiled import kernel
from rsrl.environment.kernels import observe_race, write_legal
from rsrl.rollouts.expected_laps import CAUTION_LAPS, add_expected_lap, add_stop, gap_to_next, sort_by_time
from rsrl.season import GREEN, RED
from rsrl.simulator import layout as at
from rsrl.simulator.race import copy_race

# columns of a change, in the order of the fields of `change.Change`; SETS is the first of three
LATER, CALLED, LOST, AHEAD, BEHIND, STATUS, BOXED_AHEAD, BOXED_BEHIND, OLDER, USED, SETS = range(11)
ZERO, ONE = np.float32(0.0), np.float32(1.0)
HARD, MEDIUM = np.int32(2), np.int32(1)
MAX_SET_LAPS = np.int32(40)
"""Laps that a set runs at most: the range in which policies read its age. A race's own limit comes first."""
USED_BEFORE_RACE = np.int32(5)
"""Laps that a set may have run before the race, in qualifying."""


@kernel(inline=True)
def lose_time(f, k, r, own, lost):
    """Add `lost` seconds to the car's race time; cars it falls behind are then ahead of it."""
    p = k[at.K_PLACE, own]
    closed = f[at.F_GAP, own] - gap_to_next(f, k, p) if p > 0 else ZERO
    f[at.F_TIME, own] += lost
    sort_by_time(f, k, r)
    if k[at.K_PLACE, own] > 0:  # the gap a lap ago moves too, so that how fast the gap closes stays as it was
        f[at.F_GAP, own] = gap_to_next(f, k, k[at.K_PLACE, own]) + closed


@kernel(inline=True)
def set_gap_ahead(fig, f, k, own, gap):
    """Put the car ahead `gap` seconds ahead; cars in front that it would come too close to move forward with it."""
    p = k[at.K_PLACE, own]
    f[at.F_GAP, own] += gap - gap_to_next(f, k, p)
    time = f[at.F_TIME, own] - gap
    for q in range(p - 1, -1, -1):
        car = k[at.K_ORDER, q]
        least = min(fig.track[at.T_FOLLOW], gap_to_next(f, k, q)) if q > 0 else ZERO
        if q == p - 1 or f[at.F_TIME, car] > time:
            f[at.F_TIME, car] = time
        time = f[at.F_TIME, car] - least


@kernel(inline=True)
def set_gap_behind(fig, f, k, r, own, gap):
    """Put the car behind `gap` seconds behind; cars that it would come too close to fall back with it."""
    p = k[at.K_PLACE, own]
    time = f[at.F_TIME, own] + gap
    for q in range(p + 1, r[at.R_RUNNING]):
        car = k[at.K_ORDER, q]
        least = min(fig.track[at.T_FOLLOW], gap_to_next(f, k, q + 1)) if q + 1 < r[at.R_RUNNING] else ZERO
        if q == p + 1 or f[at.F_TIME, car] < time:
            f[at.F_TIME, car] = time
        time = f[at.F_TIME, car] + least


@kernel(inline=True)
def box_rival(fig, context, f, k, r, car):
    """Let a rival have boxed on a racing lap for the hard, or for the medium where it was on the hard."""
    add_stop(fig, context, f, k, r, car, MEDIUM if k[at.K_COMPOUND, car] == HARD else HARD, GREEN)


@kernel(inline=True)
def is_feasible(fig, k, r, own, change):
    """Whether the race has the laps that a change needs, and its past could have been the one that the change describes."""
    later = change[LATER] if np.isnan(change[CALLED]) else change[CALLED]
    fits = np.isnan(later) or (r[at.R_STATUS] != RED and later >= ONE and r[at.R_LAP] + np.int32(later) <= fig.whole[at.I_LAPS] - 1)
    fits &= np.isnan(change[LATER]) or np.isnan(change[CALLED])
    fits &= np.isnan(change[LOST]) or change[LOST] > ZERO
    fits &= np.isnan(change[OLDER]) or k[at.K_AGE, own] + np.int32(change[OLDER]) <= r[at.R_LAP] + USED_BEFORE_RACE
    two = (k[at.K_USED, own] & (k[at.K_USED, own] - 1)) != 0
    return fits and (np.isnan(change[USED]) or two == (change[USED] == ONE))


@kernel(inline=True)
def has_neighbours(k, r, own, change):
    """Whether the neighbours that a change names are in the race, could have boxed on the last lap, and no gap asked for is negative."""
    p = k[at.K_PLACE, own]
    ahead, behind = k[at.K_ORDER, max(p - 1, 0)], k[at.K_ORDER, min(p + 1, r[at.R_RUNNING] - 1)]
    fits = np.isnan(change[AHEAD]) or (p > 0 and change[AHEAD] >= ZERO)
    fits &= np.isnan(change[BEHIND]) or (p + 1 < r[at.R_RUNNING] and change[BEHIND] >= ZERO)
    fits &= np.isnan(change[BOXED_AHEAD]) or (p > 0 and r[at.R_LAP] > 0 and k[at.K_STOPPED, ahead] == 0)
    return fits and (np.isnan(change[BOXED_BEHIND]) or (p + 1 < r[at.R_RUNNING] and r[at.R_LAP] > 0 and k[at.K_STOPPED, behind] == 0))


@kernel(inline=True)
def set_status(r, status):
    """Let a track status begin with the coming lap."""
    if r[at.R_STATUS] != status:
        r[at.R_STATUS], r[at.R_SINCE], r[at.R_LEFT] = status, 0, 0 if status == GREEN else CAUTION_LAPS


@kernel(inline=True)
def rewrite_past(f, k, own, change):
    """Edit what only another past could have brought: the age of the set, the compounds used, the sets left."""
    if not np.isnan(change[OLDER]):
        k[at.K_AGE, own] += np.int32(change[OLDER])
        f[at.F_WEAR, own] += change[OLDER]
    if not np.isnan(change[USED]):
        fitted = k[at.K_COMPOUND, own]
        other = HARD if fitted != HARD else MEDIUM
        k[at.K_USED, own] = (1 << fitted) if change[USED] == ONE else (1 << fitted) | (1 << other)
    for c in range(3):
        if not np.isnan(change[SETS + c]):
            k[at.K_SOFT_SETS + c, own] = np.int32(change[SETS + c])


@kernel(inline=True)
def edit_neighbours(fig, context, f, k, r, own, change):
    """Let a neighbour have boxed, then set the gaps. A stop changes the order, so a gap is to the car that is next after it."""
    p = k[at.K_PLACE, own]
    if not np.isnan(change[BOXED_AHEAD]):
        box_rival(fig, context, f, k, r, k[at.K_ORDER, p - 1])
    elif not np.isnan(change[BOXED_BEHIND]):
        box_rival(fig, context, f, k, r, k[at.K_ORDER, p + 1])
    if not np.isnan(change[AHEAD]) and k[at.K_PLACE, own] > 0:
        set_gap_ahead(fig, f, k, own, change[AHEAD])
    if not np.isnan(change[BEHIND]) and k[at.K_PLACE, own] + 1 < r[at.R_RUNNING]:
        set_gap_behind(fig, f, k, r, own, change[BEHIND])


@kernel(inline=True)
def edit_race(fig, context, f, k, r, own, change, calls):
    """Edit a race in place; returns whether the change is feasible. What holds some laps from now is as stated at that time."""
    if not is_feasible(fig, k, r, own, change):
        return False
    limit = fig.whole[at.I_MAX_LAPS_PER_SET] if fig.whole[at.I_MAX_LAPS_PER_SET] > 0 else MAX_SET_LAPS
    limit = max(limit, k[at.K_AGE, own])  # a set that is older already may stay as it is
    rewrite_past(f, k, own, change)
    if not np.isnan(change[LATER]):
        for _ in range(np.int32(change[LATER])):
            add_expected_lap(fig, context, f, k, r, own, np.int32(0))
    elif not np.isnan(change[CALLED]):
        for n in range(np.int32(change[CALLED])):
            add_expected_lap(fig, context, f, k, r, own, np.int32(calls[n]))
    if not np.isnan(change[LOST]):
        lose_time(f, k, r, own, change[LOST])
    if k[at.K_AGE, own] > limit or not has_neighbours(k, r, own, change):
        return False
    edit_neighbours(fig, context, f, k, r, own, change)
    if not np.isnan(change[STATUS]):
        set_status(r, np.int32(change[STATUS]))
    return True


@kernel()
def edit_races(fig, context, f, k, r, own, changes, calls, f1, k1, r1, raw, legal, feasible):
    """Edit a race f, k, r by each of `changes` [N, causes]: raw rows, legal calls, and whether each change is feasible.

    calls: the car's calls lap by lap from now, int8 [N, laps], for changes that follow them.
    f1, k1, r1: memory for the edited races, [N, ...] to keep them all, [1, ...] to keep none.
    """
    for i in range(changes.shape[0]):
        j = min(i, f1.shape[0] - 1)
        copy_race(f, k, r, f1[j], k1[j], r1[j])
        feasible[i] = edit_race(fig, context, f1[j], k1[j], r1[j], own, changes[i], calls[i])
        write_legal(fig.whole, k1[j], r1[j], own, legal[i])
        observe_race(fig.whole, fig.tyres, raw[i], f1[j], k1[j], r1[j], own, context)
