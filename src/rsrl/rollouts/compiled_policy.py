"""A policy inside the compiled race: from the race's arrays to the best legal call, without leaving compiled code."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.compiled import kernel
from rsrl.environment.kernels import observe_race, write_legal
from rsrl.rollouts.compiled_network import N_ACTIONS, CompiledNetwork, NetworkMemory, action_values, network_memory
from rsrl.state import RAW_SIZE, Encoder, RaceContext
from rsrl.state.encoding import encode_row


class PolicyInputs(NamedTuple):
    """How a policy sees a race.

    Attributes:
        context: of the race and car.
        columns: column of the raw row and width of each feature, int32 [n, 2] (`Encoder.rows`).
        scales: low end, factor and floor of each feature, float32 [n, 3] (`Encoder.values`).
        width: columns of the network input.
    """

    context: RaceContext
    columns: NDArray[np.int32]
    scales: NDArray[np.float32]
    width: int


class CompiledPolicy(NamedTuple):
    """A network and what it reads."""

    inputs: PolicyInputs
    network: CompiledNetwork


class DecisionMemory(NamedTuple):
    """Working memory of one thread, which holds the last decision.

    Attributes:
        raw: raw row float32 [RAW_SIZE].
        x: network input float32 [F].
        legal: bool [4].
        q: action values float32 [4].
        network: of the network.
    """

    raw: NDArray[np.float32]
    x: NDArray[np.float32]
    legal: NDArray[np.bool_]
    q: NDArray[np.float32]
    network: NetworkMemory


def policy_inputs(context: RaceContext, encoder: Encoder) -> PolicyInputs:
    """How a policy of an encoder's feature set sees a race."""
    return PolicyInputs(context, encoder.rows, encoder.values, encoder.width)


def decision_memory(policy: CompiledPolicy) -> DecisionMemory:
    """Working memory for a policy; one a running thread."""
    return DecisionMemory(
        np.zeros(RAW_SIZE, np.float32), np.zeros(policy.inputs.width, np.float32), np.zeros(N_ACTIONS, np.bool_),
        np.zeros(N_ACTIONS, np.float32), network_memory(policy.network),
    )  # fmt: skip


@kernel()
def evaluate(fig, race, car, policy, memory):
    """Observe the decision at hand, value its calls and return the best legal one; `memory` holds all of it afterwards."""
    legal, q = memory.legal, memory.q
    write_legal(fig.whole, race.k, race.r, car, legal)
    observe_race(fig.whole, fig.tyres, memory.raw, race.f, race.k, race.r, car, policy.inputs.context)
    encode_row(memory.raw, policy.inputs.columns, policy.inputs.scales, memory.x)
    action_values(policy.network, memory.x, memory.network, q)
    best = -1
    for a in range(N_ACTIONS):
        if legal[a] and (best < 0 or q[a] > q[best]):
            best = a
    return best
