"""Rivals that react, compiled: each lap every car boxes with the probability with which teams did, and for the compound they took.

A logistic regression: the log-odds of boxing are a dot product of coefficients and features (`season.rival_features`), and a car boxes if
they exceed a draw of the standard logistic law. The compound is a multinomial logit. The rules override the model: sets left, two
compounds before the flag, laps allowed on a set.

Most cars stay out on most laps, so a lap costs one pass over all cars without branches (`logit_upper_bounds`) that finds the few that
may box; `imitated_call` decides those exactly, on the same draws. `t` is `RivalTables`, in which all that depends on tyres and laps alone
has been computed before the race. `use` is the race's factor on the laps that a set is taken to have run (`draw_use`).
"""

import numpy as np

from rsrl.compiled import kernel
from rsrl.season import GREEN, RED, SC
from rsrl.season.rival_features import MOST_STOPPED, NEAR_S, STOPS_LEVELS, UNDERCUT_S, WINDOW_CARS
from rsrl.simulator import layout as at
from rsrl.simulator import random as rng
from rsrl.simulator import rival_tables as rt
from rsrl.simulator.tyres import stint_laps

ZERO, ONE = np.float32(0.0), np.float32(1.0)
HALF = np.float32(0.5)
SLACK = np.float32(0.001)  # more than rounding can take from a sum of log-odds
SURE = np.float32(1000.0)
HOPELESS = np.float32(-8.2)  # below any draw of the logistic table
FIRST_CALL_LAP = 2
FORCE_LAPS = 1  # laps before the flag at which a car that has run on one compound only is called in: its last chance
CHOICE_LAPS = 128  # more than any race has: keeps the draws of the three compounds apart
_NEAR, _UNDERCUT, _WINDOW = np.float32(NEAR_S), np.float32(UNDERCUT_S), np.float32(WINDOW_CARS)


def _gumbel_table() -> np.ndarray:
    """Quantiles of the standard extreme-value law at 1,025 points, ends finite."""
    u = np.arange(1025) / 1024
    u[0], u[-1] = 0.3 / 1024, 1 - 0.3 / 1024
    return (-np.log(-np.log(u))).astype(np.float32)


GUMBEL = _gumbel_table()


@kernel(inline=True)
def list_stopped(k):
    """Number of cars that boxed at the end of the last lap; their list goes into the scratch row K_BOX."""
    total = 0
    for car in range(at.CARS):
        if k[at.K_STOPPED, car] == 1:
            k[at.K_BOX, total] = car
            total += 1
    return total


@kernel(inline=True)
def gap_logit(t, f, k, r, car):
    """Log-odds added on a racing lap by cars right ahead and right behind, fading linearly with the gap."""
    w = t.singles
    p = k[at.K_PLACE, car]
    mine = f[at.F_TIME, car]
    total = ZERO
    if p > 0:
        gap = mine - f[at.F_TIME, k[at.K_ORDER, p - 1]]
        total += w[rt.NEAR_AHEAD] * max(ONE - gap / _NEAR, ZERO)
    if p + 1 < r[at.R_RUNNING]:
        gap = f[at.F_TIME, k[at.K_ORDER, p + 1]] - mine
        total += w[rt.NEAR_BEHIND] * max(ONE - gap / _NEAR, ZERO)
    return total


@kernel(inline=True)
def undercut_logit(t, f, k, r, car, stopped):
    """Log-odds added on a racing lap by the stops of the last lap: cars to cover, undercuts that threaten, an open pit window."""
    w = t.singles
    loss = t.extra[rt.STOP_LOSS]
    ahead, behind = 0, 0
    # a car that stopped has the loss in its race time: without it, was it ahead of this car or behind?
    for i in range(stopped):
        gap = f[at.F_TIME, np.uint32(k[at.K_BOX, i])] - f[at.F_TIME, np.uint32(car)] - loss
        ahead += (gap < ZERO) & (gap >= -_UNDERCUT)
        behind += (gap >= ZERO) & (gap < _UNDERCUT)
    total = w[rt.AHEAD_STOPPED] * np.float32(min(ahead, MOST_STOPPED)) + w[rt.BEHIND_STOPPED] * np.float32(min(behind, MOST_STOPPED))
    total += w[rt.WINDOW_OPEN] * min(np.float32(stopped) / _WINDOW, ONE)
    mate = t.mates[car]
    if mate >= 0:
        total += w[rt.MATE_STOPPED] * np.float32(k[at.K_STOPPED, mate])
    return total


