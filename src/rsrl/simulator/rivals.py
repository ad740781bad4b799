"""Rivals that react: each lap every car boxes with the probability with which teams did, and for the compound they took.

The log-odds of boxing are a dot product of coefficients and features (`season.rival_features`); a car boxes where they exceed a draw of
the standard logistic law. Hard rules stand above the model: sets left, two compounds before the flag, laps allowed on a set.
"""

import numpy as np

from rsrl.compiled import kernel
from rsrl.season import GREEN, RED, SC
from rsrl.season.rival_features import MOST_STOPPED, NEAR_S, STOPS_LEVELS, UNDERCUT_S, WINDOW_CARS
from rsrl.simulator import layout as at
from rsrl.simulator import random as rng
from rsrl.simulator.rival_tables import (
    AHEAD_STOPPED,
    BEHIND_STOPPED,
    LIFE_SPREAD,
    MATE_STOPPED,
    NEAR_AHEAD,
    NEAR_BEHIND,
    NEAR_MOST,
    ONE_COMPOUND,
    SAME,
    SC_FIRST,
    SC_LATER,
    SC_ONE_COMPOUND,
    SC_SECOND,
    SECOND,
    STIR_MOST,
    STOP_LOSS,
    T_LAPS,
    T_LIMIT,
    VSC_FIRST,
    VSC_LATER,
    VSC_ONE_COMPOUND,
    WINDOW_OPEN,
    YOUNGEST,
)

ZERO, ONE = np.float32(0.0), np.float32(1.0)
HALF = np.float32(0.5)
SLACK = np.float32(0.001)  # more than rounding can take from a sum of log-odds
SURE = np.float32(1000.0)
HOPELESS = np.float32(-8.2)  # below any draw of the logistic table
FIRST_CALL_LAP = 2
FORCE_LAPS = 1  # so many laps before the flag, at the last chance, a car on one compound is called in
CHOICE_LAPS = 128  # keeps the draws of the three compounds apart
_NEAR, _UNDERCUT, _WINDOW = np.float32(NEAR_S), np.float32(UNDERCUT_S), np.float32(WINDOW_CARS)


def _gumbel_table() -> np.ndarray:
    """Quantiles of the standard extreme-value law at 1,025 points, ends finite."""
    u = np.arange(1025) / 1024
    u[0], u[-1] = 0.3 / 1024, 1 - 0.3 / 1024
    return (-np.log(-np.log(u))).astype(np.float32)


GUMBEL = _gumbel_table()


@kernel(inline="always")
def list_stopped(k):
    """Cars that boxed at the end of the last lap: how many, and which in the first places of the scratch row K_BOX."""
    total = 0
    for car in range(at.CARS):
        if k[at.K_STOPPED, car] == 1:
            k[at.K_BOX, total] = car
            total += 1
    return total


@kernel(inline="always")
def gap_logit(t, f, k, r, car):
    """Log-odds that cars right ahead and right behind add on a racing lap."""
    w = t.singles
    p = k[at.K_PLACE, car]
    mine = f[at.F_TIME, car]
    total = ZERO
    if p > 0:
        gap = mine - f[at.F_TIME, k[at.K_ORDER, p - 1]]
        total += w[NEAR_AHEAD] * max(ONE - gap / _NEAR, ZERO)
    if p + 1 < r[at.R_RUNNING]:
        gap = f[at.F_TIME, k[at.K_ORDER, p + 1]] - mine
        total += w[NEAR_BEHIND] * max(ONE - gap / _NEAR, ZERO)
    return total


@kernel(inline="always")
def undercut_logit(t, f, k, r, car, stopped):
    """Log-odds that the stops of the last lap add on a racing lap: an undercut to cover, one that threatens, an open window."""
    w = t.singles
    loss = t.extra[STOP_LOSS]
    ahead, behind = 0, 0
    for i in range(stopped):
        gap = f[at.F_TIME, np.uint32(k[at.K_BOX, i])] - f[at.F_TIME, np.uint32(car)] - loss
        ahead += (gap < ZERO) & (gap >= -_UNDERCUT)
        behind += (gap >= ZERO) & (gap < _UNDERCUT)
    total = w[AHEAD_STOPPED] * np.float32(min(ahead, MOST_STOPPED)) + w[BEHIND_STOPPED] * np.float32(min(behind, MOST_STOPPED))
    total += w[WINDOW_OPEN] * min(np.float32(stopped) / _WINDOW, ONE)
    mate = t.mates[car]
    if mate >= 0:
        total += w[MATE_STOPPED] * np.float32(k[at.K_STOPPED, mate])
    return total


