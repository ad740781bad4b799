"""One lap of the race, compiled. Reads parameters from `fig`, changes only the race's own arrays f, k and r.

A lap, in order: retirements; who stops at its end; every car's time in free air; blue flags; traffic from the front
to the back; the stops; the new order; the track status of the next lap, which the next decisions may know.
Times of cars are relative to the race's reference clock, because float32 holds 5600 s only to half a millisecond.
"""

import numpy as np

from rsrl.compiled import kernel
from rsrl.season import GREEN, SC, VSC
from rsrl.simulator import random as rng
from rsrl.simulator.layout import (
    C_NOISE,
    C_STOP,
    CARS,
    F_COLD,
    F_GAP,
    F_LAP,
    F_LINEAR,
    F_NEEDED,
    F_OFFSET,
    F_PACE,
    F_QUADRATIC,
    F_RAW,
    F_TIME,
    F_WEAR,
    I_LAPS,
    I_MAX_LAPS_PER_SET,
    K_AGE,
    K_BITS,
    K_COMPOUND,
    K_NEXT,
    K_ORDER,
    K_PLACE,
    K_PLAN,
    K_POINTER,
    K_RETIRE,
    K_SOFT_SETS,
    K_STOPPED,
    K_STOPS,
    K_USED,
    K_WANT,
    NO_STOP,
    P_FIRST,
    P_SC_WINDOW,
    P_STOPS,
    P_VSC_WINDOW,
    R_CLOCK_MS,
    R_FLAGGED,
    R_KEY0,
    R_KEY1,
    R_LAP,
    R_LEFT,
    R_RETIREMENT,
    R_RUNNING,
    R_SC_LAPS,
    R_SINCE,
    R_STATUS,
    R_VSC_LAPS,
    T_BASE,
    T_BLUE,
    T_DIRTY,
    T_DIRTY_WINDOW,
    T_DRS,
    T_DRS_WINDOW,
    T_FOLLOW,
    T_FUEL,
    T_JITTER,
    T_LAPPING,
    T_PASS,
    T_PASS_LOSS,
    T_PASS_SCALE,
    T_PIT,
    T_REACT_SC,
    T_REACT_VSC,
    T_SC,
    T_SC_CATCH,
    T_SC_FACTOR,
    T_SC_GAP,
    T_SC_LAP1,
    T_START,
    T_START_SD,
    T_VSC,
    T_VSC_FACTOR,
    T_WEAR_SC,
    T_WEAR_VSC,
    Y_COLD,
    Y_LINEAR,
    Y_OFFSET,
    Y_QUADRATIC,
)

OUT = np.float32(1.0e6)  # race time of a car that has retired; later retirements stand ahead of earlier ones
NEVER = np.float32(-1.0e9)
ZERO = np.float32(0.0)
ONE = np.float32(1.0)
HALF = np.float32(0.5)
THOUSAND = np.float32(1000.0)
MIN_STINT_LAPS = 2
LAPPED_MARGIN_S = np.float32(5.0)  # a car this close to being lapped may be lapped on the coming lap
DRS_FIRST_LAP = 3  # sporting regulations 2022-23: DRS from lap 3, and two laps after a restart


@kernel(inline="always")
def fit_tyre(fig, f, k, car, compound):  # type: ignore[no-untyped-def]
    """Put a new set of a compound on a car: figures, age, sets left, compounds used."""
    f[F_OFFSET, car] = fig.tyres[compound, Y_OFFSET]
    f[F_LINEAR, car] = fig.tyres[compound, Y_LINEAR]
    f[F_QUADRATIC, car] = fig.tyres[compound, Y_QUADRATIC]
    f[F_WEAR, car] = ZERO
    k[K_COMPOUND, car] = compound
    k[K_AGE, car] = 0
    k[K_USED, car] |= 1 << compound
    k[K_SOFT_SETS + compound, car] -= 1


