"""A feed-forward network as the compiled race runs it: two hidden layers of rectified units, a head, and a linear path from the inputs.

The same function as `agents.networks.Duelling` and `agents.networks.FeedForward`. It runs inside the race, so that a rollout under a
policy costs little more than one under a plan, and it uses no threads of a matrix library, so that its bits do not depend on the batch.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.compiled import kernel

Floats = NDArray[np.float32]
N_ACTIONS = 4
ZERO = np.float32(0.0)


class CompiledNetwork(NamedTuple):
    """Weights of F inputs and H units a layer.

    Attributes:
        weight1, bias1: float32 [F, H], [H].
        weight2, bias2: float32 [H, H], [H].
        head, head_bias: float32 [H, 4], [4].
        skip: float32 [F, 4], the linear path.
        duelling: the first output is the value of staying out and the other three are advantages over it; else all are values.
    """

    weight1: Floats
    bias1: Floats
    weight2: Floats
    bias2: Floats
    head: Floats
    head_bias: Floats
    skip: Floats
    duelling: bool


class NetworkMemory(NamedTuple):
    """Working memory of one thread.

    Attributes:
        hidden: float32 [2, H].
        active: int32 [max(F, H) + 1], indices of the inputs that are not zero.
    """

    hidden: Floats
    active: NDArray[np.int32]


def compiled_network(params: Mapping[str, Any], *, duelling: bool = True) -> CompiledNetwork:
    """The weights of a network by the names of `agents.networks`; a network without a linear path gets one of zeros."""

    def array(name: str) -> Floats:
        return np.ascontiguousarray(params[name], np.float32)

    skip = params.get("skip.weight")
    if skip is None:
        skip = np.zeros((len(params["hidden1.weight"]), N_ACTIONS), np.float32)
    return CompiledNetwork(
        array("hidden1.weight"), array("hidden1.bias"), array("hidden2.weight"), array("hidden2.bias"), array("q.weight"), array("q.bias"),
        np.ascontiguousarray(skip, np.float32), duelling,
    )  # fmt: skip


def network_memory(network: CompiledNetwork) -> NetworkMemory:
    """Working memory for a network; one a running thread."""
    features, width = network.weight1.shape
    return NetworkMemory(np.empty((2, width), np.float32), np.empty(max(features, width) + 1, np.int32))


@kernel(inline=True)
def add_products(inputs, weight, total, active):
    """total [H] += inputs [n] @ weight [n, H]; returns how many inputs are not zero, and their indices in `active`.

    Inputs of zero, about a third, are left out. Eight rows are added in one pass, so that `total` is read and written an eighth as often;
    each sum still runs from the first input to the last, so the bits are those of adding row by row.
    """
    n = np.int32(0)
    for i in range(inputs.shape[0]):
        active[n] = i
        n += np.int32(inputs[i] != ZERO)
    width = total.shape[0]
    eights = n - n % 8
    for i in range(0, eights, 8):
        a, b, c, d = active[i], active[i + 1], active[i + 2], active[i + 3]
        e, f, g, h = active[i + 4], active[i + 5], active[i + 6], active[i + 7]
        xa, xb, xc, xd = inputs[a], inputs[b], inputs[c], inputs[d]
        xe, xf, xg, xh = inputs[e], inputs[f], inputs[g], inputs[h]
        for j in range(width):
            so_far = total[j] + xa * weight[a, j] + xb * weight[b, j] + xc * weight[c, j] + xd * weight[d, j]
            total[j] = so_far + xe * weight[e, j] + xf * weight[f, j] + xg * weight[g, j] + xh * weight[h, j]
    for i in range(eights, n):
        a = active[i]
        x = inputs[a]
        for j in range(width):
            total[j] += x * weight[a, j]
    return n


@kernel(inline=True)
def rectify(values):
    """Replace what is below zero by zero."""
    for j in range(values.shape[0]):
        values[j] = max(values[j], ZERO)


@kernel()
def action_values(network, x, memory, q):
    """Values of the four actions, q float32 [4], of an input x [F]."""
    first, second = memory.hidden[0], memory.hidden[1]
    for j in range(first.shape[0]):
        first[j] = network.bias1[j]
        second[j] = network.bias2[j]
    stay, soft, medium, hard = network.head_bias[0], network.head_bias[1], network.head_bias[2], network.head_bias[3]
    for n in range(add_products(x, network.weight1, first, memory.active)):
        i = memory.active[n]
        stay += x[i] * network.skip[i, 0]
        soft += x[i] * network.skip[i, 1]
        medium += x[i] * network.skip[i, 2]
        hard += x[i] * network.skip[i, 3]
    rectify(first)
    add_products(first, network.weight2, second, memory.active)
    for i in range(second.shape[0]):
        if second[i] > ZERO:
            stay += second[i] * network.head[i, 0]
            soft += second[i] * network.head[i, 1]
            medium += second[i] * network.head[i, 2]
            hard += second[i] * network.head[i, 3]
    base = stay if network.duelling else ZERO
    q[0], q[1], q[2], q[3] = stay, base + soft, base + medium, base + hard


@kernel()
def value_rows(network, x, memory, q):
    """Values of the four actions, q float32 [n, 4], of inputs x [n, F]."""
    for row in range(x.shape[0]):
        action_values(network, x[row], memory, q[row])
