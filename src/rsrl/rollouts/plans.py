"""A race run on from where it stands, many times, compiled: what plans for one car are worth in futures that agree with what is seen.

A future is a pure function of (seed, number of the future): all plans meet the same ones (common random numbers), so two plans are
compared far more sharply than either is known.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.compiled import kernel
from rsrl.rollouts.futures import draw_future
from rsrl.season import GREEN
from rsrl.simulator import layout as at
from rsrl.simulator import random as rng
from rsrl.simulator.calls import load_next_stop
from rsrl.simulator.engine import working_memory
from rsrl.simulator.figures import Figures
from rsrl.simulator.lap import advance
from rsrl.simulator.race import broke_two_compound_rule, classify, copy_race

FORESEE: Final = -1
"""P_SC_WINDOW of a plan row that answers safety cars, and goes on after its last stop, as `Foresight` says."""

O_POSITION, O_SMOOTH, O_TIME = range(3)
O_COLUMNS: Final = 3
"""What comes out of a run: finishing position; the same with rivals close by counted in part; race time, s."""

HALF_WIDTH_S: Final = np.float32(2.0)
"""A rival who finishes within so much counts in part in O_SMOOTH, by the gap. Its mean is the position's, its noise a little less."""

ZERO, ONE, HALF = np.float32(0.0), np.float32(1.0), np.float32(0.5)
INSIDE = np.float32(1.0e-3)
MIN_STINT_LAPS = 2


class Foresight(NamedTuple):
    """A rule by which a car can call the rest of its race: the call of the least expected cost, from tables.

    Attributes:
        value: expected cost to the flag in s, float32 [laps + 1, 2, 3, laps + 1, deviations]: by laps done, two compounds used, compound,
            laps on the set, and luck of the stint (its pace beyond the compound's).
        new: the same for a new set, its luck not known yet, float32 [laps + 1, 2, 3].
        price: loss of a stop by track status, float32 [4], s.
        grid: least luck in `value` and the step to the next, float32 [2], s; a step of 0 means that there is none.
    """

    value: NDArray[np.float32]
    new: NDArray[np.float32]
    price: NDArray[np.float32]
    grid: NDArray[np.float32]


Memory = tuple[NDArray[np.generic], ...]


def lookahead_memory() -> Memory:
    """Working memory of `look_ahead`: state arrays of two races, the actions, the places. One a running thread."""
    f, k, r, actions = working_memory()
    return (*working_memory()[:3], f, k, r, actions, np.zeros(at.CARS, np.int8))


def run_on(
    figures: Figures,
    rows: NDArray[np.int32],
    foresight: Foresight,
    belief: NDArray[np.float32],
    state: tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.int32]],
    car: int,
    *,
    seed: int,
    first: int = 0,
    futures: int,
    spared: int = -1,
    memory: Memory | None = None,
) -> NDArray[np.float32]:
    """Run a race on to the flag under each plan for one car, all in the same futures.

    Args:
        rows: plan rows int32 [m, P_COLUMNS] of the stops still to come, on laps of the race; a stop on the coming lap is a forced call now.
            With P_SC_WINDOW = FORESEE the row's stops are made on racing laps, the coming lap goes by the row whatever its status, and
            `foresight` calls the rest; else the row is driven as a plan, with its windows.
        belief: float32 [B_ROWS, 20], what is thought of the cars (`futures.prior_belief`).
        state: f, k, r of the race; not changed, and nothing hidden in them is used.
        seed: non-negative, names the futures `first`, `first` + 1 ...
        spared: a car that is sure to reach the flag, -1 none. Sparing the called car takes out luck that no plan can change.

    Returns:
        float32 [futures, m, O_COLUMNS].
    """
    table = np.concatenate([figures.rival_plans, rows])
    numbers = np.arange(len(figures.rival_plans), len(table), dtype=np.int32)
    out = np.empty((futures, len(rows), O_COLUMNS), np.float32)
    look_ahead(
        figures, table, foresight, belief, *state, car, spared, np.uint64(seed), first, numbers, *(memory or lookahead_memory()), out
    )
    return out


@kernel(inline="always")
def cost_of_staying(fig, ahead, f, k, car, lap, two):
    """Expected cost from the end of a lap on without a stop on it, between the two nearest lucks of the stint."""
    laps = fig.whole[at.I_LAPS]
    compound = k[at.K_COMPOUND, car]
    last = ahead.value.shape[4] - 1
    place = ZERO
    if ahead.grid[1] > ZERO:
        place = (f[at.F_OFFSET, car] - fig.tyres[compound, at.Y_OFFSET] - ahead.grid[0]) / ahead.grid[1]
        place = min(max(place, ZERO), np.float32(last) - INSIDE)
    cell = np.int32(place)
    row = ahead.value[lap, two, compound, min(k[at.K_AGE, car] + 1, laps)]
    return row[cell] + (place - np.float32(cell)) * (row[min(cell + 1, last)] - row[cell])


