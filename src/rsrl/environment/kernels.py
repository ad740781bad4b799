"""The compiled part of the environment: legal calls, one decision of every race of a batch, observation, reward."""

import numpy as np

from rsrl.compiled import kernel
from rsrl.environment.reward import reward_of
from rsrl.season import FIELD_SIZE
from rsrl.simulator import layout as at
from rsrl.simulator.lap import advance_lap
from rsrl.simulator.race import classify, start_race
from rsrl.simulator.tyres import stops_owed, two_used
from rsrl.state.observe import TimingData, observe

# columns of the outcome of a race, float32
O_POSITION, O_VALID, O_RETIRED, O_STOPS, O_FAILED = range(5)
O_SIZE = 5

FAILED_PLACE = np.int32(FIELD_SIZE)


@kernel(inline=True)
def last_place(whole):
    """Position of a car whose call could not be carried out, which ends its race: 20, or the last place of a larger field."""
    return max(FAILED_PLACE, whole[at.I_CARS])


@kernel()
def write_legal(whole, k, r, car, legal):
    """Legal calls for the coming lap, bool [4] into `legal`.

    A stop needs a set and is not made on the last lap. A car that owes as many stops as there are laps for them must stop, on the last of
    them for the second compound if it has used one only. Where a set may run a limited number of laps, it comes off in time, and no stop
    is made after which the sets left would not reach the flag.
    """
    lap = r[at.R_LAP] + 1
    laps = whole[at.I_LAPS]
    limit = whole[at.I_MAX_LAPS_PER_SET]
    owed = stops_owed(whole, k, car)
    must = owed > 0 and laps - lap <= owed
    second = lap >= laps - 1 and not two_used(k[at.K_USED, car])
    worn_out = limit > 0 and k[at.K_AGE, car] + 1 >= limit
    sets = k[at.K_SOFT_SETS, car] + k[at.K_SOFT_SETS + 1, car] + k[at.K_SOFT_SETS + 2, car]
    free = limit == 0 or limit * sets >= laps - lap or worn_out or must
    legal[0] = not must and not worn_out
    for c in range(3):
        new = ((k[at.K_USED, car] >> c) & 1) == 0
        legal[1 + c] = free and lap < laps and k[at.K_SOFT_SETS + c, car] > 0 and (new or not second)
    if not (legal[0] or legal[1] or legal[2] or legal[3]):
        legal[0] = True


@kernel()
def observe_race(whole, tyres, out, f, k, r, car, context):
    """Raw row float32 [RAW_SIZE] of a car from the simulator's own arrays; the same bits as by way of a `UnifiedRaceState`."""
    laps = whole[at.I_LAPS]
    timing = TimingData(
        min(r[at.R_LAP], laps - 1), r[at.R_STATUS], r[at.R_SINCE], r[at.R_RUNNING],
        f[at.F_TIME], f[at.F_LAP], k[at.K_PLACE], k[at.K_ORDER], k[at.K_COMPOUND], k[at.K_AGE], f[at.F_WEAR], k[at.K_STOPS],
        k[at.K_STOPPED], f[at.F_FORM], f[at.F_LUCK],
        k[at.K_USED, car], (k[at.K_SOFT_SETS, car], k[at.K_SOFT_SETS + 1, car], k[at.K_SOFT_SETS + 2, car]), f[at.F_GAP, car],
    )  # fmt: skip
    observe(out, car, timing, context, laps, tyres)


# Python calls these two at every step, and there each NamedTuple of arrays would cost half a microsecond, a twentieth of the step of a
# single race: the arrays are passed one by one.


@kernel()
def reset_rows(fig, plans, seed, races, callers, f, k, r, rows, car, context, raw, legal, done, outcome):
    """Start races number `races` int64 [m] of a seed in the `rows` int64 [m] of a batch f, k, r [n, ...], and observe them.

    Out: raw rows float32 [n, RAW_SIZE], legal calls bool [n, 4], done bool [n], outcome float32 [n, O_SIZE].
    """
    for j in range(rows.shape[0]):
        i = rows[j]
        start_race(fig, plans, seed, races[j], callers, f[i], k[i], r[i])
        done[i] = False
        outcome[i] = np.float32(0.0)
        write_legal(fig.whole, k[i], r[i], car, legal[i])
        observe_race(fig.whole, fig.tyres, raw[i], f[i], k[i], r[i], car, context)


@kernel()
def step_rows(fig, plans, f, k, r, calls, actions, car, context, raw, legal, done, reward, outcome, positions):
    """One decision, calls int8 [n], of every race of a batch. A race that is over stays as it is, with reward 0.

    Out: as of `reset_rows`, and reward float32 [n]; outcome is written when a race ends. positions: int8 [CARS], working memory.
    """
    for i in range(f.shape[0]):
        reward[i] = np.float32(0.0)
        if done[i]:
            continue
        call = np.int32(calls[i])
        valid_before = stops_owed(fig.whole, k[i], car) <= 0
        available = call == 0 or k[i, at.K_SOFT_SETS + call - 1, car] > 0
        retired = False
        if available:
            actions[i, car] = call
            advance_lap(fig, plans, f[i], k[i], r[i], actions[i])
            retired = k[i, at.K_PLACE, car] >= r[i, at.R_RUNNING]
        over = not available or retired or r[i, at.R_FLAGGED] == 1
        position = last_place(fig.whole)
        if over and available:
            position = k[i, at.K_PLACE, car] + 1
            if not retired:
                classify(fig.whole, k[i], r[i], positions)
                position = np.int32(positions[car])
        valid = stops_owed(fig.whole, k[i], car) <= 0
        reward[i] = reward_of(call, available, valid_before, over, retired, valid, position)
        write_legal(fig.whole, k[i], r[i], car, legal[i])
        observe_race(fig.whole, fig.tyres, raw[i], f[i], k[i], r[i], car, context)
        if over:
            done[i] = True
            outcome[i, O_POSITION] = np.float32(position)
            outcome[i, O_VALID] = np.float32(valid and available)
            outcome[i, O_RETIRED] = np.float32(retired)
            outcome[i, O_STOPS] = np.float32(k[i, at.K_STOPS, car])
            outcome[i, O_FAILED] = np.float32(not available)
