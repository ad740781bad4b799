"""Races run on under a policy, lap by lap in batches, compiled: futures opened, a lap driven with its time booked, the next questions put.

A *lane* is one future under one option. Lanes of a batch stand side by side so that any network, one with a memory too, is asked about
all their questions of a lap at once. What all options share, the laps before the first of them leaves, is driven once.
"""

from typing import Final

import numpy as np

from rsrl.compiled import kernel
from rsrl.environment.kernels import observe_race, write_legal
from rsrl.rollouts.futures import draw_future
from rsrl.season import GREEN, RED
from rsrl.simulator import layout as at
from rsrl.simulator import random as rng
from rsrl.simulator.lap import advance_lap
from rsrl.simulator.race import classify, copy_race
from rsrl.simulator.stops import stop_excess
from rsrl.state.encoding import encode_row

# columns of what comes out of a lane, float64
O_POSITION: Final = 0  # finishing position
O_FINISHED: Final = 1  # 1 where the car reached the flag
O_TIME: Final = 2  # race time at the flag, on the race's own clock, s
O_PIT: Final = 3  # of the time since the moment: stops, s
O_TYRE: Final = 4  # tyres on racing laps, s
O_SLOW: Final = 5  # laps that were not raced, stops left out, s
O_STOP_LAP: Final = 6  # lap at whose end the first stop was made, 0 none; where it led:
O_PLACE: Final = 7  # place, 1 the leader
O_AHEAD: Final = 8  # gaps in s, not a number where there was no car
O_BEHIND: Final = 9
O_COLUMNS: Final = 10

LAST: Final = 20.0


@kernel()
def write_legal_calls(whole, k, r, car, legal):
    """Legal calls bool [4] of one race, as the environment has them."""
    write_legal(whole, k, r, car, legal)


@kernel()
def observe_one(fig, raw, f, k, r, car, seen):
    """Raw row float32 [RAW_SIZE] of one race."""
    observe_race(fig, raw, f, k, r, car, seen)


@kernel(inline="always")
def book_rejoin(f, k, r, car, lap, out):
    """Where a first stop led: place and gaps at the line, the stop's whole loss counted."""
    place = k[at.K_PLACE, car]
    out[O_STOP_LAP] = np.float64(lap)
    out[O_PLACE] = np.float64(place + 1)
    out[O_AHEAD] = out[O_BEHIND] = np.nan
    if place > 0:
        out[O_AHEAD] = np.float64(f[at.F_TIME, car]) - np.float64(f[at.F_TIME, k[at.K_ORDER, place - 1]])
    if place + 1 < r[at.R_RUNNING]:
        out[O_BEHIND] = np.float64(f[at.F_TIME, k[at.K_ORDER, place + 1]]) - np.float64(f[at.F_TIME, car])


@kernel(inline="always")
def drive_lap(fig, plans, f, k, r, actions, car, call, out):
    """Make a call, run the lap, and book the time it took. The loss of a stop is worked out again, from the same draws."""
    status = r[at.R_STATUS]
    wear = f[at.F_WEAR, car]
    tyre = f[at.F_OFFSET, car] + f[at.F_COLD, car] + wear * (f[at.F_LINEAR, car] + wear * f[at.F_QUADRATIC, car])
    before = np.float64(f[at.F_TIME, car])
    actions[car] = call
    advance_lap(fig, plans, f, k, r, actions)
    actions[car] = 0
    if k[at.K_PLACE, car] >= r[at.R_RUNNING]:
        return
    lap = r[at.R_LAP]
    loss = 0.0
    if k[at.K_STOPPED, car] == 1:
        if status != RED:
            excess = stop_excess(fig, car, lap, np.uint32(r[at.R_KEY0]), np.uint32(r[at.R_KEY1]))
            loss = np.float64(fig.track[at.T_PIT + status] + fig.cars[at.C_STOP, car] + excess + f[at.F_RAW, car])
        if out[O_STOP_LAP] == 0.0:
            book_rejoin(f, k, r, car, lap, out)
    out[O_PIT] += loss
    if status == GREEN:
        out[O_TYRE] += np.float64(tyre)
    else:
        out[O_SLOW] += np.float64(f[at.F_TIME, car]) - before - loss


@kernel(inline="always")
def is_over(k, r, car):
    """Whether the car has seen the flag or is out."""
    return (r[at.R_FLAGGED] == 1) | (k[at.K_PLACE, car] >= r[at.R_RUNNING])