@kernel(inline="always")
def foreseen_call(fig, ahead, f, k, r, car, lap):
    """The call of the least expected cost: 0 stay, 1 + compound."""
    status, used = r[at.R_STATUS], k[at.K_USED, car]
    if status != GREEN and k[at.K_AGE, car] < MIN_STINT_LAPS:
        return 0
    two = np.int32((used & (used - 1)) != 0)
    best, call = cost_of_staying(fig, ahead, f, k, car, lap, two), 0
    for new in range(3):
        if k[at.K_SOFT_SETS + new, car] > 0:
            then = 1 if two == 1 or new != k[at.K_COMPOUND, car] else 0
            cost = ahead.price[status] + ahead.new[lap, then, new]
            if cost < best:
                best, call = cost, 1 + new
    return call


@kernel(inline="always")
def call_ahead(fig, plans, row, ahead, f, k, r, car, made, first):
    """The call on the coming lap of a car that had made `made` stops on lap `first`, where a row that foresees began."""
    lap = r[at.R_LAP] + 1
    if lap >= fig.whole[at.I_LAPS]:
        return 0
    pointer = k[at.K_STOPS, car] - made
    if (r[at.R_STATUS] == GREEN or lap == first) and pointer < plans[row, at.P_STOPS]:
        if lap < plans[row, at.P_FIRST + 2 * pointer]:
            return 0
        compound = plans[row, at.P_FIRST + 2 * pointer + 1]
        if k[at.K_SOFT_SETS + compound, car] > 0:
            return 1 + compound
    return foreseen_call(fig, ahead, f, k, r, car, lap)


@kernel(inline="always")
def smooth_position(f, k, r, car, position):
    """Finishing position in which a rival close by counts in part. A car that is out, or out of the rules, stands where it stands."""
    if k[at.K_PLACE, car] >= r[at.R_RUNNING] or broke_two_compound_rule(k, car):
        return np.float32(position)
    total, mine = ONE, f[at.F_TIME, car]
    for p in range(r[at.R_RUNNING]):
        other = k[at.K_ORDER, p]
        if other != car and not broke_two_compound_rule(k, other):
            total += min(max(HALF + HALF * (mine - f[at.F_TIME, other]) / HALF_WIDTH_S, ZERO), ONE)
    return total


@kernel(inline="always")
def hand_over(fig, plans, k, r, car, row, key0, key1):
    """Put a car on a plan row; returns whether it is one that foresees."""
    foresees = plans[row, at.P_SC_WINDOW] == FORESEE
    k[at.K_CALLER, car] = at.CALLED if foresees else at.PLANNED
    k[at.K_PLAN, car] = -1 if foresees else row
    k[at.K_POINTER, car] = 0
    k[at.K_NEXT, car] = at.NO_STOP
    load_next_stop(fig, plans, k, car, r[at.R_LAP], key0, key1)
    return foresees


@kernel()
def look_ahead(fig, plans, ahead, belief, f, k, r, car, spared, seed, first, rows, f1, k1, r1, f2, k2, r2, actions, places, out):
    """Compiled part of `run_on`: `plans` has the rivals' rows first, `rows` int32 [m] are rows of it, `f1` to `places` working memory."""
    made, start = k[at.K_STOPS, car], r[at.R_LAP] + 1
    for i in range(out.shape[0]):
        key0, key1 = rng.race_keys(seed, first + i)
        copy_race(f, k, r, f1, k1, r1)
        draw_future(fig, plans, belief, f1, k1, r1, car, spared, key0, key1)
        for j in range(rows.shape[0]):
            copy_race(f1, k1, r1, f2, k2, r2)
            foresees = hand_over(fig, plans, k2, r2, car, rows[j], key0, key1)
            for other in range(at.CARS):
                actions[other] = 0
            for _ in range(fig.whole[at.I_LAPS] - r[at.R_LAP]):
                if foresees:
                    actions[car] = call_ahead(fig, plans, rows[j], ahead, f2, k2, r2, car, made, start)
                advance(fig, plans, f2, k2, r2, actions)
            classify(k2, r2, places)
            out[i, j, O_POSITION] = np.float32(places[car])
            out[i, j, O_SMOOTH] = smooth_position(f2, k2, r2, car, places[car])
            out[i, j, O_TIME] = f2[at.F_TIME, car] + np.float32(r2[at.R_CLOCK_MS]) * np.float32(0.001)