@kernel(inline="always")
def load_next_stop(fig, plans, k, car, lap, key0, key1):  # type: ignore[no-untyped-def]
    """Read a car's next stop from its plan; a rival's lap is shifted a little. Never before `lap` + 1."""
    row = k[K_PLAN, car]
    pointer = k[K_POINTER, car]
    laps = fig.whole[I_LAPS]
    if row < 0 or pointer >= plans[row, P_STOPS] or lap + 1 >= laps:
        k[K_NEXT, car] = NO_STOP
        return
    target = plans[row, P_FIRST + 2 * pointer]
    if row < fig.rival_plans.shape[0]:
        z = rng.from_table(rng.draw(key0, key1, 64 + pointer, car, rng.JITTER), rng.NORMAL)
        target = max(target + np.int32(np.rint(z * fig.track[T_JITTER])), lap + MIN_STINT_LAPS)
    k[K_NEXT, car] = min(max(target, lap + 1), laps - 1)


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
def spare_set(k, car):  # type: ignore[no-untyped-def]
    """The hardest compound a car has a set of, -1 for none."""
    for compound in range(2, -1, -1):
        if k[K_SOFT_SETS + compound, car] > 0:
            return compound
    return -1


@kernel(inline="always")
def decide(fig, plans, k, r, actions, lap, key0, key1):  # type: ignore[no-untyped-def]
    """Fill K_WANT: the compound each car boxes for at the end of this lap, -1 to stay out. Returns how many box."""
    status = r[R_STATUS]
    limit = fig.whole[I_MAX_LAPS_PER_SET]
    if status == GREEN and limit == 0:  # most laps: nobody boxes
        due = 0
        for car in range(CARS):
            due |= (k[K_NEXT, car] <= lap) | (actions[car] > 0)
        if due == 0:
            return 0
    rivals = fig.rival_plans.shape[0]
    boxing = 0
    for car in range(CARS):
        want = -1
        row = k[K_PLAN, car]
        if row < 0:
            want = np.int32(actions[car]) - 1
        else:
            ahead = k[K_NEXT, car] - lap
            box = ahead <= 0
            if status != GREEN and not box:
                window = plans[row, P_SC_WINDOW] if status == SC else plans[row, P_VSC_WINDOW]
                if ahead <= window and k[K_AGE, car] >= MIN_STINT_LAPS:
                    chance = ONE
                    if row < rivals:
                        chance = fig.track[T_REACT_SC] if status == SC else fig.track[T_REACT_VSC]
                    # one draw a stop, not a lap: a team that stays out at first mostly means it
                    box = rng.unit(rng.draw(key0, key1, 96 + k[K_POINTER, car], car, rng.REACT)) < chance
            if box:
                want = plans[row, P_FIRST + 2 * k[K_POINTER, car] + 1]
            elif limit > 0 and k[K_AGE, car] + 1 >= limit:
                want = spare_set(k, car)
        k[K_WANT, car] = want
        boxing += want >= 0
    return boxing


@kernel(inline="always")
def free_air(fig, f, k, lap, key0, key1):  # type: ignore[no-untyped-def]
    """F_RAW: each car's lap alone on the track, relative to the reference lap. Three plain loops, so that each is vectorised."""
    first = rng.counter(lap, 0, rng.NOISE)
    for car in range(CARS):
        k[K_BITS, car] = np.int32(rng.bits(key0, key1, np.uint32(first + np.uint32(car) * rng.PER_CAR)))
    for car in range(CARS):
        f[F_RAW, car] = rng.from_table(np.uint32(k[K_BITS, car]), rng.NORMAL) * fig.cars[C_NOISE, car]
    for car in range(CARS):
        wear = f[F_WEAR, car]
        tyre = f[F_OFFSET, car] + f[F_COLD, car] + wear * (f[F_LINEAR, car] + wear * f[F_QUADRATIC, car])
        f[F_RAW, car] += f[F_PACE, car] + tyre
        f[F_COLD, car] = ZERO


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
        for q in range(p):
            car = k[K_ORDER, q]
            before = (time - f[F_TIME, car]) * per_base
            after = before + (raw - f[F_RAW, car]) * per_base
            if after >= np.floor(before) + ONE:
                f[F_RAW, lapped] += blue
                f[F_RAW, car] += lapping