@kernel(inline="always")
def pace_of_wear(t, key0, key1):
    """How much faster than expected sets are used up in this race: drawn once a race for all cars."""
    z = rng.from_table(rng.draw(key0, key1, 0, at.CARS, rng.BOX), rng.NORMAL)
    return np.exp(z * t.extra[LIFE_SPREAD])


@kernel(inline="always")
def age_cell(k, status, car, laps, wear):
    """Where a car's laps on its set at the end of this lap stand in `RivalTables.age`. In int32 throughout, to be vectorised."""
    made = np.int32(min(k[at.K_STOPS, car], np.int32(STOPS_LEVELS - 1)))
    age = np.float32(np.int32(k[at.K_AGE, car] + 1)) * wear + HALF
    row = np.int32((status * STOPS_LEVELS + made) * 3 + k[at.K_COMPOUND, car])
    return np.int32(row * (laps + 1) + min(np.int32(age), np.int32(laps)))


@kernel(inline="always")
def flag_cell(k, car, lap, laps, wear):
    """Where a car's laps on its set at the flag, without a stop, stand in `RivalTables.reach`."""
    later = np.int32(min(k[at.K_STOPS, car], np.int32(1)))
    at_flag = np.float32(np.int32(k[at.K_AGE, car] + 1 + laps - lap)) * wear + HALF
    row = np.int32(later * 3 + k[at.K_COMPOUND, car])
    return np.int32(row * (2 * laps + 1) + min(np.int32(at_flag), np.int32(2 * laps)))


@kernel(inline="always")
def own_logit(t, k, status, car, lap, wear):
    """Log-odds of boxing from a car's own tyres, the laps left and the track status, less what its lap number adds."""
    laps = t.whole[T_LAPS]
    c = np.uint32(car)
    return t.age[np.uint32(age_cell(k, status, c, laps, wear))] + t.reach[np.uint32(flag_cell(k, c, lap, laps, wear))]


@kernel(inline="always")
def slow_logit(t, r, one):
    """Log-odds that a safety car, full or virtual, adds: dearer to wait the longer it has been out."""
    w = t.singles
    since = r[at.R_SINCE]
    if r[at.R_STATUS] == SC:
        first = w[SC_FIRST] if since == 0 else (w[SC_SECOND] if since == 1 else w[SC_LATER])
        return first + one * w[SC_ONE_COMPOUND]
    return (w[VSC_FIRST] if since == 0 else w[VSC_LATER]) + one * w[VSC_ONE_COMPOUND]


@kernel(inline="always")
def boxes(t, f, k, r, car, lap, stopped, wear, key0, key1):
    """Whether the model calls a car in at the end of this lap."""
    status = r[at.R_STATUS]
    w = t.singles
    left = np.float32(t.whole[T_LAPS] - lap) * wear + HALF
    logit = own_logit(t, k, status, car, lap, wear)
    logit += t.left[np.uint32(status), np.uint32(min(np.int32(left), t.whole[T_LAPS]))]
    used = k[at.K_USED, car]
    one = np.float32((used & (used - 1)) == 0)
    logit += one * w[ONE_COMPOUND]
    if status != GREEN:
        if k[at.K_AGE, car] < at.MIN_STINT_LAPS:
            return False
        return rng.from_table(rng.draw(key0, key1, lap, car, rng.BOX), rng.LOGISTIC) < logit + slow_logit(t, r, one)
    most = logit + w[NEAR_MOST] + (w[STIR_MOST] if stopped > 0 else ZERO)
    if most < HOPELESS:
        return False
    luck = rng.from_table(rng.draw(key0, key1, lap, car, rng.BOX), rng.LOGISTIC)
    if luck >= most:  # mostly: what goes on around need not be looked at
        return False
    if stopped > 0:
        logit += undercut_logit(t, f, k, r, car, stopped)
    return luck < logit + gap_logit(t, f, k, r, car)


