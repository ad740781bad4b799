"""Futures of a race, compiled: the race as the pit wall sees it, with everything that the pit wall cannot see drawn anew.

Hidden are: the race's random key, and with it noise, passes, safety cars and stop times to come; the laps on which cars retire; how long a
safety car under way still stays out; every car's form of the day and the luck of its present stint, of which a pit wall has a belief;
how fast sets are used up in this race; and the plans of rivals.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.compiled import kernel
from rsrl.season import SC, VSC
from rsrl.simulator import layout as at
from rsrl.simulator import random as rng
from rsrl.simulator.calls import load_next_stop
from rsrl.simulator.figures import Figures
from rsrl.simulator.race import copy_race, retirement_lap
from rsrl.simulator.race_arrays import RaceArrays
from rsrl.simulator.rival_tables import LIFE_SPREAD

# rows of a belief, float32 [B_ROWS, CARS]
B_PACE: Final = 0  # mean of F_PACE, s
B_PACE_SD: Final = 1
B_STINT: Final = 2  # mean of the present stint's luck: its pace beyond the compound's, s
B_STINT_BY_PACE: Final = 3  # by how much that moves with one standard deviation of F_PACE, s
B_STINT_SD: Final = 4  # and how far besides, s
B_USE: Final = 5  # of the logarithm of F_USE: mean in the first column, standard deviation in the second
B_ROWS: Final = 6

ZERO, ONE = np.float32(0.0), np.float32(1.0)


class Futures(NamedTuple):
    """What the futures of a race are drawn from. Future number n is a pure function of (seed, n) and of what a pit wall sees.

    Attributes:
        figures: of the race.
        plans: plan table int32 [plans, P_COLUMNS], the rivals' rows first.
        belief: float32 [B_ROWS, CARS], what the pit wall thinks of the cars.
        race: the race as it stands; never changed, and nothing hidden in it is used.
        car: the car whose pit wall looks ahead.
        spared: a car that is sure to reach the flag, -1 for none.
        seed: non-negative.
    """

    figures: Figures
    plans: NDArray[np.int32]
    belief: NDArray[np.float32]
    race: RaceArrays
    car: int
    spared: int
    seed: np.uint64


def prior_belief(figures: Figures) -> NDArray[np.float32]:
    """The belief before the first lap, float32 [B_ROWS, CARS]."""
    belief = np.zeros((B_ROWS, at.CARS), np.float32)
    belief[B_PACE], belief[B_PACE_SD] = figures.cars[at.C_PACE], figures.cars[at.C_FORM]
    belief[B_STINT_SD] = figures.track[at.T_STINT]
    if len(figures.rivals.age):
        belief[B_USE, 1] = figures.rivals.extra[LIFE_SPREAD]
    return belief


@kernel(inline=True)
def retires(fig, car, done, key0, key1):
    """Lap on which a car that has run `done` laps stops for good."""
    if done == 0 or fig.script_retire.shape[0] > 0:
        return retirement_lap(fig, car, key0, key1)
    hazard = fig.cars[at.C_RETIRE, car]
    if hazard <= ZERO:
        return np.int32(at.NO_STOP)
    u = rng.unit(rng.draw(key0, key1, 0, car, rng.RETIRE))
    return np.int32(min(np.log(u) / np.log1p(-hazard), np.float32(at.NO_STOP))) + done + 1


@kernel(inline=True)
def agrees(plans, row, k, car, earliest):
    """Whether a plan has the compounds that a car was seen on, and its next stop on lap `earliest` or later."""
    made = k[at.K_STOPS, car]
    if made > plans[row, at.P_STOPS]:
        return False
    last = plans[row, at.P_START]
    used = 1 << last
    for i in range(made):
        last = plans[row, at.P_FIRST + 2 * i + 1]
        used |= 1 << last
    if last != k[at.K_COMPOUND, car] or used != k[at.K_USED, car]:
        return False
    return made == plans[row, at.P_STOPS] or plans[row, at.P_FIRST + 2 * made] >= earliest


@kernel(inline=True)
def plan_that_agrees(fig, plans, k, car, earliest, u):
    """Row of a rival plan that agrees with what was seen of a car, drawn by `u` and the plans' shares; -1 where none agrees."""
    total, before = ZERO, ZERO
    for row in range(fig.rival_shares.shape[1]):
        if agrees(plans, row, k, car, earliest):
            total += fig.rival_shares[car, row] - before
        before = fig.rival_shares[car, row]
    left, before, found = u * total, ZERO, -1
    for row in range(fig.rival_shares.shape[1]):
        if agrees(plans, row, k, car, earliest) and (found < 0 or left > ZERO):
            found = row
            left -= fig.rival_shares[car, row] - before
        before = fig.rival_shares[car, row]
    return found


