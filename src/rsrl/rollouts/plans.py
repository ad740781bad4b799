"""Rollouts of plans for one car, compiled: finishing places in futures that agree with what the pit wall sees.

A future is a pure function of (seed, number of the future): all plans meet the same ones (common random numbers), so the difference
between two plans is known far better than either mean.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.compiled import kernel
from rsrl.rollouts.futures import Futures, open_future
from rsrl.season import GREEN
from rsrl.simulator import layout as at
from rsrl.simulator.calls import load_next_stop
from rsrl.simulator.figures import Figures
from rsrl.simulator.lap import advance
from rsrl.simulator.race import broke_tyre_rules, classify, copy_race
from rsrl.simulator.race_arrays import RaceArrays, empty_race
from rsrl.simulator.tyres import next_set, stint_laps, two_used

BY_COST: Final = -1
"""P_SC_WINDOW of a plan row that answers safety cars, and goes on after its last stop, by `CostToGo`."""

PLAN_POSITION, PLAN_SMOOTH_POSITION, PLAN_TIME = range(3)
PLAN_COLUMNS: Final = 3
"""Results of a rollout: finishing position; the same with rivals close by counted in part; race time, s."""

HALF_WIDTH_S: Final = np.float32(2.0)
"""A rival who finishes within so much counts in part in PLAN_SMOOTH_POSITION, by the gap: the same mean, a little less noise."""

ZERO, ONE, HALF = np.float32(0.0), np.float32(1.0), np.float32(0.5)
INSIDE = np.float32(1.0e-3)


class CostToGo(NamedTuple):
    """Expected cost from a lap to the flag, from which a car can call the rest of its race: on each lap the call of the least cost.

    Attributes:
        value: s, float32 [laps + 1, 2, 3, laps + 1, deviations]: by laps done, two compounds used, compound, laps on the set, and the
            deviation of the stint's pace from the compound's.
        new: the same for a set just fitted, whose deviation is not known yet, float32 [laps + 1, 2, 3, sets]; the last index is the
            number of the set of its compound, from 0 for the freshest (`Figures.laps_before`).
        price: loss of a stop by track status, float32 [4], s.
        grid: least deviation in `value` and the step to the next, float32 [2], s; a step of 0 where there is one only.
    """

    value: NDArray[np.float32]
    new: NDArray[np.float32]
    price: NDArray[np.float32]
    grid: NDArray[np.float32]


class RolloutMemory(NamedTuple):
    """Working memory of one thread: a future as it opens, a copy that is rolled out, int8 [CARS] actions and places."""

    opened: RaceArrays
    driven: RaceArrays
    actions: NDArray[np.int8]
    places: NDArray[np.int8]


def rollout_memory() -> RolloutMemory:
    """Working memory for rollouts; one a running thread."""
    return RolloutMemory(empty_race(), empty_race(), np.zeros(at.CARS, np.int8), np.zeros(at.CARS, np.int8))


def roll_out_plans(
    figures: Figures,
    rows: NDArray[np.int32],
    costs: CostToGo,
    belief: NDArray[np.float32],
    state: tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.int32]],
    car: int,
    *,
    seed: int,
    first: int = 0,
    futures: int,
    spared: int = -1,
    memory: RolloutMemory | None = None,
) -> NDArray[np.float32]:
    """Roll a race out to the flag under each plan for one car, all in the same futures.

    Args:
        rows: plan rows int32 [m, P_COLUMNS] of the stops still to come, on laps of the race; a stop on the coming lap is a forced call now.
            With P_SC_WINDOW = BY_COST the row's stops are made on racing laps, the coming lap goes by the row whatever its status, and
            `costs` call the rest; else the row is driven as a plan, with its windows.
        belief: float32 [B_ROWS, CARS], the posterior of every car's pace (`futures.prior_belief` before the race).
        state: f, k, r of the race; not changed, and nothing hidden in them is used.
        seed: non-negative, names the futures `first`, `first` + 1 ...
        spared: a car that is sure to reach the flag, -1 none. Sparing the called car takes out noise that no plan can change.

    Returns:
        float32 [futures, m, PLAN_COLUMNS].
    """
    table = np.concatenate([figures.rival_plans, rows])
    numbers = np.arange(len(figures.rival_plans), len(table), dtype=np.int32)
    out = np.empty((futures, len(rows), PLAN_COLUMNS), np.float32)
    drawn = Futures(figures, table, belief, RaceArrays(*state), car, spared, np.uint64(seed))
    _roll_out(drawn, first, numbers, costs, memory or rollout_memory(), out)
    return out


@kernel(inline=True)
def cost_of_staying(fig, costs, f, k, car, lap, two):
    """Expected cost from the end of a lap to the flag without a stop on it; linear between deviations of the stint's pace."""
    laps = fig.whole[at.I_LAPS]
    compound = k[at.K_COMPOUND, car]
    last = costs.value.shape[4] - 1
    place = ZERO
    if costs.grid[1] > ZERO:
        place = (f[at.F_OFFSET, car] - fig.tyres[compound, at.Y_OFFSET] - costs.grid[0]) / costs.grid[1]
        place = min(max(place, ZERO), np.float32(last) - INSIDE)
    cell = np.int32(place)
    row = costs.value[lap, two, compound, min(k[at.K_AGE, car] + 1, laps)]
    return row[cell] + (place - np.float32(cell)) * (row[min(cell + 1, last)] - row[cell])


