"""A race run on from where it stands, compiled: each call for the coming lap in the same futures, a network calling the rest."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.compiled import kernel
from rsrl.rollouts.branch_kernels import evaluate
from rsrl.rollouts.compiled_network import CompiledPolicy
from rsrl.rollouts.futures import draw_future
from rsrl.rollouts.plans import lookahead_memory, smooth_position
from rsrl.season import GREEN
from rsrl.simulator import Figures
from rsrl.simulator import layout as at
from rsrl.simulator import random as rng
from rsrl.simulator.lap import advance
from rsrl.simulator.race import classify, copy_race
from rsrl.state import RAW_SIZE, Encoder, RaceContext
from rsrl.state.expectation import Expectation, expected_calls_s

State = tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.int32]]

SURE_S: Final = np.float32(1.5)
SURE_SLOW_S: Final = np.float32(3.0)
"""Where staying out is better by so much expected time than any stop, on a racing lap and behind a safety car, the network is not asked.

It boxes there once in eighty races (Bahrain 2023; never at Singapore), and to ask it is what a future costs most.
"""


class Rollouts:
    """Runs races of one car on; one a running thread.

    Args:
        policy: calls the car after the coming lap.
        known, encoder: with what the policy sees.
        expectation: table of expected time (`state.expectation_table`).
    """

    def __init__(
        self, figures: Figures, car: int, policy: CompiledPolicy, known: RaceContext, encoder: Encoder, expectation: Expectation
    ) -> None:
        self._figures, self._car, self._policy, self._known = figures, car, policy, known
        self._rows, self._values, self._expectation = encoder.rows, encoder.values, expectation
        self._races = lookahead_memory()
        self._network = (
            np.zeros(RAW_SIZE, np.float32), np.zeros(encoder.width, np.float32), np.zeros((2, len(policy.bias1)), np.float32),
            np.zeros(4, np.bool_), np.zeros(4, np.float32),
        )  # fmt: skip
        self._times = np.zeros(4, np.float32), np.zeros(3, np.int32)

    def run(
        self, state: State, belief: NDArray[np.float32], calls: NDArray[np.int64], *, seed: int, first: int, futures: int
    ) -> NDArray[np.float32]:
        """Finishing places after each call, rivals close by counted in part, float32 [futures, calls].

        Args:
            state: f, k, r of the race; not changed, and nothing hidden in them is used.
            belief: what is thought of the cars (`belief_of`).
            calls: for the coming lap, int [calls], each legal; all meet the same futures.
            seed: non-negative, names the futures `first`, `first` + 1 ...

        The car is spared retirement, which no call changes.
        """
        out = np.empty((futures, len(calls)), np.float32)
        _roll_out(
            self._figures, self._figures.rival_plans, belief, *state, self._car, np.uint64(seed), first, calls.astype(np.int8),
            self._known, self._rows, self._values, self._policy, self._expectation, self._races, self._network, self._times, out,
        )  # fmt: skip
        return out


@kernel(inline="always")
def stays_for_sure(x, f, k, r, car, values, sets):
    """Whether staying out is better by so much expected time than any stop that the network need not be asked."""
    for s in range(3):
        sets[s] = k[at.K_SOFT_SETS + s, car]
    age = np.float32(k[at.K_AGE, car]) if x.max_laps_per_set > 0 else f[at.F_WEAR, car]
    expected_calls_s(x, r[at.R_LAP], r[at.R_STATUS], sets, k[at.K_COMPOUND, car], age, k[at.K_USED, car], values)
    sure = SURE_S if r[at.R_STATUS] == GREEN else SURE_SLOW_S
    return min(values[1], min(values[2], values[3])) - values[0] > sure


@kernel()
def _roll_out(fig, plans, belief, f, k, r, car, seed, first, calls, seen, rows, scales, policy, x, races, network, times, out):
    f1, k1, r1, f2, k2, r2, actions, places = races
    raw, inputs, hidden, legal, q = network
    values, sets = times
    for i in range(out.shape[0]):
        key0, key1 = rng.race_keys(seed, first + i)
        copy_race(f, k, r, f1, k1, r1)
        draw_future(fig, plans, belief, f1, k1, r1, car, car, key0, key1)
        for j in range(calls.shape[0]):
            copy_race(f1, k1, r1, f2, k2, r2)
            k2[at.K_CALLER, car], k2[at.K_PLAN, car], k2[at.K_POINTER, car], k2[at.K_NEXT, car] = at.CALLED, -1, 0, at.NO_STOP
            for other in range(at.CARS):
                actions[other] = 0
            call = int(calls[j])
            for _ in range(fig.whole[at.I_LAPS] - r[at.R_LAP]):
                actions[car] = call
                advance(fig, plans, f2, k2, r2, actions)
                call = 0
                if r2[at.R_LAP] < fig.whole[at.I_LAPS] and not stays_for_sure(x, f2, k2, r2, car, values, sets):
                    call = evaluate(fig, f2, k2, r2, car, seen, rows, scales, policy, raw, inputs, hidden, legal, q)
            classify(k2, r2, places)
            out[i, j] = smooth_position(f2, k2, r2, car, places[car])
