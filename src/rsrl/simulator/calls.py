"""Who boxes at the end of a lap, compiled: planned stops, the reaction to a safety car, calls from outside.

Rivals that react decide in rivals.py.
"""

import numpy as np

from rsrl.compiled import kernel
from rsrl.season import GREEN, RED, VSC
from rsrl.simulator import layout as at
from rsrl.simulator import random as rng
from rsrl.simulator.rivals import call_reactive
from rsrl.simulator.tyres import forced_set, spare_set, stint_laps, worn_out

ONE = np.float32(1.0)


@kernel(inline=True)
def load_next_stop(fig, plans, k, car, lap, key0, key1):
    """Set a car's next stop, K_NEXT, from its plan; a rival's lap is shifted a little. Never before `lap` + 1."""
    row = k[at.K_PLAN, car]
    pointer = k[at.K_POINTER, car]
    laps = fig.whole[at.I_LAPS]
    if row < 0 or k[at.K_CALLER, car] == at.REACTIVE or pointer >= plans[row, at.P_STOPS] or lap + 1 >= laps:
        k[at.K_NEXT, car] = at.NO_STOP
        return
    target = plans[row, at.P_FIRST + 2 * pointer]
    if row < fig.rival_plans.shape[0]:
        # lap 64 + pointer in the draw: one shift a stop, and no purpose uses those numbers for a real lap
        z = rng.from_table(rng.draw(key0, key1, 64 + pointer, car, rng.JITTER), rng.NORMAL)
        target = max(target + np.int32(np.rint(z * fig.track[at.T_JITTER])), lap + at.MIN_STINT_LAPS)
    k[at.K_NEXT, car] = min(max(target, lap + 1), laps - 1)


@kernel(inline=True)
def any_reactive(k):
    """Whether any car of this race is called as teams call."""
    found = 0
    for car in range(at.CARS):
        found |= k[at.K_CALLER, car] == at.REACTIVE
    return found != 0


@kernel(inline=True)
def decide(fig, plans, f, k, r, actions, lap, key0, key1):
    """Fill K_WANT: the compound each car boxes for at the end of this lap, -1 to stay out. Returns how many box."""
    status = r[at.R_STATUS]
    limit = fig.whole[at.I_MAX_LAPS_PER_SET]
    reactive = fig.rivals.age.shape[0] > 0
    boxing = 0
    for car in range(at.CARS):
        k[at.K_WANT, car] = -1
    if reactive and any_reactive(k):
        boxing = call_reactive(fig.rivals, f, k, r, lap, key0, key1)
    # most laps: no planned stop is due and no action asks for one, so the loop below, full of branches, is skipped
    if status == GREEN and limit == 0:
        due = 0
        for car in range(at.CARS):
            due |= (k[at.K_NEXT, car] <= lap) | (actions[car] > 0)
        if due == 0:
            return boxing
    rivals = fig.rival_plans.shape[0]
    for car in range(at.CARS):
        if k[at.K_CALLER, car] == at.REACTIVE:
            continue
        want = -1
        row = k[at.K_PLAN, car]
        if row < 0:
            want = np.int32(actions[car]) - 1
            if want < 0 and worn_out(fig, k, car):
                want = forced_set(k, car)
        else:
            ahead = k[at.K_NEXT, car] - lap
            box = ahead <= 0
            if status != GREEN and not box:
                window = plans[row, at.P_VSC_WINDOW] if status == VSC else plans[row, at.P_SC_WINDOW]
                if ahead <= window and stint_laps(k, car) >= at.MIN_STINT_LAPS:
                    chance = ONE
                    if row < rivals and status != RED:  # under a red flag the change is free, and everyone takes it
                        chance = fig.track[at.T_REACT_VSC] if status == VSC else fig.track[at.T_REACT_SC]
                    # one draw a stop, not a lap: a team that stays out on the first lap of a safety car mostly stays out
                    box = rng.unit(rng.draw(key0, key1, 96 + k[at.K_POINTER, car], car, rng.REACT)) < chance
            if box:
                want = plans[row, at.P_FIRST + 2 * k[at.K_POINTER, car] + 1]
            elif limit > 0 and k[at.K_AGE, car] + 1 >= limit:
                # a planned stop whose random shift put it too late is made now, for the compound of the plan: the hardest spare set
                # could break the two-compound rule
                planned = k[at.K_NEXT, car] < at.NO_STOP
                want = plans[row, at.P_FIRST + 2 * k[at.K_POINTER, car] + 1] if planned else spare_set(k, car)
        k[at.K_WANT, car] = want
        boxing += want >= 0
    return boxing
