"""Whole races, compiled: the grid, the laps, the classification; many races in one call."""

import numpy as np

from rsrl.compiled import kernel
from rsrl.simulator import layout as at
from rsrl.simulator import random as rng
from rsrl.simulator.calls import load_next_stop
from rsrl.simulator.lap import OUT, advance, advance_lap
from rsrl.simulator.rivals import draw_use
from rsrl.simulator.status import read_script
from rsrl.simulator.tyres import fit_tyre, stops_owed


@kernel(inline=True)
def retirement_lap(fig, car, key0, key1):
    """Lap on which a car stops for good: lap 1 with a probability of its own, then geometric with the car's hazard."""
    # drawn at the start, once a race: no draw a lap, and the same whatever anyone's strategy
    if fig.script_retire.shape[0] > 0:
        return fig.script_retire[car]
    u = rng.unit(rng.draw(key0, key1, 0, car, rng.RETIRE))
    beyond = np.float32(1.0) - fig.cars[at.C_LAP1, car]
    if u > beyond:
        return np.int32(1)
    hazard = fig.cars[at.C_RETIRE, car]
    if hazard <= np.float32(0.0):
        return np.int32(at.NO_STOP)
    # inverse of the geometric law's survival function
    return np.int32(min(np.log(u / beyond) / np.log1p(-hazard), np.float32(at.NO_STOP))) + 2


@kernel(inline=True)
def form_of_day(fig, car, key0, key1):
    """Form of a car in a race, in standard deviations: in part its own, in part its team's, drawn once for both cars."""
    z = rng.from_table(rng.draw(key0, key1, 0, car, rng.FORM), rng.NORMAL)
    common = fig.cars[at.C_TEAM_FORM, car]
    if common > np.float32(0.0):
        mate = fig.mates[car]
        first = min(car, mate) if mate >= 0 else car
        team = rng.from_table(rng.draw(key0, key1, 1, first, rng.FORM), rng.NORMAL)  # "lap" 1: lap 0 is the cars' own
        z = common * team + np.sqrt(np.float32(1.0) - common * common) * z
    return z


@kernel(inline=True)
def drawn_plan(fig, car, key0, key1):
    """Row of the rival plan that a car would run, among those it has the sets for: it also gives the tyre it starts on."""
    u = rng.unit(rng.draw(key0, key1, 0, car, rng.PLAN))
    row = 0
    for i in range(fig.rival_shares.shape[1] - 1):  # a count, not a search: no branch to predict
        row += np.int32(u > fig.rival_shares[car, i])
    return row


@kernel()
def start_race(fig, plans, seed, race, callers, f, k, r):
    """Set a race up on the grid. `callers` int32 [CARS]: RIVAL, OUTSIDE, IMITATION, or a row of `plans` for each car."""
    key0, key1 = rng.race_keys(seed, race)  # all that is random in the race is a function of these two keys
    f[:] = np.float32(0.0)
    k[:] = 0
    r[:] = 0
    r[at.R_KEY0], r[at.R_KEY1] = np.int32(key0), np.int32(key1)
    n = fig.whole[at.I_CARS]
    r[at.R_RUNNING] = n
    r[at.R_RETIREMENT] = at.NO_STOP
    r[at.R_NO_DRS] = fig.whole[at.I_DRS_OFF_LAPS]
    r[at.R_SCRIPTED] = np.int32(fig.script_retire.shape[0] > 0)
    r[at.R_DISQUALIFIED] = fig.whole[at.I_DISQUALIFIED]
    if fig.script_status.shape[0] > 0:
        read_script(fig, r, 1)
    if fig.rivals.age.shape[0] > 0:
        f[at.F_USE] = draw_use(fig.rivals, key0, key1)
    for car in range(at.CARS):
        k[at.K_ORDER, car] = car
        k[at.K_PLACE, car] = car
        k[at.K_PLAN, car], k[at.K_NEXT, car] = -1, at.NO_STOP
        if car >= n:  # a smaller field: the slots beyond it stand at the end as if retired
            f[at.F_TIME, car] = OUT
            continue
        f[at.F_PACE, car] = fig.cars[at.C_PACE, car] + form_of_day(fig, car, key0, key1) * fig.cars[at.C_FORM, car]
        f[at.F_TIME, car] = fig.cars[at.C_START, car]
        k[at.K_RETIRE, car] = retirement_lap(fig, car, key0, key1)
        r[at.R_RETIREMENT] = min(r[at.R_RETIREMENT], k[at.K_RETIRE, car])
        for c in range(3):
            k[at.K_SOFT_SETS + c, car] = fig.sets[c, car]
        # a car called from outside starts on the tyre that its team would have chosen
        row = drawn_plan(fig, car, key0, key1)
        caller = callers[car]
        if caller >= 0:
            row = caller
        fit_tyre(fig, f, k, car, plans[row, at.P_START], key0, key1)
        f[at.F_TIME, car] += fig.tyres[plans[row, at.P_START], at.Y_LAUNCH]
        k[at.K_CALLER, car] = at.CALLED if caller == at.OUTSIDE else (at.REACTIVE if caller == at.IMITATION else at.PLANNED)
        if caller == at.OUTSIDE:
            r[at.R_WATCHED] = 1
        else:
            k[at.K_PLAN, car] = row
            load_next_stop(fig, plans, k, car, 0, key0, key1)


