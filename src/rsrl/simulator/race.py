"""Whole races, compiled: the start, the laps, the classification; many races in a row of one call."""

import numpy as np

from rsrl.compiled import kernel
from rsrl.simulator import random as rng
from rsrl.simulator.calls import load_next_stop
from rsrl.simulator.lap import OUT, advance, advance_lap
from rsrl.simulator.layout import (
    C_FORM,
    C_LAP1,
    C_PACE,
    C_RETIRE,
    C_START,
    CALLED,
    CARS,
    F_PACE,
    F_TIME,
    F_USE,
    I_CARS,
    I_LAPS,
    IMITATION,
    K_CALLER,
    K_NEXT,
    K_ORDER,
    K_PLACE,
    K_PLAN,
    K_RETIRE,
    K_SOFT_SETS,
    K_STOPS,
    K_USED,
    NO_STOP,
    OUTSIDE,
    P_START,
    PLANNED,
    R_CLOCK_MS,
    R_KEY0,
    R_KEY1,
    R_NO_DRS,
    R_RETIREMENT,
    R_RUNNING,
    R_SC_LAPS,
    R_SCRIPTED,
    R_VSC_LAPS,
    R_WATCHED,
    REACTIVE,
)
from rsrl.simulator.rivals import pace_of_wear
from rsrl.simulator.status import read_script
from rsrl.simulator.traffic import LAPS_WITHOUT_DRS
from rsrl.simulator.tyres import fit_tyre


@kernel(inline="always")
def retirement_lap(fig, car, key0, key1):  # type: ignore[no-untyped-def]
    """Lap on which a car stops for good: lap 1 with a probability of its own, then geometric with the car's hazard."""
    if fig.script_retire.shape[0] > 0:
        return fig.script_retire[car]
    u = rng.unit(rng.draw(key0, key1, 0, car, rng.RETIRE))
    beyond = np.float32(1.0) - fig.cars[C_LAP1, car]
    if u > beyond:
        return np.int32(1)
    hazard = fig.cars[C_RETIRE, car]
    if hazard <= np.float32(0.0):
        return np.int32(NO_STOP)
    return np.int32(min(np.log(u / beyond) / np.log1p(-hazard), np.float32(NO_STOP))) + 2


@kernel(inline="always")
def drawn_plan(fig, car, key0, key1):  # type: ignore[no-untyped-def]
    """Row of the rival plan a car would run: it also decides the tyre it starts on."""
    u = rng.unit(rng.draw(key0, key1, 0, car, rng.PLAN))
    row = 0
    for i in range(fig.rival_shares.shape[0] - 1):  # a count, not a search: no branch to predict
        row += np.int32(u > fig.rival_shares[i])
    return row


@kernel()
def start_race(fig, plans, seed, race, callers, f, k, r):  # type: ignore[no-untyped-def]
    """Set a race up on the grid. `callers` int32 [20]: RIVAL, OUTSIDE, IMITATION, or a row of `plans` for each car."""
    key0, key1 = rng.race_keys(seed, race)
    f[:] = np.float32(0.0)
    k[:] = 0
    r[:] = 0
    r[R_KEY0], r[R_KEY1] = np.int32(key0), np.int32(key1)
    n = fig.whole[I_CARS]
    r[R_RUNNING] = n
    r[R_RETIREMENT] = NO_STOP
    r[R_NO_DRS] = LAPS_WITHOUT_DRS
    r[R_SCRIPTED] = np.int32(fig.script_retire.shape[0] > 0)
    if fig.script_status.shape[0] > 0:
        read_script(fig, r, 1)
    if fig.rivals.age.shape[0] > 0:
        f[F_USE] = pace_of_wear(fig.rivals, key0, key1)
    for car in range(CARS):
        k[K_ORDER, car] = car
        k[K_PLACE, car] = car
        k[K_PLAN, car] = -1
        if car >= n:
            f[F_TIME, car] = OUT
            continue
        z = rng.from_table(rng.draw(key0, key1, 0, car, rng.FORM), rng.NORMAL)
        f[F_PACE, car] = fig.cars[C_PACE, car] + z * fig.cars[C_FORM, car]
        f[F_TIME, car] = fig.cars[C_START, car]
        k[K_RETIRE, car] = retirement_lap(fig, car, key0, key1)
        r[R_RETIREMENT] = min(r[R_RETIREMENT], k[K_RETIRE, car])
        for c in range(3):
            k[K_SOFT_SETS + c, car] = fig.sets[c]
        row = drawn_plan(fig, car, key0, key1)
        caller = callers[car]
        if caller >= 0:
            row = caller
        fit_tyre(fig, f, k, car, plans[row, P_START], key0, key1)
        k[K_NEXT, car] = NO_STOP
        k[K_CALLER, car] = CALLED if caller == OUTSIDE else (REACTIVE if caller == IMITATION else PLANNED)
        if caller == OUTSIDE:
            r[R_WATCHED] = 1
        else:
            k[K_PLAN, car] = row
            load_next_stop(fig, plans, k, car, 0, key0, key1)