@kernel(inline="always")
def settle(f, k, r, car, positions, out):
    """The result of a race that is over for the car."""
    if k[at.K_PLACE, car] >= r[at.R_RUNNING]:
        out[O_POSITION] = np.float64(k[at.K_PLACE, car] + 1)
        return
    classify(k, r, positions)
    out[O_POSITION] = np.float64(positions[car])
    out[O_FINISHED] = 1.0
    out[O_TIME] = np.float64(f[at.F_TIME, car])


@kernel()
def open_futures(
    fig, plans, beliefs, f0, k0, r0, which, seed, numbers, car, leaves_at_lap, fs, ks, rs, actions, shared_outcome, f, k, r, out
):
    """Draw futures and drive what the options share.

    Future i goes on from state which[i] of f0, k0, r0 [states, ...] and is named by (seed, numbers[i]); option j leaves the shared laps, on
    which the car stays out, leaves_at_lap[j] laps after it. `fs`, `ks`, `rs`, `shared_outcome` are working memory of one race. Out: lane
    i * options + j of f, k, r and out.
    """
    options = leaves_at_lap.shape[0]
    last = 0
    for j in range(options):
        last = max(last, leaves_at_lap[j])
    for i in range(numbers.shape[0]):
        s = which[i]
        key0, key1 = rng.race_keys(seed, numbers[i])
        copy_race(f0[s], k0[s], r0[s], fs, ks, rs)
        watched = rs[at.R_WATCHED]
        draw_future(fig, plans, beliefs[s], fs, ks, rs, car, -1, key0, key1)
        rs[at.R_WATCHED] = watched  # the policy goes on learning the cars' pace
        for c in range(O_COLUMNS):
            shared_outcome[c] = 0.0
        for shared in range(last + 1):
            for j in range(options):
                if leaves_at_lap[j] == shared:
                    lane = i * options + j
                    copy_race(fs, ks, rs, f[lane], k[lane], r[lane])
                    for c in range(O_COLUMNS):
                        out[lane, c] = shared_outcome[c]
            if shared < last and not is_over(ks, rs, car):
                drive_lap(fig, plans, fs, ks, rs, actions, car, 0, shared_outcome)


@kernel()
def drive_lanes(
    fig,
    plans,
    f,
    k,
    r,
    alive,
    lap,
    offsets,
    forced,
    calls,
    car,
    seen,
    rows,
    values,
    always,
    actions,
    positions,
    raw,
    counts,
    x,
    legal,
    asked,
    out,
):
    """Drive the lanes `alive`, counts[0] of them, one lap, number `lap` after the moment, and put the questions of the next.

    Option j makes the call forced[j] on lap offsets[j], stays out before, and calls by `calls`, int8 [lanes], after. `always`: the policy
    is asked whatever may be called, for it has a memory or no mask. `alive` and counts[0] become those that go on; counts[1] questions:
    lanes `asked`, inputs `x` and `legal` calls. Where only one call is legal it is made without asking.
    """
    options = offsets.shape[0]
    kept, questions = 0, 0
    for a in range(counts[0]):
        lane = alive[a]
        j = lane % options
        call = np.int32(calls[lane])
        if lap <= offsets[j]:
            call = np.int32(forced[j]) if lap == offsets[j] else np.int32(0)
        if not is_over(k[lane], r[lane], car):
            if call > 0 and k[lane, at.K_SOFT_SETS + call - 1, car] < 1:
                out[lane, O_POSITION] = LAST  # as the environment has it: no set, no race
                continue
            drive_lap(fig, plans, f[lane], k[lane], r[lane], actions, car, call, out[lane])
        if is_over(k[lane], r[lane], car):
            settle(f[lane], k[lane], r[lane], car, positions, out[lane])
            continue
        alive[kept] = lane
        kept += 1
        if lap < offsets[j] and not always:
            continue
        may = legal[questions]
        write_legal(fig.whole, k[lane], r[lane], car, may)
        if not always and np.int32(may[0]) + np.int32(may[1]) + np.int32(may[2]) + np.int32(may[3]) == 1:
            calls[lane] = 1 * np.int8(may[1]) + 2 * np.int8(may[2]) + 3 * np.int8(may[3])
            continue
        observe_race(fig, raw, f[lane], k[lane], r[lane], car, seen)
        encode_row(raw, rows, values, x[questions])
        asked[questions] = lane
        questions += 1
    counts[0], counts[1] = kept, questions
