"""Who boxes at the end of a lap: planned stops, the reaction to a safety car, calls from outside."""

import numpy as np

from rsrl.compiled import kernel
from rsrl.season import GREEN, RED, VSC
from rsrl.simulator import random as rng
from rsrl.simulator.layout import (
    CARS,
    I_LAPS,
    I_MAX_LAPS_PER_SET,
    K_AGE,
    K_CALLER,
    K_NEXT,
    K_PLAN,
    K_POINTER,
    K_WANT,
    NO_STOP,
    P_FIRST,
    P_SC_WINDOW,
    P_STOPS,
    P_VSC_WINDOW,
    R_STATUS,
    REACTIVE,
    T_JITTER,
    T_REACT_SC,
    T_REACT_VSC,
)
from rsrl.simulator.rivals import call_reactive
from rsrl.simulator.tyres import forced_set, spare_set, worn_out

ONE = np.float32(1.0)
MIN_STINT_LAPS = 2


@kernel(inline="always")
def load_next_stop(fig, plans, k, car, lap, key0, key1):  # type: ignore[no-untyped-def]
    """Read a car's next stop from its plan; a rival's lap is shifted a little. Never before `lap` + 1."""
    row = k[K_PLAN, car]
    pointer = k[K_POINTER, car]
    laps = fig.whole[I_LAPS]
    if row < 0 or k[K_CALLER, car] == REACTIVE or pointer >= plans[row, P_STOPS] or lap + 1 >= laps:
        k[K_NEXT, car] = NO_STOP
        return
    target = plans[row, P_FIRST + 2 * pointer]
    if row < fig.rival_plans.shape[0]:
        z = rng.from_table(rng.draw(key0, key1, 64 + pointer, car, rng.JITTER), rng.NORMAL)
        target = max(target + np.int32(np.rint(z * fig.track[T_JITTER])), lap + MIN_STINT_LAPS)
    k[K_NEXT, car] = min(max(target, lap + 1), laps - 1)


@kernel(inline="always")
def any_reactive(k):  # type: ignore[no-untyped-def]
    """Whether a car of this race is called as teams call."""
    found = 0
    for car in range(CARS):
        found |= k[K_CALLER, car] == REACTIVE
    return found != 0


@kernel(inline="always")
def decide(fig, plans, f, k, r, actions, lap, key0, key1):  # type: ignore[no-untyped-def]
    """Fill K_WANT: the compound each car boxes for at the end of this lap, -1 to stay out. Returns how many box."""
    status = r[R_STATUS]
    limit = fig.whole[I_MAX_LAPS_PER_SET]
    reactive = fig.rivals.age.shape[0] > 0
    boxing = 0
    for car in range(CARS):
        k[K_WANT, car] = -1
    if reactive and any_reactive(k):
        boxing = call_reactive(fig.rivals, f, k, r, lap, key0, key1)
    if status == GREEN and limit == 0:  # most laps: no other car boxes
        due = 0
        for car in range(CARS):
            due |= (k[K_NEXT, car] <= lap) | (actions[car] > 0)
        if due == 0:
            return boxing
    rivals = fig.rival_plans.shape[0]
    for car in range(CARS):
        if k[K_CALLER, car] == REACTIVE:
            continue
        want = -1
        row = k[K_PLAN, car]
        if row < 0:
            want = np.int32(actions[car]) - 1
            if want < 0 and worn_out(fig, k, car):
                want = forced_set(k, car)
        else:
            ahead = k[K_NEXT, car] - lap
            box = ahead <= 0
            if status != GREEN and not box:
                window = plans[row, P_VSC_WINDOW] if status == VSC else plans[row, P_SC_WINDOW]
                if ahead <= window and k[K_AGE, car] >= MIN_STINT_LAPS:
                    chance = ONE
                    if row < rivals and status != RED:  # nobody leaves a free change undone
                        chance = fig.track[T_REACT_VSC] if status == VSC else fig.track[T_REACT_SC]
                    # one draw a stop, not a lap: a team that stays out at first mostly means it
                    box = rng.unit(rng.draw(key0, key1, 96 + k[K_POINTER, car], car, rng.REACT)) < chance
            if box:
                want = plans[row, P_FIRST + 2 * k[K_POINTER, car] + 1]
            elif limit > 0 and k[K_AGE, car] + 1 >= limit:
                # a planned stop that luck put too late comes now, for its own compound: a spare could break the two-compound rule
                planned = k[K_NEXT, car] < NO_STOP
                want = plans[row, P_FIRST + 2 * k[K_POINTER, car] + 1] if planned else spare_set(k, car)
        k[K_WANT, car] = want
        boxing += want >= 0
    return boxing