@kernel(inline=True)
def draw_use(t, key0, key1):
    """F_USE: factor on the laps that a set is taken to have run. Drawn once a race, as tyres last longer or shorter for the whole field."""
    z = rng.from_table(rng.draw(key0, key1, 0, rng.FIELD, rng.BOX), rng.NORMAL)
    return np.exp(z * t.extra[rt.LIFE_SPREAD])


@kernel(inline=True)
def age_cell(k, status, car, laps, use):
    """Index into `RivalTables.age` by a car's laps on its set at the end of this lap."""
    # int32 throughout: an int64 in between would halve the width of the vectors that the loop over cars is compiled to
    made = np.int32(min(k[at.K_STOPS, car], np.int32(STOPS_LEVELS - 1)))
    age = np.float32(np.int32(k[at.K_AGE, car] + 1)) * use + HALF
    row = np.int32((status * STOPS_LEVELS + made) * 3 + k[at.K_COMPOUND, car])
    return np.int32(row * (laps + 1) + min(np.int32(age), np.int32(laps)))


@kernel(inline=True)
def flag_cell(k, car, lap, laps, use):
    """Index into `RivalTables.reach` by a car's laps on its set at the flag if it does not stop again."""
    later = np.int32(min(k[at.K_STOPS, car], np.int32(1)))
    at_flag = np.float32(np.int32(k[at.K_AGE, car] + 1 + laps - lap)) * use + HALF
    row = np.int32(later * 3 + k[at.K_COMPOUND, car])
    return np.int32(row * (2 * laps + 1) + min(np.int32(at_flag), np.int32(2 * laps)))


@kernel(inline=True)
def own_logit(t, k, status, car, lap, use):
    """Log-odds of boxing from a car's own tyres under this track status."""
    laps = t.whole[rt.W_LAPS]
    c = np.uint32(car)
    return t.age[np.uint32(age_cell(k, status, c, laps, use))] + t.reach[np.uint32(flag_cell(k, c, lap, laps, use))]


@kernel(inline=True)
def slow_logit(t, r, one):
    """Log-odds added by a safety car, full or virtual, by how long it has been out. `one`: 1 for a car on one compound so far."""
    w = t.singles
    since = r[at.R_SINCE]
    if r[at.R_STATUS] == SC:
        first = w[rt.SC_FIRST] if since == 0 else (w[rt.SC_SECOND] if since == 1 else w[rt.SC_LATER])
        return first + one * w[rt.SC_ONE_COMPOUND]
    return (w[rt.VSC_FIRST] if since == 0 else w[rt.VSC_LATER]) + one * w[rt.VSC_ONE_COMPOUND]


@kernel(inline=True)
def boxes(t, f, k, r, car, lap, stopped, use, key0, key1):
    """Whether the model calls a car in at the end of this lap."""
    status = r[at.R_STATUS]
    w = t.singles
    left = np.float32(t.whole[rt.W_LAPS] - lap) * use + HALF
    logit = own_logit(t, k, status, car, lap, use)
    logit += t.left[np.uint32(status), np.uint32(min(np.int32(left), t.whole[rt.W_LAPS]))]
    used = k[at.K_USED, car]
    one = np.float32((used & (used - 1)) == 0)
    logit += one * w[rt.ONE_COMPOUND]
    if status != GREEN:  # features of pressure from other cars count on racing laps only
        if stint_laps(k, car) < at.MIN_STINT_LAPS:
            return False
        return rng.from_table(rng.draw(key0, key1, lap, car, rng.BOX), rng.LOGISTIC) < logit + slow_logit(t, r, one)
    # the draw is compared with an upper bound first: on most laps the answer is no, whatever the cars around do
    most = logit + w[rt.NEAR_MOST] + (w[rt.STOPS_MOST] if stopped > 0 else ZERO)
    if most < HOPELESS:
        return False
    luck = rng.from_table(rng.draw(key0, key1, lap, car, rng.BOX), rng.LOGISTIC)
    if luck >= most:
        return False
    if stopped > 0:
        logit += undercut_logit(t, f, k, r, car, stopped)
    return luck < logit + gap_logit(t, f, k, r, car)