@kernel(inline=True)
def draw_intent(fig, plans, k, car, done, key0, key1):
    """Draw who calls a rival from here on: the model of teams' calls, else a plan that agrees with what was seen of it, else nobody.

    Where the record has the figures of that model, a car that is called from outside is taken to call as teams do.
    """
    k[at.K_NEXT, car] = at.NO_STOP
    k[at.K_PLAN, car] = -1
    if fig.rivals.age.shape[0] > 0 and k[at.K_CALLER, car] != at.PLANNED:
        k[at.K_CALLER, car] = at.REACTIVE
        return
    k[at.K_CALLER, car] = at.PLANNED
    u = rng.unit(rng.draw(key0, key1, 0, car, rng.PLAN))
    row = plan_that_agrees(fig, plans, k, car, done + 1 - np.int32(np.ceil(fig.track[at.T_JITTER])), u)
    if row < 0:
        row = plan_that_agrees(fig, plans, k, car, 0, u)
    if row >= 0:
        k[at.K_PLAN, car] = row
        k[at.K_POINTER, car] = k[at.K_STOPS, car]
        load_next_stop(fig, plans, k, car, done, key0, key1)


@kernel(inline=True)
def draw_length(fig, r, key0, key1):
    """Draw for how many more laps a safety car under way stays out, given how long it has been out."""
    status, since = r[at.R_STATUS], r[at.R_SINCE]
    if fig.script_status.shape[0] > 0 or (status != SC and status != VSC):
        return
    shares = fig.sc_laps if status == SC else fig.vsc_laps
    r[at.R_LEFT] = 1
    if since >= shares.shape[0]:
        return
    below = shares[since - 1] if since > 0 else ZERO
    u = below + (ONE - below) * rng.unit(rng.draw(key0, key1, 0, 0, rng.DURATION))
    n = since + 1
    while n < shares.shape[0] and u > shares[n - 1]:
        n += 1
    r[at.R_LEFT] = n - since


@kernel(inline=True)
def draw_pace(fig, belief, f, k, car, key0, key1):
    """Draw a car's form of the day and the luck of its present stint from the belief."""
    z = rng.from_table(rng.draw(key0, key1, 0, car, rng.FORM), rng.NORMAL)
    own = rng.from_table(rng.draw(key0, key1, k[at.K_STOPS, car], car, rng.STINT), rng.NORMAL)
    f[at.F_PACE, car] = belief[B_PACE, car] + z * belief[B_PACE_SD, car]
    stint = belief[B_STINT, car] + z * belief[B_STINT_BY_PACE, car] + own * belief[B_STINT_SD, car]
    f[at.F_OFFSET, car] = fig.tyres[k[at.K_COMPOUND, car], at.Y_OFFSET] + stint


@kernel()
def draw_future(fig, plans, belief, f, k, r, car, spared, key0, key1):
    """Draw anew, in place, all of a race's state that the pit wall of `car` cannot see. `spared`: a car that reaches the flag, -1 for none.

    Where the figures have a script, its track status and retirements still hold.
    """
    done = r[at.R_LAP]
    r[at.R_KEY0], r[at.R_KEY1] = np.int32(key0), np.int32(key1)
    r[at.R_RETIREMENT] = at.NO_STOP
    z = rng.from_table(rng.draw(key0, key1, 0, rng.FIELD, rng.BOX), rng.NORMAL)
    use = np.exp(belief[B_USE, 0] + z * belief[B_USE, 1])
    for other in range(at.CARS):
        f[at.F_USE, other] = use
    draw_length(fig, r, key0, key1)
    for p in range(r[at.R_RUNNING], at.CARS):  # a car that is out calls nothing: its plan is hidden too and must not be read
        out = k[at.K_ORDER, p]
        k[at.K_PLAN, out], k[at.K_POINTER, out], k[at.K_NEXT, out] = -1, 0, at.NO_STOP
    for p in range(r[at.R_RUNNING]):
        other = k[at.K_ORDER, p]
        draw_pace(fig, belief, f, k, other, key0, key1)
        k[at.K_RETIRE, other] = at.NO_STOP if other == spared else retires(fig, other, done, key0, key1)
        r[at.R_RETIREMENT] = min(r[at.R_RETIREMENT], k[at.K_RETIRE, other])
        if other != car:
            draw_intent(fig, plans, k, other, done, key0, key1)


@kernel(inline=True)
def open_future(futures, number, to, reads_pace):
    """Copy the race to `to` (`RaceArrays`) and draw future `number` there; returns the two halves of its random key.

    `reads_pace`: whether the features are read later in this future. They tell what lap times have shown of every car and of its present
    set, so lap times must go on being followed: otherwise a policy would read, from its next stop to the flag, the luck of a set that
    came off. Whoever reads no features spares itself that part of every lap.
    """
    key0, key1 = rng.race_keys(futures.seed, number)
    race = futures.race
    copy_race(race.f, race.k, race.r, to.f, to.k, to.r)
    draw_future(futures.figures, futures.plans, futures.belief, to.f, to.k, to.r, futures.car, futures.spared, key0, key1)
    if not reads_pace:
        to.r[at.R_WATCHED] = 0
    return key0, key1