@kernel(inline="always")
def chosen_set(t, k, car, lap, must, key0, key1):
    """The compound a team would take, by utility with extreme-value luck; -1 without a set. `must`: only one not used yet, if there is."""
    used = k[at.K_USED, car]
    one = (used & (used - 1)) == 0
    best, best_utility, best_rank = -1, ZERO, -1
    for compound in range(3):
        if k[at.K_SOFT_SETS + compound, car] <= 0:
            continue
        new = ((used >> compound) & 1) == 0
        rank = 1 if new or not must else 0
        luck = rng.from_table(rng.draw(key0, key1, lap + CHOICE_LAPS * compound, car, rng.CHOOSE), GUMBEL)
        utility = t.choice[compound, t.whole[T_LAPS] - lap] + luck
        if compound == k[at.K_COMPOUND, car]:
            utility += t.extra[SAME]
        if new and one:
            utility += t.extra[SECOND]
        if rank > best_rank or (rank == best_rank and utility > best_utility):
            best, best_utility, best_rank = compound, utility, rank
    return best


@kernel(inline="always")
def reaches_flag(t, k, car, lap):
    """Whether the sets left reach the flag from here where a set may run so many laps only."""
    limit = t.whole[T_LIMIT]
    sets = k[at.K_SOFT_SETS, car] + k[at.K_SOFT_SETS + 1, car] + k[at.K_SOFT_SETS + 2, car]
    return limit == 0 or limit * sets >= t.whole[T_LAPS] - lap


@kernel(inline="always")
def imitated_call(t, f, k, r, car, lap, stopped, wear, key0, key1):
    """What a team would do with a car on this lap: the compound to box for at its end, -1 to stay out.

    Under a red flag every set that has run is changed, since it costs nothing.
    """
    last = lap >= t.whole[T_LAPS] - FORCE_LAPS
    limit = t.whole[T_LIMIT]
    used = k[at.K_USED, car]
    must = (last and (used & (used - 1)) == 0) or (limit > 0 and k[at.K_AGE, car] + 1 >= limit)
    if not must:
        if r[at.R_STATUS] == RED:
            if k[at.K_AGE, car] < at.MIN_STINT_LAPS:
                return -1
        elif lap < FIRST_CALL_LAP or not boxes(t, f, k, r, car, lap, stopped, wear, key0, key1):
            return -1
        if not reaches_flag(t, k, car, lap):
            return -1
    one = (used & (used - 1)) == 0
    sets = k[at.K_SOFT_SETS, car] + k[at.K_SOFT_SETS + 1, car] + k[at.K_SOFT_SETS + 2, car]
    last_set = one and (last or sets == 1 or (limit > 0 and limit * (sets - 1) < t.whole[T_LAPS] - lap))
    return chosen_set(t, k, car, lap, last_set, key0, key1)


@kernel(inline="always")
def logit_upper_bounds(t, f, k, r, lap, key0, key1):
    """F_RAW: by how much a car's log-odds of boxing may exceed its luck, its stops and rivals' stops of the last lap left out.

    One pass over all cars without branches. The luck is that of `boxes`, which has the last word on whoever comes out above zero.
    """
    w, laps, status, wear = t.singles, t.whole[T_LAPS], r[at.R_STATUS], f[at.F_USE, 0]
    first = rng.counter(lap, 0, rng.BOX)
    for car in range(at.CARS):
        k[at.K_BITS, car] = np.int32(rng.bits(key0, key1, np.uint32(first + np.uint32(car) * rng.PER_CAR)))
    for car in range(at.CARS):
        k[at.K_AGE_CELL, car] = age_cell(k, status, car, laps, wear)
        k[at.K_FLAG_CELL, car] = flag_cell(k, car, lap, laps, wear)
    for p in range(r[at.R_RUNNING]):  # by place, so that it is not vectorised: see `free_air`
        c = np.uint32(k[at.K_ORDER, p])
        luck = rng.from_table(np.uint32(k[at.K_BITS, c]), rng.LOGISTIC)
        f[at.F_RAW, c] = t.age[np.uint32(k[at.K_AGE_CELL, c])] + t.reach[np.uint32(k[at.K_FLAG_CELL, c])] - luck
    left = np.float32(laps - lap) * wear + HALF
    rest = t.left[np.uint32(status), np.uint32(min(np.int32(left), laps))] + SLACK
    single = w[ONE_COMPOUND]
    if status == GREEN:
        rest += w[NEAR_MOST]
    else:
        rest += slow_logit(t, r, ZERO)
        single += slow_logit(t, r, ONE) - slow_logit(t, r, ZERO)
    last = lap >= laps - FORCE_LAPS
    limit = t.whole[T_LIMIT] if t.whole[T_LIMIT] > 0 else at.NO_STOP
    for car in range(at.CARS):
        one = (k[at.K_USED, car] & (k[at.K_USED, car] - 1)) == 0
        must = (one & last) | (k[at.K_AGE, car] + 1 >= limit)
        f[at.F_RAW, car] += rest + (single if one else ZERO) + (SURE if must else ZERO)


