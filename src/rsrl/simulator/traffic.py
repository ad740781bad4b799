"""Traffic on a racing lap, compiled: who is held up, who passes, who is lapped."""

import numpy as np

from rsrl.compiled import kernel
from rsrl.simulator import layout as at
from rsrl.simulator import random as rng

NEVER = np.float32(-1.0e9)
FAR = np.float32(1.0e9)
ZERO = np.float32(0.0)
ONE = np.float32(1.0)
LAPPED_MARGIN_S = np.float32(5.0)  # a car this close to being lapped may be lapped on the coming lap


@kernel(inline=True)
def wave_blue_flags(fig, f, k, n):
    """Add to F_RAW what lapped cars, and the cars that lap them, lose on the laps on which it happens."""
    base = fig.track[at.T_BASE]
    per_base = ONE / base
    blue, lapping = fig.track[at.T_BLUE], fig.track[at.T_LAPPING]
    lap_down = f[at.F_TIME, k[at.K_ORDER, 0]] + base - LAPPED_MARGIN_S
    # from the last car forward, until one is too close to the leader to be lapped on this lap
    for p in range(n - 1, 0, -1):
        lapped = k[at.K_ORDER, p]
        time = f[at.F_TIME, lapped]
        if time < lap_down:
            return
        raw = f[at.F_RAW, lapped]
        times = 0
        # Race times are a lap apart where cars meet on the track: a car laps this one when the gap, in laps, passes a whole number.
        # All cars and no branch, so that the loop is vectorised; those behind have before < 0.
        for car in range(at.CARS):
            before = (time - f[at.F_TIME, car]) * per_base
            after = before + (raw - f[at.F_RAW, car]) * per_base
            laps_it = (before > ZERO) & (after >= np.floor(before) + ONE)
            times += np.int32(laps_it)
            f[at.F_RAW, car] += lapping if laps_it else ZERO
        f[at.F_RAW, lapped] += blue * np.float32(times)


@kernel(inline=True)
def race_traffic(fig, f, k, r):
    """Cars cross the line from the front: one that reaches the car ahead passes it or is held behind it.

    Fills F_GAP, F_LAP and F_TIME; F_RAW is each car's free lap.
    """
    if fig.track[at.T_PASS_GAP] > ZERO:
        race_duels(fig, f, k, r)
    else:
        race_at_once(fig, f, k, r)


@kernel(inline=True)
def race_duels(fig, f, k, r):
    """Each car meets the last car in front of it on the road, passed ones included, and passes it or is held behind it.

    A car passes if its pace advantage exceeds a logistic draw about `pass_threshold_s`, which rises with the gap at the start of the lap:
    one that starts the lap further back has less of it left when it arrives. The pass costs both cars time. A car that does not pass
    crosses the line `following_gap_s` behind. So nobody passes two cars on one lap by one draw, and a car that has been passed can be
    passed by the next car only with a draw of its own.
    """
    # One sweep suffices, since the car in front of the next one is known when its turn comes: it is the one just passed, or the one
    # whose turn it was. No branches, because who passes is what a processor cannot predict: both outcomes are computed and one chosen.
    t = fig.track
    # copies, since the compiler cannot know that the stores below leave the figures alone
    dirty, dirty_window, drs, follow = t[at.T_DIRTY], t[at.T_DIRTY_WINDOW], t[at.T_DRS], t[at.T_FOLLOW]
    threshold, scale, pass_loss, passed_loss = t[at.T_PASS], t[at.T_PASS_SCALE], t[at.T_PASS_LOSS], t[at.T_PASSED_LOSS]
    per_gap = t[at.T_PASS_GAP]
    dirty_slope = dirty / dirty_window
    drs_window = t[at.T_DRS_WINDOW]
    if r[at.R_NO_DRS] > 0:
        drs_window = NEVER
    # the car in front on the road: where it started the lap, its free lap, where it would cross the line as things stand
    front = np.uint32(k[at.K_ORDER, 0])
    front_start = f[at.F_TIME, front]
    front_raw = f[at.F_RAW, front]
    front_crossing = front_start + front_raw
    f[at.F_GAP, front] = front_start - NEVER
    settled = NEVER  # crossing of the car in front of that one, the last that nobody behind can change
    ahead_start = front_start
    for p in range(1, r[at.R_RUNNING]):
        car = np.uint32(k[at.K_ORDER, p])
        start = f[at.F_TIME, car]
        gap = start - ahead_start
        f[at.F_GAP, car] = gap
        raw = f[at.F_RAW, car] + max(dirty - gap * dirty_slope, ZERO)
        raw -= drs if gap < drs_window else ZERO
        # the bits of the lap's noise with their halves swapped: a second draw that costs no hashing
        luck = scale * rng.from_table(rng.other_end(np.uint32(k[at.K_BITS, car])), rng.LOGISTIC)
        needed = threshold + luck + per_gap * (start - front_start - follow)
        free = start + raw
        held = front_crossing + follow
        past = max(free + pass_loss, settled + follow)
        tries = free if front_raw - raw > needed else FAR
        passes = tries < held  # the one comparison that waits for the car before
        queued = max(free, held)
        # a pass settles the passing car and leaves the passed one in front of the next car; else it is the other way round
        done = car if passes else front
        done_start = start if passes else front_start
        settled = past if passes else front_crossing
        front_crossing = max(front_crossing + passed_loss, past + follow) if passes else queued
        front = front if passes else car
        front_start = front_start if passes else start
        front_raw = front_raw if passes else raw
        f[at.F_LAP, done] = settled - done_start
        f[at.F_TIME, done] = settled
        ahead_start = start
    f[at.F_LAP, front] = front_crossing - front_start
    f[at.F_TIME, front] = front_crossing


@kernel(inline=True)
def race_at_once(fig, f, k, r):
    """The rule of season files without `pass_per_gap`: a car is compared with the one that started the lap ahead of it, and no other.

    A car passes if its pace advantage over the car ahead exceeds a logistic draw about `pass_threshold_s`; the pass costs both cars
    time. A car that does not crosses the line `following_gap_s` behind.
    """
    # One sweep suffices: a car can only be held up by cars in front of it, whose crossings are known when its turn comes. After a pass
    # the next car is held up by whichever of the two crosses later, hence `latest`.
    # The sweep has no branches, because who is held up is what a processor cannot predict; both outcomes are computed and one chosen.
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
        # the bits of the lap's noise with their halves swapped: a second draw that costs no hashing
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
        # The car ahead is settled one turn late, when it is known whether it was passed. On the first turn `ahead` is the leader
        # itself: its F_TIME must stay, and what is written to F_LAP is written over on the next turn.
        settled = ahead_crossing + (passed_loss if passes else ZERO)
        f[at.F_LAP, ahead] = settled - ahead_start
        f[at.F_TIME, ahead] = settled if p > 0 else start
        ahead = car
        ahead_start = start
        ahead_raw = raw
        ahead_crossing = crossing
    f[at.F_LAP, ahead] = ahead_crossing - ahead_start
    f[at.F_TIME, ahead] = ahead_crossing
