"""Rollouts under any policy, compiled: futures opened, a lap driven with its time booked, the policy's next decisions observed.

A *lane* is one future under one option. The lanes of a batch advance together, so that any network, one with a memory too, is asked about
all their decisions of a lap at once. The laps that all options share, before the first of them calls, are driven once.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.compiled import kernel
from rsrl.environment.kernels import last_place, observe_race, write_legal
from rsrl.rollouts.futures import Futures, open_future
from rsrl.season import GREEN, RED
from rsrl.simulator import Figures
from rsrl.simulator import layout as at
from rsrl.simulator.lap import advance_lap
from rsrl.simulator.race import classify, copy_race
from rsrl.simulator.race_arrays import RaceArrays
from rsrl.simulator.stops import stop_excess
from rsrl.state.encoding import encode_row

# columns of the result of a lane, float64
O_POSITION: Final = 0  # finishing position
O_FINISHED: Final = 1  # 1 where the car reached the flag
O_TIME: Final = 2  # race time at the flag, on the race's own clock, s
O_PIT: Final = 3  # of the time since the start of the rollout: stops, s
O_TYRE: Final = 4  # tyres on racing laps, s
O_SLOW: Final = 5  # laps that were not raced, stops left out, s
O_STOP_LAP: Final = 6  # lap at whose end the first stop was made, 0 for none; and where the car rejoined:
O_PLACE: Final = 7  # place, 1 the leader
O_AHEAD: Final = 8  # gaps in s, NaN where there is no car
O_BEHIND: Final = 9
O_COLUMNS: Final = 10


class Starts(NamedTuple):
    """States that futures go on from, all before the same lap of the same race; future n goes on from state n modulo their number.

    Attributes:
        figures, plans, car, seed: as in `Futures`.
        beliefs: float32 [states, B_ROWS, CARS].
        races: arrays of the states.
    """

    figures: Figures
    plans: NDArray[np.int32]
    beliefs: NDArray[np.float32]
    races: RaceArrays
    car: int
    seed: np.uint64


class OptionArrays(NamedTuple):
    """m options: option j makes calls[j] int8 [m] on lap offsets[j] int32 [m] after the first, and follows the policy after it.

    It leaves the laps that the options share, on which the car stays out, on lap leaves[j] int32 [m].
    """

    offsets: NDArray[np.int32]
    calls: NDArray[np.int8]
    leaves: NDArray[np.int32]


class Lanes(NamedTuple):
    """L lanes; lane i * options + j is future i of the batch under option j.

    Attributes:
        races: their states.
        out: float64 [L, O_COLUMNS].
        calls: int8 [L], the policy's call for the coming lap.
        alive: int32 [L], the lanes that go on, the first counts[0] of them.
        asked: int32 [L], the lanes whose policy is to be asked, the first counts[1] of them; x: float32 [L, F], their network inputs;
            legal: bool [L + 1, 4], their legal calls.
        counts: int64 [2].
    """

    races: RaceArrays
    out: NDArray[np.float64]
    calls: NDArray[np.int8]
    alive: NDArray[np.int32]
    asked: NDArray[np.int32]
    x: NDArray[np.float32]
    legal: NDArray[np.bool_]
    counts: NDArray[np.int64]


class LaneMemory(NamedTuple):
    """Working memory of one thread: the laps that options share and their times float64 [O_COLUMNS]; raw row; int8 [CARS] each."""

    shared: RaceArrays
    shared_out: NDArray[np.float64]
    raw: NDArray[np.float32]
    actions: NDArray[np.int8]
    positions: NDArray[np.int8]


@kernel(inline=True)
def book_rejoin(f, k, r, car, lap, out):
    """Where a first stop led: place and gaps at the line, with the whole loss of the stop counted."""
    place = k[at.K_PLACE, car]
    out[O_STOP_LAP] = np.float64(lap)
    out[O_PLACE] = np.float64(place + 1)
    out[O_AHEAD] = out[O_BEHIND] = np.nan
    if place > 0:
        out[O_AHEAD] = np.float64(f[at.F_TIME, car]) - np.float64(f[at.F_TIME, k[at.K_ORDER, place - 1]])
    if place + 1 < r[at.R_RUNNING]:
        out[O_BEHIND] = np.float64(f[at.F_TIME, k[at.K_ORDER, place + 1]]) - np.float64(f[at.F_TIME, car])


@kernel(inline=True)
def drive_lap(fig, plans, f, k, r, actions, car, call, out):
    """Make a call, drive the lap, and book the time it took. The loss of a stop is computed again, from the same draws."""
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


@kernel(inline=True)
def is_over(k, r, car):
    """Whether the car has seen the flag or is out."""
    return (r[at.R_FLAGGED] == 1) | (k[at.K_PLACE, car] >= r[at.R_RUNNING])


@kernel(inline=True)
def settle(whole, f, k, r, car, positions, out):
    """The result of a race that is over for the car."""
    if k[at.K_PLACE, car] >= r[at.R_RUNNING]:
        out[O_POSITION] = np.float64(k[at.K_PLACE, car] + 1)
        return
    classify(whole, k, r, positions)
    out[O_POSITION] = np.float64(positions[car])
    out[O_FINISHED] = 1.0
    out[O_TIME] = np.float64(f[at.F_TIME, car])


@kernel()
def open_lanes(starts, numbers, options, lanes, memory):
    """Draw futures number `numbers` int64 [n], drive the laps that the options share, and fill the lanes where each option leaves them."""
    fig, plans, car, races = starts.figures, starts.plans, starts.car, starts.races
    shared, shared_out = memory.shared, memory.shared_out
    m, states = options.leaves.shape[0], starts.beliefs.shape[0]
    last = 0
    for j in range(m):
        last = max(last, options.leaves[j])
    for i in range(numbers.shape[0]):
        s = numbers[i] % states
        state = RaceArrays(races.f[s], races.k[s], races.r[s])
        open_future(Futures(fig, plans, starts.beliefs[s], state, car, -1, starts.seed), numbers[i], shared, True)
        for c in range(O_COLUMNS):
            shared_out[c] = 0.0
        for lap in range(last + 1):
            for j in range(m):
                if options.leaves[j] == lap:
                    lane = i * m + j
                    copy_race(shared.f, shared.k, shared.r, lanes.races.f[lane], lanes.races.k[lane], lanes.races.r[lane])
                    for c in range(O_COLUMNS):
                        lanes.out[lane, c] = shared_out[c]
            if lap < last and not is_over(shared.k, shared.r, car):
                drive_lap(fig, plans, shared.f, shared.k, shared.r, memory.actions, car, np.int32(0), shared_out)


@kernel()
def drive_lanes(starts, options, inputs, lap, always, lanes, memory):
    """Drive the lanes alive one lap, number `lap` after the first, and observe the decisions of the next one (`inputs`: `PolicyInputs`).

    Where only one call is legal, it is made without asking the policy, unless it must be asked `always`, as one with a memory or without
    a mask must be.
    """
    fig, plans, car = starts.figures, starts.plans, starts.car
    f, k, r, out = lanes.races.f, lanes.races.k, lanes.races.r, lanes.out
    m = options.offsets.shape[0]
    kept, questions = 0, 0
    for a in range(lanes.counts[0]):
        lane = lanes.alive[a]
        j = lane % m
        call = np.int32(lanes.calls[lane])
        if lap <= options.offsets[j]:
            call = np.int32(options.calls[j]) if lap == options.offsets[j] else np.int32(0)
        if not is_over(k[lane], r[lane], car):
            if call > 0 and k[lane, at.K_SOFT_SETS + call - 1, car] < 1:
                # as in the environment: a call for a set that is not there ends the race
                out[lane, O_POSITION] = np.float64(last_place(fig.whole))
                continue
            drive_lap(fig, plans, f[lane], k[lane], r[lane], memory.actions, car, call, out[lane])
        if is_over(k[lane], r[lane], car):
            settle(fig.whole, f[lane], k[lane], r[lane], car, memory.positions, out[lane])
            continue
        lanes.alive[kept] = lane
        kept += 1
        if lap < options.offsets[j] and not always:
            continue
        may = lanes.legal[questions]
        write_legal(fig.whole, k[lane], r[lane], car, may)
        if not always and np.int32(may[0]) + np.int32(may[1]) + np.int32(may[2]) + np.int32(may[3]) == 1:
            lanes.calls[lane] = 1 * np.int8(may[1]) + 2 * np.int8(may[2]) + 3 * np.int8(may[3])
            continue
        observe_race(fig.whole, fig.tyres, memory.raw, f[lane], k[lane], r[lane], car, inputs.context)
        encode_row(memory.raw, inputs.columns, inputs.scales, lanes.x[questions])
        lanes.asked[questions] = lane
        questions += 1
    lanes.counts[0], lanes.counts[1] = kept, questions
