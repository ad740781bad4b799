"""Races that branch, compiled: from a decision on the way, the same race is rolled out once for each call, on the same random draws.

A draw is a function of seed, race, lap, car and purpose, so the branches of a decision meet the same safety cars, noise and
moods of rivals, and the difference between their finishing places is the effect of the call alone.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.compiled import kernel
from rsrl.rollouts.compiled_network import N_ACTIONS
from rsrl.rollouts.compiled_policy import DecisionMemory, evaluate
from rsrl.simulator import Figures
from rsrl.simulator import layout as at
from rsrl.simulator import random as rng
from rsrl.simulator.lap import advance_lap
from rsrl.simulator.race import classify, copy_race, start_race
from rsrl.simulator.race_arrays import RaceArrays
from rsrl.simulator.tyres import stops_owed

# purposes of the exploration's draws
E_PLAN, E_UNTIL, E_BRANCH, E_DEPART, E_WHICH, E_ALL = range(6)

NOT_RUN = np.float32(np.nan)


class RaceEntry(NamedTuple):
    """A race and the car that is called: figures, plan table int32 [plans, P_COLUMNS], callers int32 [CARS], index of the car."""

    figures: Figures
    plans: NDArray[np.int32]
    callers: NDArray[np.int32]
    car: int


class Exploration(NamedTuple):
    """What `Branching` says about single races, as the kernels read it."""

    plan_share: np.float32
    pit_chance: np.float32
    delay_chance: np.float32
    most: np.float32
    least: np.float32
    scale: np.float32
    all_calls: np.float32


class BranchMemory(NamedTuple):
    """Working memory of one thread: the race and a branch of it, the decision at hand, a later one, actions and positions int8 [CARS]."""

    race: RaceArrays
    branch: RaceArrays
    here: DecisionMemory
    later: DecisionMemory
    actions: NDArray[np.int8]
    positions: NDArray[np.int8]


class BranchRows(NamedTuple):
    """Decisions of n races, at most D of each; only the first counts[i] of race i are filled.

    Attributes:
        features: network input float32 [n, D, F].
        legal: bool [n, D, 4].
        positions: float32 [n, D, 4], finishing position after each call, NaN where it was not rolled out.
        extra_stops: float32 [n, D, 4], stops from this decision on that the tyre rules no longer asked for, NaN likewise.
        counts: int32 [n].
    """

    features: NDArray[np.float32]
    legal: NDArray[np.bool_]
    positions: NDArray[np.float32]
    extra_stops: NDArray[np.float32]
    counts: NDArray[np.int32]


@kernel()
def rollout_to_flag(entry, race, call, policy, decision, actions, positions):
    """Make a call, follow the policy to the flag, and return the car's position and its stops that the tyre rules did not ask for."""
    fig, car = entry.figures, entry.car
    f, k, r = race.f, race.k, race.r
    extra = np.int32(0)
    while True:
        extra += np.int32((call > 0) & (stops_owed(fig.whole, k, car) <= 0))
        actions[car] = call
        advance_lap(fig, entry.plans, f, k, r, actions)
        actions[car] = 0
        if k[at.K_PLACE, car] >= r[at.R_RUNNING]:
            return k[at.K_PLACE, car] + 1, extra
        if r[at.R_FLAGGED] == 1:
            classify(fig.whole, k, r, positions)
            return np.int32(positions[car]), extra
        call = evaluate(fig, race, car, policy, decision)


@kernel(inline=True)
def some_stop(legal, word):
    """A random legal stop, 0 where none is legal."""
    n = 0
    for a in range(1, N_ACTIONS):
        n += np.int32(legal[a])
    if n == 0:
        return 0
    pick = np.int32(rng.unit(word) * np.float32(n))
    for a in range(1, N_ACTIONS):
        if legal[a]:
            if pick == 0:
                return a
            pick -= 1
    return 0


