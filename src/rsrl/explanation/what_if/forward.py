"""The policy's network over many questions at once, with room for the results kept from lap to lap."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rsrl.agents import NetworkAgent
from rsrl.agents.networks import Duelling, FeedForward
from rsrl.explanation.what_if.kernels import rectify

Floats = NDArray[np.float32]


class Forward:
    """Calls of an agent for up to `rows` questions.

    A feed-forward network is the same function as `network.step`, without arrays made anew for every layer. Any other is asked as it is.
    """

    def __init__(self, agent: NetworkAgent, rows: int) -> None:
        self._agent = agent
        self._plain = isinstance(agent.network, Duelling | FeedForward)
        width = agent.network.width if self._plain else 0
        self._first, self._second = np.empty((rows, width), np.float32), np.empty((rows, width), np.float32)

    def __call__(self, x: Floats, legal: NDArray[np.bool_], memory: Floats) -> tuple[NDArray[np.int8], Floats]:
        """Calls int8 [n] from inputs [n, F], legal calls [n, 4] and memory [n, M]; and the memory after."""
        if self._plain:
            q, after = self.values(x), memory
        else:
            q, after = self._agent.q_values(x, memory)
        if self._agent.masked:
            q = np.where(legal, q, -np.inf)
        return q.argmax(axis=1).astype(np.int8), after

    def values(self, x: Floats) -> Floats:
        """Action values [n, 4] of a feed-forward network."""
        p: dict[str, Any] = self._agent.params
        n = len(x)
        first, second = self._first[:n], self._second[:n]
        rectify(np.matmul(x, p["hidden1.weight"], out=first), p["hidden1.bias"])
        rectify(np.matmul(first, p["hidden2.weight"], out=second), p["hidden2.bias"])
        q: Floats = second @ p["q.weight"] + p["q.bias"]
        if isinstance(self._agent.network, Duelling):
            q += x @ p["skip.weight"]
            q[:, 1:] += q[:, :1]
        return q