@kernel(inline=True)
def chosen_set(t, k, car, lap, must, key0, key1):
    """The compound a team would take; -1 if no set is left. `must`: only a compound not used yet, if there is one."""
    # the largest of utilities plus Gumbel draws: a draw from the multinomial logit with these utilities
    used = k[at.K_USED, car]
    one = (used & (used - 1)) == 0
    best, best_utility, best_rank = -1, ZERO, -1
    for compound in range(3):
        if k[at.K_SOFT_SETS + compound, car] <= 0:
            continue
        new = ((used >> compound) & 1) == 0
        # with `must`, a used compound is taken only if no unused one is left: the rank comes before the utility
        rank = 1 if new or not must else 0
        luck = rng.from_table(rng.draw(key0, key1, lap + CHOICE_LAPS * compound, car, rng.CHOOSE), GUMBEL)
        utility = t.choice[compound, t.whole[rt.W_LAPS] - lap] + luck
        if compound == k[at.K_COMPOUND, car]:
            utility += t.extra[rt.SAME]
        if new and one:
            utility += t.extra[rt.SECOND]
        if rank > best_rank or (rank == best_rank and utility > best_utility):
            best, best_utility, best_rank = compound, utility, rank
    return best


@kernel(inline=True)
def reaches_flag(t, k, car, lap):
    """Whether the sets left reach the flag from here, where the laps on a set are limited."""
    limit = t.whole[rt.W_LIMIT]
    sets = k[at.K_SOFT_SETS, car] + k[at.K_SOFT_SETS + 1, car] + k[at.K_SOFT_SETS + 2, car]
    return limit == 0 or limit * sets >= t.whole[rt.W_LAPS] - lap


@kernel(inline=True)
def stops_due(t, lap):
    """A car that has made so many stops or fewer must box on every lap left to use as many sets as the race asks for; negative: none."""
    return np.int32(t.whole[rt.W_STOPS_ASKED] - (t.whole[rt.W_LAPS] - np.int32(lap)))


@kernel(inline=True)
def imitated_call(t, f, k, r, car, lap, stopped, use, key0, key1):
    """What a team would do with a car on this lap: the compound to box for at its end, -1 to stay out."""
    last = lap >= t.whole[rt.W_LAPS] - FORCE_LAPS
    limit = t.whole[rt.W_LIMIT]
    used = k[at.K_USED, car]
    # rules before the model: the last chance for the second compound or for another set, and the limit on laps a set
    must = (last and (used & (used - 1)) == 0) or (limit > 0 and k[at.K_AGE, car] + 1 >= limit) or k[at.K_STOPS, car] <= stops_due(t, lap)
    if not must:
        if r[at.R_STATUS] == RED:  # a change is free: every set that has run is changed
            if stint_laps(k, car) < at.MIN_STINT_LAPS:
                return -1
        elif lap < FIRST_CALL_LAP or not boxes(t, f, k, r, car, lap, stopped, use, key0, key1):
            return -1
        if not reaches_flag(t, k, car, lap):
            return -1
    one = (used & (used - 1)) == 0
    sets = k[at.K_SOFT_SETS, car] + k[at.K_SOFT_SETS + 1, car] + k[at.K_SOFT_SETS + 2, car]
    # the second compound can wait no longer: this stop is the last, or the last that leaves enough sets
    last_set = one and (last or sets == 1 or (limit > 0 and limit * (sets - 1) < t.whole[rt.W_LAPS] - lap))
    return chosen_set(t, k, car, lap, last_set, key0, key1)