@kernel(inline=True)
def explore(settings, legal, best, planned, key0, key1, lap, laps):
    """The call of a race to branch from: the best one, and now and then another, so that states off the policy's own path are met."""
    u = rng.unit(rng.draw(key0, key1, lap, 0, E_DEPART))
    stop = some_stop(legal, rng.draw(key0, key1, lap, 0, E_WHICH))
    if planned:
        chance = np.float32(2.0) / np.float32(laps)
        call = stop if u < chance else 0
    elif best == 0:
        call = stop if u < settings.pit_chance else 0
    else:
        call = 0 if u < settings.delay_chance else best
    return call if legal[call] else best


@kernel(inline=True)
def second_best(decision, best):
    """The best legal call but `best`, -1 where there is none."""
    other = -1
    for a in range(N_ACTIONS):
        if a != best and decision.legal[a] and (other < 0 or decision.q[a] > decision.q[other]):
            other = a
    return other


@kernel(inline=True)
def branch(entry, policy, best, other, every, memory, out, i, n):
    """Roll out the calls of the decision at hand: staying, the best stop, the two best calls, and all legal ones where `every`."""
    here, race, copy = memory.here, memory.race, memory.branch
    stop = best if best > 0 else other
    for j in range(here.x.shape[0]):
        out.features[i, n, j] = here.x[j]
    for a in range(N_ACTIONS):
        out.legal[i, n, a] = here.legal[a]
        out.positions[i, n, a] = out.extra_stops[i, n, a] = NOT_RUN
    for a in range(N_ACTIONS):
        if here.legal[a] and (a == 0 or a in (stop, best, other) or every):
            copy_race(race.f, race.k, race.r, copy.f, copy.k, copy.r)
            position, extra = rollout_to_flag(entry, copy, a, policy, memory.later, memory.actions, memory.positions)
            out.positions[i, n, a], out.extra_stops[i, n, a] = position, extra


@kernel()
def branch_races(entry, policy, seed, draw_seed, races, settings, memory, out):
    """Drive races number `races` int64 [n] of a seed with exploration, and branch at some decisions; `out` is a `BranchRows`.

    `draw_seed` names the draws of the exploration, which must not be those of the race.
    """
    fig, car, here = entry.figures, entry.car, memory.here
    f, k, r = memory.race.f, memory.race.k, memory.race.r
    laps = fig.whole[at.I_LAPS]
    for i in range(races.shape[0]):
        start_race(fig, entry.plans, seed, races[i], entry.callers, f, k, r)
        key0, key1 = rng.race_keys(draw_seed, races[i])
        until = 0
        if rng.unit(rng.draw(key0, key1, 0, 0, E_PLAN)) < settings.plan_share:
            until = np.int32(rng.unit(rng.draw(key0, key1, 0, 0, E_UNTIL)) * np.float32(laps)) + 1
        n = 0
        for lap in range(1, laps + 1):
            best = evaluate(fig, memory.race, car, policy, here)
            other = second_best(here, best)
            if other >= 0 and n < out.features.shape[1]:
                gap = here.q[best] - here.q[other]
                chance = settings.least + (settings.most - settings.least) * np.exp(-gap / settings.scale)
                if rng.unit(rng.draw(key0, key1, lap, 0, E_BRANCH)) < chance:
                    every = rng.unit(rng.draw(key0, key1, lap, 0, E_ALL)) < settings.all_calls
                    branch(entry, policy, best, other, every, memory, out, i, n)
                    n += 1
            call = explore(settings, here.legal, best, lap < until, key0, key1, lap, laps)
            memory.actions[car] = call
            advance_lap(fig, entry.plans, f, k, r, memory.actions)
            memory.actions[car] = 0
            if r[at.R_FLAGGED] == 1 or k[at.K_PLACE, car] >= r[at.R_RUNNING]:
                break
        out.counts[i] = n


@kernel()
def greedy_races(entry, policy, seed, races, memory, positions):
    """Positions int8 [n] of races number `races` int64 [n] of a seed, called by the policy alone."""
    race, here = memory.race, memory.here
    for i in range(races.shape[0]):
        start_race(entry.figures, entry.plans, seed, races[i], entry.callers, race.f, race.k, race.r)
        call = evaluate(entry.figures, race, entry.car, policy, here)
        positions[i], _ = rollout_to_flag(entry, race, call, policy, here, memory.actions, memory.positions)
