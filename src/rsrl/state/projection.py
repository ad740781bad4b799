"""Projected finishing place, compiled: every car's race to the flag as if it had the track to itself and stopped at the best time.

The projection turns seconds into places: four seconds lost cost nothing with nobody near, and four places in a train. A rival that would
finish close by counts in part, by an error that grows with the laps to go.
"""

import numpy as np

from rsrl.compiled import kernel
from rsrl.season import GREEN
from rsrl.simulator import layout as at
from rsrl.state.expectation import set_to_fit
from rsrl.state.features import COLUMN
from rsrl.state.outlook import IMPOSSIBLE_S, lap_cost

PLACE, SOFT = COLUMN["projected_place"], COLUMN["projected_soft_places"]
ONE, HALF, ZERO = np.float32(1.0), np.float32(0.5), np.float32(0.0)
ERROR_S = np.float32(1.5)
ERROR_PER_LAP_S = np.float32(0.12)
"""Scale of the projection's error: at the flag, and what each lap to go adds."""


@kernel(inline=True)
def time_if_boxed(table, tyres, lap, compound, valid, new, age, cost):
    """Time to the flag in s of a stop at the end of the coming lap, its tyre time left out, for a set of `new` that has run `age` laps."""
    used = 1 if valid == 1 or new != compound else 0
    return cost + tyres[new, at.Y_COLD] + table[lap + 1, used, new, age]


@kernel(inline=True)
def time_to_flag(table, tyres, lap, compound, age, valid, status, cost):
    """Least time to the flag of a rival, s beyond the reference laps, which may stop for a new set of any compound at the present price."""
    last = table.shape[3] - 1
    best = table[lap + 1, valid, compound, min(age + 1, last)]
    if status != GREEN and lap + 1 < table.shape[0] - 1:
        for new in range(3):
            best = min(best, time_if_boxed(table, tyres, lap, compound, valid, new, 0, cost))
    return lap_cost(tyres, compound, age) + best


@kernel(inline=True)
def share_behind(gap, per_error):
    """How much of a place a rival counts that is projected `gap` seconds ahead: 0 far behind, 1 far ahead."""
    x = gap * per_error
    return HALF + HALF * x / (ONE + abs(x))


@kernel(inline=True)
def write_projection(out, own, timing, context, laps, tyres, cost, valid):
    """Projected place when staying out, and the places each stop costs. A rival that has stopped counts as having used two compounds.

    `timing` and `context` as in `state.observe`; `cost` of a stop now, s; `valid` 1 where the car has used two compounds.
    """
    time, order, compound, age, form = timing.time, timing.order, timing.compound, timing.age, timing.form
    paces, table, sets_left, lap = context.paces, context.outlook, timing.sets_left, timing.lap
    left = np.float32(laps - lap)
    per_error = ONE / (ERROR_S + ERROR_PER_LAP_S * left)
    c = compound[own]
    leader = time[order[0]]
    base = (time[own] - leader) + (paces[own] + form[own]) * left + lap_cost(tyres, c, age[own])
    stay = base + table[lap + 1, valid, c, min(age[own] + 1, table.shape[3] - 1)]
    x = context.expectation
    a, b, d = set_to_fit(x, sets_left, 0), set_to_fit(x, sets_left, 1), set_to_fit(x, sets_left, 2)
    soft = base + (time_if_boxed(table, tyres, lap, c, valid, 0, a, cost) if sets_left[0] > 0 else IMPOSSIBLE_S)
    medium = base + (time_if_boxed(table, tyres, lap, c, valid, 1, b, cost) if sets_left[1] > 0 else IMPOSSIBLE_S)
    hard = base + (time_if_boxed(table, tyres, lap, c, valid, 2, d, cost) if sets_left[2] > 0 else IMPOSSIBLE_S)
    place, with_soft, with_medium, with_hard = ONE, ONE, ONE, ONE
    for p in range(timing.running):
        car = order[p]
        if car == own:
            continue
        two = np.int32(timing.stops[car] > 0)
        there = (time[car] - leader) + (paces[car] + form[car]) * left
        there += time_to_flag(table, tyres, lap, compound[car], age[car], two, timing.status, cost)
        place += share_behind(stay - there, per_error)
        with_soft += share_behind(soft - there, per_error)
        with_medium += share_behind(medium - there, per_error)
        with_hard += share_behind(hard - there, per_error)
    out[PLACE] = place
    out[SOFT], out[SOFT + 1], out[SOFT + 2] = with_soft - place, with_medium - place, with_hard - place