@kernel(inline="always")
def broke_two_compound_rule(k, car):  # type: ignore[no-untyped-def]
    """Whether a car has run on one dry compound only."""
    used = k[K_USED, car]
    return (used & (used - 1)) == 0


@kernel()
def classify(k, r, positions):  # type: ignore[no-untyped-def]
    """Finishing positions 1..20 by car: finishers in order, then those in breach of the two-compound rule, then retirements.

    A replayed race is classified as it came in.
    """
    place = 1
    if r[R_SCRIPTED] == 1:
        for p in range(CARS):
            positions[k[K_ORDER, p]] = p + 1
        return
    for p in range(r[R_RUNNING]):
        car = k[K_ORDER, p]
        if not broke_two_compound_rule(k, car):
            positions[car] = place
            place += 1
    for p in range(r[R_RUNNING]):
        car = k[K_ORDER, p]
        if broke_two_compound_rule(k, car):
            positions[car] = place
            place += 1
    for p in range(r[R_RUNNING], CARS):
        positions[k[K_ORDER, p]] = place
        place += 1


@kernel(inline="always")
def write_result(k, f, r, positions, stops, retired, times_s, slow_laps):  # type: ignore[no-untyped-def]
    """One row of the results of a race that is over: see `run_races`."""
    classify(k, r, positions)
    for p in range(CARS):
        car = k[K_ORDER, p]
        stops[car] = k[K_STOPS, car]
        retired[car] = p >= r[R_RUNNING]
        times_s[car] = f[F_TIME, car] + np.float32(r[R_CLOCK_MS]) * np.float32(0.001)
    slow_laps[0], slow_laps[1] = r[R_SC_LAPS], r[R_VSC_LAPS]


@kernel()
def run_races(fig, plans, seed, races, callers, focus, focus_plans, f, k, r, actions, positions, stops, retired, times_s, slow_laps):  # type: ignore[no-untyped-def]
    """Run races to the flag. Row i is race number races[i]; car `focus` (if not negative) runs plan row focus_plans[i].

    `callers` is changed in place; f, k, r, actions are working memory of one race.
    Out: positions, stops int8 [n, 20]; retired bool [n, 20]; times_s float32 [n, 20]; slow_laps int16 [n, 2] (SC, VSC).
    """
    for i in range(races.shape[0]):
        if focus >= 0:
            callers[focus] = focus_plans[i]
        start_race(fig, plans, seed, races[i], callers, f, k, r)
        for _ in range(fig.whole[I_LAPS]):
            advance(fig, plans, f, k, r, actions)
        write_result(k, f, r, positions[i], stops[i], retired[i], times_s[i], slow_laps[i])


@kernel()
def start_batch(fig, plans, seed, races, callers, f, k, r):  # type: ignore[no-untyped-def]
    """Set up a batch of races: f [n, F_ROWS, 20], k [n, K_ROWS, 20], r [n, R_SIZE], callers [20]."""
    for i in range(races.shape[0]):
        start_race(fig, plans, seed, races[i], callers, f[i], k[i], r[i])


@kernel()
def advance_batch(fig, plans, f, k, r, actions):  # type: ignore[no-untyped-def]
    """One lap of every race of a batch; actions int8 [n, 20]."""
    for i in range(f.shape[0]):
        advance_lap(fig, plans, f[i], k[i], r[i], actions[i])
