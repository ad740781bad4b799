"""Rollouts of a policy, compiled: each call for the coming lap in the same futures, the policy's network calling the laps after."""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.compiled import kernel
from rsrl.rollouts.compiled_network import CompiledNetwork
from rsrl.rollouts.compiled_policy import CompiledPolicy, DecisionMemory, decision_memory, evaluate, policy_inputs
from rsrl.rollouts.futures import Futures, open_future
from rsrl.rollouts.plans import RolloutMemory, rollout_memory, smooth_position
from rsrl.season import GREEN
from rsrl.simulator import Figures
from rsrl.simulator import layout as at
from rsrl.simulator.lap import advance
from rsrl.simulator.race import classify, copy_race
from rsrl.simulator.race_arrays import RaceArrays
from rsrl.state import Encoder, RaceContext
from rsrl.state.expectation import expected_calls_s

State = tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.int32]]

CLEAR_S: Final = np.float32(1.5)
CLEAR_SLOW_S: Final = np.float32(3.0)
"""Where staying out beats every stop by so much expected time, on a racing lap and behind a safety car, the network is not asked.

It boxes there once in eighty races (Bahrain 2023; never at Singapore), and asking it is the most expensive part of a rollout.
"""


class _Memory(NamedTuple):
    """Working memory of one thread; `expected_s` float32 [4], expected time to the flag by call."""

    races: RolloutMemory
    decision: DecisionMemory
    expected_s: NDArray[np.float32]


class PolicyRollouts:
    """Rolls out races of one car under a policy; one a running thread.

    Args:
        network: calls the car after the coming lap.
        context, encoder: what it reads of the race.
    """

    def __init__(self, figures: Figures, car: int, network: CompiledNetwork, context: RaceContext, encoder: Encoder) -> None:
        self._figures, self._car = figures, car
        self._policy = CompiledPolicy(policy_inputs(context, encoder), network)
        self._memory = _Memory(rollout_memory(), decision_memory(self._policy), np.zeros(4, np.float32))

    def run(
        self, state: State, belief: NDArray[np.float32], calls: NDArray[np.int64], *, seed: int, first: int, futures: int
    ) -> NDArray[np.float32]:
        """Finishing places after each call, rivals close by counted in part, float32 [futures, calls].

        Args:
            state: f, k, r of the race; not changed, and nothing hidden in them is used.
            belief: float32 [B_ROWS, CARS], the posterior of every car's pace (`belief_of`).
            calls: for the coming lap, int [calls], each legal; all meet the same futures.
            seed: non-negative, names the futures `first`, `first` + 1 ...

        The car is spared retirement, which no call changes.
        """
        out = np.empty((futures, len(calls)), np.float32)
        drawn = Futures(
            self._figures, self._figures.rival_plans, belief, RaceArrays(*state), self._car, self._car, np.uint64(seed)
        )  # fmt: skip
        _roll_out(drawn, first, calls.astype(np.int8), self._policy, self._memory, out)
        return out


@kernel(inline=True)
def is_clear(expectation, f, k, r, car, expected_s):
    """Whether staying out beats every stop by so much expected time that the network need not be asked."""
    age = np.float32(k[at.K_AGE, car]) if expectation.max_laps_per_set > 0 else f[at.F_WEAR, car]
    sets_left = k[at.K_SOFT_SETS : at.K_SOFT_SETS + 3, car]
    expected_calls_s(
        expectation, r[at.R_LAP], r[at.R_STATUS], sets_left, k[at.K_COMPOUND, car], age, k[at.K_USED, car], expected_s
    )  # fmt: skip
    least = CLEAR_S if r[at.R_STATUS] == GREEN else CLEAR_SLOW_S
    return min(expected_s[1], min(expected_s[2], expected_s[3])) - expected_s[0] > least


@kernel()
def _roll_out(futures, first, calls, policy, memory, out):
    """Compiled part of `PolicyRollouts.run`."""
    fig, plans, car = futures.figures, futures.plans, futures.car
    opened, driven = memory.races.opened, memory.races.driven
    actions, places = memory.races.actions, memory.races.places
    f, k, r = driven.f, driven.k, driven.r
    laps, done = fig.whole[at.I_LAPS], futures.race.r[at.R_LAP]
    for i in range(out.shape[0]):
        open_future(futures, first + i, opened, True)
        for j in range(calls.shape[0]):
            copy_race(opened.f, opened.k, opened.r, f, k, r)
            k[at.K_CALLER, car], k[at.K_PLAN, car], k[at.K_POINTER, car], k[at.K_NEXT, car] = at.CALLED, -1, 0, at.NO_STOP
            for other in range(at.CARS):
                actions[other] = 0
            call = int(calls[j])
            for _ in range(laps - done):
                actions[car] = call
                advance(fig, plans, f, k, r, actions)
                call = 0
                if r[at.R_LAP] < laps and not is_clear(policy.inputs.context.expectation, f, k, r, car, memory.expected_s):
                    call = evaluate(fig, driven, car, policy, memory.decision)
            classify(fig.whole, k, r, places)
            out[i, j] = smooth_position(fig.whole, f, k, r, car, places[car])