@kernel(inline="always")
def add_stops(t, f, k, stopped):
    """Add to F_RAW what the stops of the last lap, which stand in K_BOX, add to the log-odds: `undercut_logit`, for all cars at once."""
    w = t.singles
    loss = t.extra[STOP_LOSS]
    ahead, behind = max(w[AHEAD_STOPPED], ZERO), max(w[BEHIND_STOPPED], ZERO)
    window = max(w[WINDOW_OPEN] * min(np.float32(stopped) / _WINDOW, ONE), ZERO)
    for i in range(stopped):
        stopper = np.uint32(k[at.K_BOX, i])
        time = f[at.F_TIME, stopper]
        for car in range(at.CARS):
            gap = time - f[at.F_TIME, car] - loss
            f[at.F_RAW, car] += ahead if (gap < ZERO) & (gap >= -_UNDERCUT) else ZERO
            f[at.F_RAW, car] += behind if (gap >= ZERO) & (gap < _UNDERCUT) else ZERO
        mate = t.mates[stopper]
        if mate >= 0:
            f[at.F_RAW, mate] += max(w[MATE_STOPPED], ZERO)
    for car in range(at.CARS):
        f[at.F_RAW, car] += window


@kernel(inline="always")
def list_chances(f, k, r):
    """K_BITS: the running reactive cars that may box; returns how many. Without branches, as nobody can predict them."""
    chances = np.int32(0)
    everyone = r[at.R_STATUS] == RED
    for p in range(r[at.R_RUNNING]):
        car = k[at.K_ORDER, p]
        k[at.K_BITS, chances] = car
        chances += np.int32((k[at.K_CALLER, car] == at.REACTIVE) & (everyone | (f[at.F_RAW, car] > ZERO)))
    return chances


@kernel(inline="always")
def too_early(t, f, r, lap):
    """Whether this is one of the first racing laps, on which no set is old enough to come off."""
    ruled = t.whole[T_LIMIT] > 0 or lap >= t.whole[T_LAPS] - FORCE_LAPS
    return r[at.R_STATUS] == GREEN and not ruled and np.float32(lap) * f[at.F_USE, 0] + HALF < t.extra[YOUNGEST]


@kernel()
def call_reactive(t, f, k, r, lap, key0, key1):
    """Fill K_WANT of the cars whose caller is REACTIVE; returns how many box. `t`: `RivalTables`, small enough to hand over."""
    if too_early(t, f, r, lap):
        return 0
    stopped = list_stopped(k)
    if r[at.R_STATUS] != RED:
        logit_upper_bounds(t, f, k, r, lap, key0, key1)
        if r[at.R_STATUS] == GREEN and stopped > 0:
            add_stops(t, f, k, stopped)
    boxing = 0
    for i in range(list_chances(f, k, r)):
        car = k[at.K_BITS, i]
        want = imitated_call(t, f, k, r, car, lap, stopped, f[at.F_USE, 0], key0, key1)
        k[at.K_WANT, car] = want
        boxing += want >= 0
    return boxing


@kernel()
def imitate_rows(t, f, k, r, car, seed, races, calls):
    """Calls int8 [n] (0 stay, 1 + compound) of the model for one car of every race of a batch, with luck of `seed` and race numbers."""
    for i in range(f.shape[0]):
        key0, key1 = rng.race_keys(seed, races[i])
        lap = r[i, 0] + 1
        calls[i] = 0
        if lap < t.whole[T_LAPS]:
            calls[i] = 1 + imitated_call(t, f[i], k[i], r[i], car, lap, list_stopped(k[i]), pace_of_wear(t, key0, key1), key0, key1)
