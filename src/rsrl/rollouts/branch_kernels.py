"""Races that branch, compiled: from a decision on the way, the same race is run to the flag once for each call, on the same luck.

Luck is a function of seed, race, lap, car and purpose, so the branches of a decision meet the same safety cars, noise and
rivals' moods, and the difference between their finishing places is the call's doing alone.
"""

import numpy as np

from rsrl.compiled import kernel
from rsrl.environment.kernels import observe_race, write_legal
from rsrl.rollouts.compiled_network import N_ACTIONS, action_values
from rsrl.simulator import layout as at
from rsrl.simulator import random as rng
from rsrl.simulator.lap import advance_lap
from rsrl.simulator.race import classify, copy_race, start_race
from rsrl.state.encoding import encode_row

# settings of a drive, float32
S_PLAN_SHARE, S_PIT_CHANCE, S_DELAY_CHANCE, S_BRANCH_MOST, S_BRANCH_LEAST, S_BRANCH_SCALE, S_ALL_SHARE = range(7)
S_SIZE = 7

# purposes of the exploration's draws
E_PLAN, E_UNTIL, E_BRANCH, E_DEPART, E_WHICH, E_ALL = range(6)

NOT_RUN = np.float32(np.nan)
WORST = np.float32(-1.0e30)
ZERO, ONE = np.float32(0.0), np.float32(1.0)


@kernel()
def evaluate(fig, f, k, r, car, seen, rows, values, policy, raw, x, hidden, legal, q):
    """Observe, encode and value the decision at hand; gives the best legal call."""
    write_legal(fig.whole, k, r, car, legal)
    observe_race(fig, raw, f, k, r, car, seen)
    encode_row(raw, rows, values, x)
    action_values(policy, x, hidden, q)
    best = -1
    for a in range(N_ACTIONS):
        if legal[a] and (best < 0 or q[a] > q[best]):
            best = a
    return best


@kernel()
def rollout_to_flag(fig, plans, f, k, r, actions, call, car, seen, rows, values, policy, raw, x, hidden, legal, q, positions):
    """Make a call, follow the policy to the flag, and give the car's position."""
    while True:
        actions[car] = call
        advance_lap(fig, plans, f, k, r, actions)
        actions[car] = 0
        if k[at.K_PLACE, car] >= r[at.R_RUNNING]:
            return k[at.K_PLACE, car] + 1
        if r[at.R_FLAGGED] == 1:
            classify(k, r, positions)
            return np.int32(positions[car])
        call = evaluate(fig, f, k, r, car, seen, rows, values, policy, raw, x, hidden, legal, q)


@kernel(inline="always")
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


@kernel(inline="always")
def explore(settings, legal, best, planned, key0, key1, lap, laps):
    """What is called on the way: the best call, or now and then another, so that the policy sees what it would not lead to."""
    u = rng.unit(rng.draw(key0, key1, lap, 0, E_DEPART))
    stop = some_stop(legal, rng.draw(key0, key1, lap, 0, E_WHICH))
    if planned:
        chance = np.float32(2.0) / np.float32(laps)
        call = stop if u < chance else 0
    elif best == 0:
        call = stop if u < settings[S_PIT_CHANCE] else 0
    else:
        call = 0 if u < settings[S_DELAY_CHANCE] else best
    return call if legal[call] else best


@kernel()
def branch_races(
    fig, plans, callers, seed, luck, races, car, seen, rows, values, policy, settings, memory, features, legals, scores, counts
):
    """Drive races with experiments and branch at some decisions.

    `memory` is a thread's `_Memory`. Out, for race i and its first counts[i] decisions: features [n, D, F], legals bool [n, D, 4],
    scores float32 [n, D, 4] (finishing position after each call; not a number where not run).
    """
    m = memory
    laps = fig.whole[at.I_LAPS]
    for i in range(races.shape[0]):
        start_race(fig, plans, seed, races[i], callers, m.f, m.k, m.r)
        key0, key1 = rng.race_keys(luck, races[i])
        until = 0
        if rng.unit(rng.draw(key0, key1, 0, 0, E_PLAN)) < settings[S_PLAN_SHARE]:
            until = np.int32(rng.unit(rng.draw(key0, key1, 0, 0, E_UNTIL)) * np.float32(laps)) + 1
        n = 0
        for lap in range(1, laps + 1):
            best = evaluate(fig, m.f, m.k, m.r, car, seen, rows, values, policy, m.raw, m.x, m.hidden, m.legal, m.q)
            other = -1
            for a in range(N_ACTIONS):
                if a != best and m.legal[a] and (other < 0 or m.q[a] > m.q[other]):
                    other = a
            if other >= 0 and n < features.shape[1]:
                gap = m.q[best] - m.q[other]
                spread = settings[S_BRANCH_MOST] - settings[S_BRANCH_LEAST]
                chance = settings[S_BRANCH_LEAST] + spread * np.exp(-gap / settings[S_BRANCH_SCALE])
                if rng.unit(rng.draw(key0, key1, lap, 0, E_BRANCH)) < chance:
                    stop = best if best > 0 else other
                    every = rng.unit(rng.draw(key0, key1, lap, 0, E_ALL)) < settings[S_ALL_SHARE]
                    for j in range(m.x.shape[0]):
                        features[i, n, j] = m.x[j]
                    for a in range(N_ACTIONS):
                        legals[i, n, a] = m.legal[a]
                        scores[i, n, a] = NOT_RUN
                    for a in range(N_ACTIONS):
                        if legals[i, n, a] and (a == 0 or a in (stop, best, other) or every):
                            copy_race(m.f, m.k, m.r, m.f2, m.k2, m.r2)
                            scores[i, n, a] = rollout_to_flag(
                                fig, plans, m.f2, m.k2, m.r2, m.actions, a, car, seen, rows, values, policy, m.raw, m.x2, m.hidden,
                                m.legal2, m.q2, m.positions,
                            )  # fmt: skip
                    n += 1
            call = explore(settings, m.legal, best, lap < until, key0, key1, lap, laps)
            m.actions[car] = call
            advance_lap(fig, plans, m.f, m.k, m.r, m.actions)
            m.actions[car] = 0
            if m.r[at.R_FLAGGED] == 1 or m.k[at.K_PLACE, car] >= m.r[at.R_RUNNING]:
                break
        counts[i] = n


@kernel()
def greedy_races(fig, plans, callers, seed, races, car, seen, rows, values, policy, memory, positions):
    """Positions int8 [n] of races called by the policy alone."""
    m = memory
    for i in range(races.shape[0]):
        start_race(fig, plans, seed, races[i], callers, m.f, m.k, m.r)
        call = evaluate(fig, m.f, m.k, m.r, car, seen, rows, values, policy, m.raw, m.x, m.hidden, m.legal, m.q)
        positions[i] = rollout_to_flag(
            fig, plans, m.f, m.k, m.r, m.actions, call, car, seen, rows, values, policy, m.raw, m.x, m.hidden, m.legal, m.q, m.positions
        )