@kernel(inline=True)
def logit_upper_bounds(t, f, k, r, lap, key0, key1):
    """F_RAW: the most by which a car's log-odds of boxing can exceed its logistic draw; stops of the last lap are left to `add_stops`.

    The draw is that of `boxes`, which decides on every car that comes out above zero.
    """
    w, laps, status, use = t.singles, t.whole[rt.W_LAPS], r[at.R_STATUS], f[at.F_USE, 0]
    first = rng.counter(lap, 0, rng.BOX)
    for car in range(at.CARS):
        k[at.K_BITS, car] = np.int32(rng.bits(key0, key1, np.uint32(first + np.uint32(car) * rng.PER_CAR)))
    for car in range(at.CARS):
        k[at.K_AGE_CELL, car] = age_cell(k, status, car, laps, use)
        k[at.K_FLAG_CELL, car] = flag_cell(k, car, lap, laps, use)
    for p in range(r[at.R_RUNNING]):  # by place, so that it is not vectorised: see `lap_time.free_air`
        c = np.uint32(k[at.K_ORDER, p])
        luck = rng.from_table(np.uint32(k[at.K_BITS, c]), rng.LOGISTIC)
        f[at.F_RAW, c] = t.age[np.uint32(k[at.K_AGE_CELL, c])] + t.reach[np.uint32(k[at.K_FLAG_CELL, c])] - luck
    # what is the same for all cars is added once; the slack keeps a sum in another order from falling below the exact one
    left = np.float32(laps - lap) * use + HALF
    rest = t.left[np.uint32(status), np.uint32(min(np.int32(left), laps))] + SLACK
    single = w[rt.ONE_COMPOUND]
    if status == GREEN:
        rest += w[rt.NEAR_MOST]
    else:
        rest += slow_logit(t, r, ZERO)
        single += slow_logit(t, r, ONE) - slow_logit(t, r, ZERO)
    last = lap >= laps - FORCE_LAPS
    limit = t.whole[rt.W_LIMIT] if t.whole[rt.W_LIMIT] > 0 else at.NO_STOP
    due = stops_due(t, lap)
    for car in range(at.CARS):
        one = (k[at.K_USED, car] & (k[at.K_USED, car] - 1)) == 0
        must = (one & last) | (k[at.K_AGE, car] + 1 >= limit) | (k[at.K_STOPS, car] <= due)
        f[at.F_RAW, car] += rest + (single if one else ZERO) + (SURE if must else ZERO)


@kernel(inline=True)
def add_stops(t, f, k, stopped):
    """Add to F_RAW the most that the stops of the last lap, listed in K_BOX, add to the log-odds: `undercut_logit` for all cars at once."""
    w = t.singles
    loss = t.extra[rt.STOP_LOSS]
    # an upper bound: negative coefficients count as zero, and more than MOST_STOPPED cars may count
    ahead, behind = max(w[rt.AHEAD_STOPPED], ZERO), max(w[rt.BEHIND_STOPPED], ZERO)
    window = max(w[rt.WINDOW_OPEN] * min(np.float32(stopped) / _WINDOW, ONE), ZERO)
    for i in range(stopped):
        stopper = np.uint32(k[at.K_BOX, i])
        time = f[at.F_TIME, stopper]
        for car in range(at.CARS):
            gap = time - f[at.F_TIME, car] - loss
            f[at.F_RAW, car] += ahead if (gap < ZERO) & (gap >= -_UNDERCUT) else ZERO
            f[at.F_RAW, car] += behind if (gap >= ZERO) & (gap < _UNDERCUT) else ZERO
        mate = t.mates[stopper]
        if mate >= 0:
            f[at.F_RAW, mate] += max(w[rt.MATE_STOPPED], ZERO)
    for car in range(at.CARS):
        f[at.F_RAW, car] += window


@kernel(inline=True)
def list_chances(f, k, r):
    """K_BITS: the running reactive cars that may box; returns how many. Without branches, as in `stops.list_stops`."""
    chances = np.int32(0)
    everyone = r[at.R_STATUS] == RED
    for p in range(r[at.R_RUNNING]):
        car = k[at.K_ORDER, p]
        k[at.K_BITS, chances] = car
        chances += np.int32((k[at.K_CALLER, car] == at.REACTIVE) & (everyone | (f[at.F_RAW, car] > ZERO)))
    return chances


@kernel(inline=True)
def too_early(t, f, r, lap):
    """Whether this is one of the first racing laps, on which no team changes a set."""
    ruled = t.whole[rt.W_LIMIT] > 0 or lap >= t.whole[rt.W_LAPS] - max(FORCE_LAPS, t.whole[rt.W_STOPS_ASKED])
    return r[at.R_STATUS] == GREEN and not ruled and np.float32(lap) * f[at.F_USE, 0] + HALF < t.extra[rt.YOUNGEST]


@kernel()
def call_reactive(t, f, k, r, lap, key0, key1):
    """Fill K_WANT of the cars whose caller is REACTIVE; returns how many box."""
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
    """Calls int8 [n] (0 stay out, 1 + compound) of the model for one car of every race of a batch, on draws of `seed` and race numbers."""
    for i in range(f.shape[0]):
        key0, key1 = rng.race_keys(seed, races[i])
        lap = r[i, at.R_LAP] + 1
        calls[i] = 0
        if lap < t.whole[rt.W_LAPS]:
            calls[i] = 1 + imitated_call(t, f[i], k[i], r[i], car, lap, list_stopped(k[i]), draw_use(t, key0, key1), key0, key1)
