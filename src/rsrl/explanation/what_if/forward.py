"""The policy's network over all the questions of a lap at once."""

import numpy as np
from numpy.typing import NDArray

from rsrl.agents import NetworkAgent
from rsrl.agents.networks import Duelling, FeedForward
from rsrl.explanation.what_if.network_kernels import value_rows, weights_of

Floats = NDArray[np.float32]


class Forward:
    """Calls of an agent. A feed-forward network runs compiled, as the function its `network.step` is; any other is asked as it is."""

    def __init__(self, agent: NetworkAgent) -> None:
        self._agent = agent
        self._weights = weights_of(agent) if isinstance(agent.network, Duelling | FeedForward) else None

    def __call__(self, x: Floats, legal: NDArray[np.bool_], memory: Floats) -> tuple[NDArray[np.int8], Floats]:
        """Calls int8 [n] from inputs [n, F], legal calls [n, 4] and memory [n, M]; and the memory after."""
        q, after = self.values(x, memory)
        if self._agent.masked:
            q = np.where(legal, q, -np.inf)
        return q.argmax(axis=1).astype(np.int8), after

    def values(self, x: Floats, memory: Floats) -> tuple[Floats, Floats]:
        """Action values [n, 4], and the memory after."""
        if self._weights is None:
            return self._agent.q_values(x, memory)
        width = len(self._weights.bias1)
        q = np.empty((len(x), 4), np.float32)
        value_rows(self._weights, x, np.empty((2, width), np.float32), np.empty(max(width, x.shape[1]) + 1, np.int32), q)
        return q, memory
