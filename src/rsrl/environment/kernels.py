"""The environment's compiled part: legality, one decision of every race of a batch, observation, reward."""

import numpy as np

from rsrl.compiled import kernel
from rsrl.environment.reward import reward_of
from rsrl.simulator import layout as at
from rsrl.simulator.lap import advance_lap
from rsrl.simulator.race import classify, start_race
from rsrl.state.observe import observe

F_TIME, F_LAP, F_GAP, F_FORM, F_LUCK, F_WEAR = at.F_TIME, at.F_LAP, at.F_GAP, at.F_FORM, at.F_LUCK, at.F_WEAR
K_ORDER, K_PLACE, K_COMPOUND, K_AGE, K_STOPS = at.K_ORDER, at.K_PLACE, at.K_COMPOUND, at.K_AGE, at.K_STOPS
K_USED, K_SOFT_SETS, K_STOPPED, K_RETIRE = at.K_USED, at.K_SOFT_SETS, at.K_STOPPED, at.K_RETIRE
R_LAP, R_STATUS, R_SINCE, R_RUNNING, R_FLAGGED = at.R_LAP, at.R_STATUS, at.R_SINCE, at.R_RUNNING, at.R_FLAGGED
I_LAPS, I_MAX_LAPS_PER_SET = at.I_LAPS, at.I_MAX_LAPS_PER_SET

# columns of the outcome of a race, float32
O_POSITION, O_VALID, O_RETIRED, O_STOPS, O_FAILED = range(5)
O_SIZE = 5


@kernel(inline="always")
def two_used(mask):
    """Whether a bit mask of compounds holds two or more."""
    return (mask & (mask - 1)) != 0


@kernel(inline="always")
def write_legal(whole, k, r, car, legal):
    """Legal calls for the coming lap: a set must be left, no stop on the last lap, and the last chance for the second compound is taken.

    Where a set may run so many laps only, it comes off in time, and no stop is made after which the sets left no longer reach the flag.
    """
    lap = r[R_LAP] + 1
    laps = whole[I_LAPS]
    limit = whole[I_MAX_LAPS_PER_SET]
    must = lap >= laps - 1 and not two_used(k[K_USED, car])
    worn_out = limit > 0 and k[K_AGE, car] + 1 >= limit
    sets = k[K_SOFT_SETS, car] + k[K_SOFT_SETS + 1, car] + k[K_SOFT_SETS + 2, car]
    free = limit == 0 or limit * sets >= laps - lap or worn_out or must
    legal[0] = not must and not worn_out
    for c in range(3):
        new = ((k[K_USED, car] >> c) & 1) == 0
        legal[1 + c] = free and lap < laps and k[K_SOFT_SETS + c, car] > 0 and (new or not must)
    if not (legal[0] or legal[1] or legal[2] or legal[3]):
        legal[0] = True


@kernel(inline="always")
def observe_race(fig, out, f, k, r, car, seen):
    """Raw row of the simulator's own state: the compiled counterpart of translating it first. `seen` is an observer's `RaceContext`."""
    lap = min(r[R_LAP], fig.whole[I_LAPS] - 1)
    observe(
        out, car, seen.track, fig.whole[I_LAPS], lap, r[R_STATUS], r[R_SINCE], r[R_RUNNING], seen.reference_s, seen.pit_cost_s, fig.tyres,
        seen.outlook, seen.expectation, seen.paces, seen.figures,
        f[F_TIME], f[F_LAP], k[K_PLACE], k[K_ORDER], k[K_COMPOUND], k[K_AGE], f[F_WEAR], k[K_STOPS], k[K_STOPPED],
        f[F_FORM], f[F_LUCK],
        k[K_USED, car], k[K_SOFT_SETS : K_SOFT_SETS + 3, car], f[F_GAP, car],
    )  # fmt: skip


@kernel()
def reset_rows(fig, plans, seed, races, callers, f, k, r, rows, car, seen, raw, legal, done, outcome):
    """Start the races of the batch's `rows` (int64 [m], race numbers `races` [m]) and observe them."""
    for j in range(rows.shape[0]):
        i = rows[j]
        start_race(fig, plans, seed, races[j], callers, f[i], k[i], r[i])
        done[i] = False
        outcome[i] = np.float32(0.0)
        write_legal(fig.whole, k[i], r[i], car, legal[i])
        observe_race(fig, raw[i], f[i], k[i], r[i], car, seen)


@kernel()
def step_rows(fig, plans, f, k, r, calls, actions, car, seen, raw, legal, done, reward, outcome, positions):
    """One decision of every race. A race that is over stays as it is, with reward 0."""
    for i in range(f.shape[0]):
        reward[i] = np.float32(0.0)
        if done[i]:
            continue
        call = np.int32(calls[i])
        valid_before = two_used(k[i, K_USED, car])
        available = call == 0 or k[i, K_SOFT_SETS + call - 1, car] > 0
        retired = False
        if available:
            actions[i, car] = call
            advance_lap(fig, plans, f[i], k[i], r[i], actions[i])
            retired = k[i, K_PLACE, car] >= r[i, R_RUNNING]
        over = not available or retired or r[i, R_FLAGGED] == 1
        position = 20
        if over and available:
            position = k[i, K_PLACE, car] + 1
            if not retired:
                classify(k[i], r[i], positions)
                position = np.int32(positions[car])
        valid = two_used(k[i, K_USED, car])
        reward[i] = reward_of(call, available, valid_before, over, retired, valid, position)
        write_legal(fig.whole, k[i], r[i], car, legal[i])
        observe_race(fig, raw[i], f[i], k[i], r[i], car, seen)
        if over:
            done[i] = True
            outcome[i, O_POSITION] = np.float32(position)
            outcome[i, O_VALID] = np.float32(valid and available)
            outcome[i, O_RETIRED] = np.float32(retired)
            outcome[i, O_STOPS] = np.float32(k[i, K_STOPS, car])
            outcome[i, O_FAILED] = np.float32(not available)
