"""A feed-forward network over many questions, compiled: none of a matrix library's threads, and the same bits whatever the batch."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.agents import NetworkAgent
from rsrl.agents.networks import N_ACTIONS, Duelling
from rsrl.compiled import kernel

Floats = NDArray[np.float32]
ZERO = np.float32(0.0)


class Weights(NamedTuple):
    """Two layers of rectified units, a head, a linear path from the inputs; `duelling`: the head's last three are beyond its first."""

    weight1: Floats  # [F, H]
    bias1: Floats
    weight2: Floats  # [H, H]
    bias2: Floats
    head: Floats  # [H, 4]
    head_bias: Floats
    skip: Floats  # [F, 4]
    duelling: bool


def weights_of(agent: NetworkAgent) -> Weights:
    """Of a `Duelling` or `FeedForward` network."""
    params: dict[str, Any] = agent.params
    skip = params.get("skip.weight", np.zeros((agent.network.n_features, N_ACTIONS)))

    def array(name: str) -> Floats:
        return np.ascontiguousarray(params[name], np.float32)

    return Weights(
        array("hidden1.weight"), array("hidden1.bias"), array("hidden2.weight"), array("hidden2.bias"), array("q.weight"), array("q.bias"),
        np.ascontiguousarray(skip, np.float32), isinstance(agent.network, Duelling),
    )  # fmt: skip


@kernel(inline="always")
def add_products(inputs, weight, total, active):
    """total [H] += inputs [n] @ weight [n, H], inputs of zero left out; eight rows a pass, so that `total` is seldom read and written."""
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
            four = xa * weight[a, j] + xb * weight[b, j] + xc * weight[c, j] + xd * weight[d, j]
            total[j] += four + (xe * weight[e, j] + xf * weight[f, j] + xg * weight[g, j] + xh * weight[h, j])
    for i in range(eights, n):
        a = active[i]
        x = inputs[a]
        for j in range(width):
            total[j] += x * weight[a, j]


@kernel(inline="always")
def rectify(values):
    """Below zero to zero."""
    for j in range(values.shape[0]):
        values[j] = max(values[j], ZERO)


@kernel()
def value_rows(w, x, hidden, active, q):
    """Action values q float32 [n, 4] of inputs x [n, F]; `hidden` float32 [2, H] and `active` int32 [max(F, H) + 1] are working memory."""
    first, second = hidden[0], hidden[1]
    for row in range(x.shape[0]):
        for j in range(first.shape[0]):
            first[j] = w.bias1[j]
            second[j] = w.bias2[j]
        add_products(x[row], w.weight1, first, active)
        rectify(first)
        add_products(first, w.weight2, second, active)
        rectify(second)
        stay, soft, medium, hard = w.head_bias[0], w.head_bias[1], w.head_bias[2], w.head_bias[3]
        for i in range(second.shape[0]):
            value = second[i]
            if value > ZERO:
                stay += value * w.head[i, 0]
                soft += value * w.head[i, 1]
                medium += value * w.head[i, 2]
                hard += value * w.head[i, 3]
        for i in range(x.shape[1]):
            value = x[row, i]
            if value != ZERO:
                stay += value * w.skip[i, 0]
                soft += value * w.skip[i, 1]
                medium += value * w.skip[i, 2]
                hard += value * w.skip[i, 3]
        base = stay if w.duelling else ZERO
        q[row, 0], q[row, 1], q[row, 2], q[row, 3] = stay, base + soft, base + medium, base + hard