@kernel(inline=True)
def cheapest_call(fig, costs, f, k, r, car, lap):
    """The call of the least expected cost: 0 stay, 1 + compound; a stop where the sets to be used leave no choice, which no cost knows."""
    status = r[at.R_STATUS]
    must = fig.whole[at.I_STOPS_ASKED] - k[at.K_STOPS, car] >= fig.whole[at.I_LAPS] - lap
    if status != GREEN and stint_laps(k, car) < at.MIN_STINT_LAPS and not must:
        return 0
    two = np.int32(two_used(k[at.K_USED, car]))
    best, call = np.float32(np.inf) if must else cost_of_staying(fig, costs, f, k, car, lap, two), 0
    for new in range(3):
        if k[at.K_SOFT_SETS + new, car] > 0:
            then = 1 if two == 1 or new != k[at.K_COMPOUND, car] else 0
            n = next_set(fig.sets[new, car], k[at.K_SOFT_SETS + new, car], costs.new.shape[3])
            cost = costs.price[status] + costs.new[lap, then, new, n]
            if cost < best:
                best, call = cost, 1 + new
    return call


@kernel(inline=True)
def call_of_row(fig, plans, row, costs, f, k, r, car, made, first):
    """The call on the coming lap under a BY_COST row; the row began on lap `first`, when the car had made `made` stops."""
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
    return cheapest_call(fig, costs, f, k, r, car, lap)


@kernel(inline=True)
def smooth_position(whole, f, k, r, car, position):
    """Finishing position in which a rival close by counts in part; of a car that is out or broke the tyre rules, `position`."""
    if k[at.K_PLACE, car] >= r[at.R_RUNNING] or broke_tyre_rules(whole, k, car):
        return np.float32(position)
    total, mine = ONE, f[at.F_TIME, car]
    for p in range(r[at.R_RUNNING]):
        other = k[at.K_ORDER, p]
        if other != car and not broke_tyre_rules(whole, k, other):
            total += min(max(HALF + HALF * (mine - f[at.F_TIME, other]) / HALF_WIDTH_S, ZERO), ONE)
    return total


@kernel(inline=True)
def hand_over(fig, plans, k, r, car, row, key0, key1):
    """Put a car on a plan row; returns whether it is a BY_COST row."""
    by_cost = plans[row, at.P_SC_WINDOW] == BY_COST
    k[at.K_CALLER, car] = at.CALLED if by_cost else at.PLANNED
    k[at.K_PLAN, car] = -1 if by_cost else row
    k[at.K_POINTER, car] = 0
    k[at.K_NEXT, car] = at.NO_STOP
    load_next_stop(fig, plans, k, car, r[at.R_LAP], key0, key1)
    return by_cost


@kernel()
def _roll_out(futures, first, rows, costs, memory, out):
    """Compiled part of `roll_out_plans`; `rows` int32 [m] are rows of the plan table."""
    fig, plans, car = futures.figures, futures.plans, futures.car
    opened, actions, places = memory.opened, memory.actions, memory.places
    f, k, r = memory.driven.f, memory.driven.k, memory.driven.r
    made, done = futures.race.k[at.K_STOPS, car], futures.race.r[at.R_LAP]
    for i in range(out.shape[0]):
        key0, key1 = open_future(futures, first + i, opened, False)  # neither plans nor tables read features
        for j in range(rows.shape[0]):
            copy_race(opened.f, opened.k, opened.r, f, k, r)
            by_cost = hand_over(fig, plans, k, r, car, rows[j], key0, key1)
            for other in range(at.CARS):
                actions[other] = 0
            for _ in range(fig.whole[at.I_LAPS] - done):
                if by_cost:
                    actions[car] = call_of_row(fig, plans, rows[j], costs, f, k, r, car, made, done + 1)
                advance(fig, plans, f, k, r, actions)
            classify(fig.whole, k, r, places)
            out[i, j, PLAN_POSITION] = np.float32(places[car])
            out[i, j, PLAN_SMOOTH_POSITION] = smooth_position(fig.whole, f, k, r, car, places[car])
            out[i, j, PLAN_TIME] = f[at.F_TIME, car] + np.float32(r[at.R_CLOCK_MS]) * np.float32(0.001)