@kernel(inline=True)
def broke_tyre_rules(whole, k, car):
    """Whether a car has run on one dry compound only, or on fewer sets than the race asks for."""
    return stops_owed(whole, k, car) > 0


@kernel()
def classify(whole, k, r, positions):
    """Finishing positions by car, 1 for the winner: finishers in order, then those in breach of the tyre rules, then retirements.

    `positions` int8: of the cars of the race, or of all slots, of which the empty ones come last. A race that replays a script is
    classified as it finished, those disqualified last.
    """
    place = 1
    # what happened is history, even where a car was given a place in spite of its tyres (red flags, wet tyres)
    if r[at.R_SCRIPTED] == 1:
        for disqualified in range(2):
            for p in range(positions.shape[0]):
                car = k[at.K_ORDER, p]
                if (r[at.R_DISQUALIFIED] >> car) & 1 == disqualified:
                    positions[car] = place
                    place += 1
        return
    for p in range(r[at.R_RUNNING]):
        car = k[at.K_ORDER, p]
        if not broke_tyre_rules(whole, k, car):
            positions[car] = place
            place += 1
    for p in range(r[at.R_RUNNING]):
        car = k[at.K_ORDER, p]
        if broke_tyre_rules(whole, k, car):
            positions[car] = place
            place += 1
    for p in range(r[at.R_RUNNING], positions.shape[0]):
        positions[k[at.K_ORDER, p]] = place
        place += 1


@kernel(inline=True)
def write_result(whole, f, k, r, out, i):
    """Row `i` of the results, `ResultRows`, from a race that is over."""
    classify(whole, k, r, out.positions[i])
    for p in range(out.stops.shape[1]):  # the cars of the race: empty slots stand behind them
        car = k[at.K_ORDER, p]
        out.stops[i, car] = k[at.K_STOPS, car]
        out.retired[i, car] = p >= r[at.R_RUNNING]
        # the clock is whole milliseconds, so that rounding does not add up over the laps
        out.race_time_s[i, car] = f[at.F_TIME, car] + np.float32(r[at.R_CLOCK_MS]) * np.float32(0.001)
    out.slow_laps[i, 0], out.slow_laps[i, 1] = r[at.R_SC_LAPS], r[at.R_VSC_LAPS]


@kernel()
def run_races(fig, plans, seed, races, callers, focus, focus_plans, race, actions, out):
    """Run races to the flag. Row i is race number races[i]; car `focus` (if not negative) runs plan row focus_plans[i].

    `callers` is changed in place. `race`: `RaceArrays` of one race, working memory; `actions`: int8 [CARS], zeros; `out`: `ResultRows`.
    """
    f, k, r = race.f, race.k, race.r
    for i in range(races.shape[0]):
        # plans compared for one car differ in nothing else: the same race number gives the same draws
        if focus >= 0:
            callers[focus] = focus_plans[i]
        start_race(fig, plans, seed, races[i], callers, f, k, r)
        for _ in range(fig.whole[at.I_LAPS]):
            advance(fig, plans, f, k, r, actions)
        write_result(fig.whole, f, k, r, out, i)


@kernel()
def start_batch(fig, plans, seed, races, callers, f, k, r):
    """Set up a batch of races: f [n, F_ROWS, CARS], k [n, K_ROWS, CARS], r [n, R_SIZE], callers [CARS]."""
    for i in range(races.shape[0]):
        start_race(fig, plans, seed, races[i], callers, f[i], k[i], r[i])


@kernel()
def advance_batch(fig, plans, f, k, r, actions):
    """One lap of every race of a batch; actions int8 [n, CARS]."""
    for i in range(f.shape[0]):
        advance_lap(fig, plans, f[i], k[i], r[i], actions[i])


@kernel(inline=True)
def copy_race(f, k, r, to_f, to_k, to_r):
    """Copy a race's state."""
    for row in range(at.F_ROWS):
        for car in range(at.CARS):
            to_f[row, car] = f[row, car]
    for row in range(at.K_ROWS):
        for car in range(at.CARS):
            to_k[row, car] = k[row, car]
    for i in range(at.R_SIZE):
        to_r[i] = r[i]