@kernel(inline="always")
def race_traffic(fig, f, k, r, lap, key0, key1):  # type: ignore[no-untyped-def]
    """Cross the line from the front: a car that reaches the one ahead passes it or is held behind it.

    Random advantages are drawn beforehand and the sweep has no branches: who is held up is what a processor cannot predict.
    """
    t = fig.track
    # copies, since the compiler cannot know that the stores below leave the figures alone
    dirty, dirty_window, drs, follow = t[T_DIRTY], t[T_DIRTY_WINDOW], t[T_DRS], t[T_FOLLOW]
    threshold, scale, pass_loss = t[T_PASS], t[T_PASS_SCALE], t[T_PASS_LOSS]
    dirty_slope = dirty / dirty_window
    drs_window = t[T_DRS_WINDOW]
    if lap < DRS_FIRST_LAP or r[R_SINCE] < DRS_FIRST_LAP - 1:
        drs_window = NEVER
    latest = NEVER  # the latest crossing so far
    ahead_start = NEVER
    ahead_raw = ZERO
    first = rng.counter(lap, 0, rng.PASS)
    for car in range(CARS):
        k[K_BITS, car] = np.int32(rng.bits(key0, key1, np.uint32(first + np.uint32(car) * rng.PER_CAR)))
    for car in range(CARS):
        f[F_NEEDED, car] = threshold + scale * rng.from_table(np.uint32(k[K_BITS, car]), rng.LOGISTIC)
    for p in range(r[R_RUNNING]):
        car = np.uint32(k[K_ORDER, p])
        start = f[F_TIME, car]
        gap = start - ahead_start
        raw = f[F_RAW, car] + max(dirty - gap * dirty_slope, ZERO)
        raw -= drs if gap < drs_window else ZERO
        free = start + raw
        held = latest + follow
        passing = free + pass_loss if ahead_raw - raw > f[F_NEEDED, car] else held
        crossing = passing if free < held else free
        f[F_GAP, car] = gap
        f[F_LAP, car] = crossing - start
        f[F_TIME, car] = crossing
        latest = max(latest, crossing)
        ahead_start = start
        ahead_raw = raw


@kernel(inline="always")
def follow_safety_car(fig, f, k, r):  # type: ignore[no-untyped-def]
    """A lap behind the safety car: the queue closes up, nobody passes, lapped cars get their lap back before it goes in."""
    t = fig.track
    catch = (t[T_SC_CATCH] - t[T_SC_FACTOR]) * t[T_BASE]
    leader_time = f[F_TIME, k[K_ORDER, 0]]
    unlap = r[R_LEFT] == 1 and r[R_SINCE] > 0
    latest = leader_time
    ahead = leader_time
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
    if r[R_STATUS] != GREEN:
        r[R_LEFT] -= 1
        if r[R_LEFT] > 0:
            return
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
def start_lap(fig, f, k, r, key0, key1):  # type: ignore[no-untyped-def]
    """Lap 1: standing start from the grid; `F_RAW` holds noise, pace and tyre already, F_TIME the grid's loss."""
    for p in range(r[R_RUNNING]):
        car = k[K_ORDER, p]
        z = rng.from_table(rng.draw(key0, key1, 0, car, rng.NOISE), rng.NORMAL)
        f[F_LAP, car] = f[F_RAW, car] + f[F_TIME, car] + z * fig.track[T_START_SD]
        f[F_TIME, car] = f[F_LAP, car]
        f[F_GAP, car] = ZERO


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
    boxing = decide(fig, plans, k, r, actions, lap, key0, key1)
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
