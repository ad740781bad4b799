"""A feed-forward policy as the compiled race runs it: two hidden layers of rectified units, a duelling head, a linear path.

The same function as `agents.networks.Duelling`, inside the race, so that a race called by it costs little more than one run on plans.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.compiled import kernel

Floats = NDArray[np.float32]
N_ACTIONS = 4


class CompiledPolicy(NamedTuple):
    """Weights: F inputs, H units a layer. The head gives the value of staying out and the advantages of the three stops over it."""

    weight1: Floats  # [F, H]
    bias1: Floats
    weight2: Floats  # [H, H]
    bias2: Floats
    head: Floats  # [H, 4]
    head_bias: Floats
    skip: Floats  # [F, 4]


def compiled_policy(params: Mapping[str, Any]) -> CompiledPolicy:
    """The weights of a `Duelling` network by its names, as the kernels read them."""
    names = ("hidden1.weight", "hidden1.bias", "hidden2.weight", "hidden2.bias", "q.weight", "q.bias", "skip.weight")
    return CompiledPolicy(*(np.ascontiguousarray(params[name], np.float32) for name in names))


@kernel()
def action_values(policy, x, hidden, q):
    """Values of the four actions, q float32 [4], of an input x [F]; `hidden` [2, H] is working memory."""
    zero = np.float32(0.0)
    width = policy.bias1.shape[0]
    first, second = hidden[0], hidden[1]
    for j in range(width):
        first[j] = policy.bias1[j]
        second[j] = policy.bias2[j]
    for a in range(N_ACTIONS):
        q[a] = policy.head_bias[a]
    for i in range(x.shape[0]):  # input by input: the inner loops run along rows, which processors do many at a time
        value = x[i]
        if value != zero:
            for j in range(width):
                first[j] += value * policy.weight1[i, j]
            for a in range(N_ACTIONS):
                q[a] += value * policy.skip[i, a]
    for i in range(width):
        value = first[i]
        if value > zero:
            for j in range(width):
                second[j] += value * policy.weight2[i, j]
    for i in range(width):
        value = second[i]
        if value > zero:
            for a in range(N_ACTIONS):
                q[a] += value * policy.head[i, a]
    for a in range(1, N_ACTIONS):
        q[a] += q[0]
