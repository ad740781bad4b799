"""Races rolled out from a moment: each option in the same futures, then the explained policy."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.agents import NetworkAgent
from rsrl.agents.networks import Duelling, FeedForward
from rsrl.explanation.moment import Moment
from rsrl.explanation.policy import AnyPolicy, ExplainedPolicy
from rsrl.rollouts import OptionRollouts, compiled_network, network_memory, policy_inputs, value_rows
from rsrl.simulator.race_arrays import RaceArrays
from rsrl.state import Observer
from rsrl.strategists import ExternalPolicy

Floats = NDArray[np.float32]

SEED_SALT: Final = 0x3FA1


class Continuation(OptionRollouts):
    """Rolls out races of one record and car under the explained policy.

    Args:
        moments: the states to go on from, all before the same lap; one as a rule.
        observer: of the race and car; made anew if None.
    """

    def __init__(self, policy: AnyPolicy, moments: Sequence[Moment], observer: Observer | None = None) -> None:
        record, car = moments[0].record, moments[0].car
        observer, encoder = observer or Observer(record, car), policy.encoder(record)
        super().__init__(
            observer.figures,
            car,
            policy_inputs(observer.context, encoder),
            BatchCaller(policy.agent) if isinstance(policy, ExplainedPolicy) else ExternalCaller(policy.agent),
            _stacked(moments),
            np.concatenate([_memory_after(policy, m) for m in moments]),
            always=not isinstance(policy, ExplainedPolicy) or policy.recurrent or not policy.agent.masked,
            salt=SEED_SALT,
        )


class BatchCaller:
    """Calls of an agent for many races. A feed-forward network runs compiled; any other network is asked as it is."""

    def __init__(self, agent: NetworkAgent) -> None:
        self._agent, self._compiled = agent, None
        if isinstance(agent.network, Duelling | FeedForward):
            self._compiled = compiled_network(agent.params, duelling=isinstance(agent.network, Duelling))

    def __call__(self, x: Floats, legal: NDArray[np.bool_], memory: Floats) -> tuple[NDArray[np.int8], Floats]:
        """Calls int8 [n] from inputs [n, F], legal calls [n, 4] and memory [n, M]; and the memory afterwards."""
        q, after = self.values(x, memory)
        if self._agent.masked:
            q = np.where(legal, q, -np.inf)
        return q.argmax(axis=1).astype(np.int8), after

    def values(self, x: Floats, memory: Floats) -> tuple[Floats, Floats]:
        """Action values [n, 4], and the memory afterwards."""
        if self._compiled is None:
            return self._agent.q_values(x, memory)
        q = np.empty((len(x), 4), np.float32)
        value_rows(self._compiled, x, network_memory(self._compiled), q)
        return q, memory


class ExternalCaller:
    """Calls of a policy from elsewhere, which has no memory, for many races."""

    def __init__(self, policy: ExternalPolicy) -> None:
        self._policy = policy

    def __call__(self, x: Floats, legal: NDArray[np.bool_], memory: Floats) -> tuple[NDArray[np.int8], Floats]:
        """As of `BatchCaller`."""
        return self._policy.calls(x, legal, None)[0], memory


def _memory_after(policy: AnyPolicy, moment: Moment) -> Floats:
    """The policy's memory [1, M] before it is asked about the lap after the moment's."""
    if not isinstance(policy, ExplainedPolicy):
        return np.zeros((1, 0), np.float32)
    memory = policy.agent.initial_memory(1)
    if policy.recurrent:
        for row in policy.encoder(moment.record)(moment.raw):
            memory = policy.agent.q_values(row[None], memory)[1]
    return memory


def _stacked(moments: Sequence[Moment]) -> RaceArrays:
    """Their arrays side by side."""
    f, k, r = zip(*(m.arrays for m in moments), strict=True)
    return RaceArrays(np.stack(f), np.stack(k), np.stack(r))
