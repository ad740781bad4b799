"""The policy under explanation: an agent with its name and hash, evaluated on many states at once; or one that gives calls alone."""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.agents import ModelMetadata, NetworkAgent, RsrlConfig, load_agent
from rsrl.agents.goals import GOALS, Goal
from rsrl.errors import RsrlError
from rsrl.explanation.moment import Moment
from rsrl.explanation.result import Decision
from rsrl.season import RaceRecord
from rsrl.state import ACTION_NAMES, Encoder
from rsrl.strategists import (
    ExternalPolicy,
    ExternalPolicyStrategist,
    PolicyStrategist,
    find_model,
    load_policy,
    of_function,
    outside_training,
    weights_hash,
)

Floats = NDArray[np.float32]

METHODS_OF_CALLS: Final = ("what-if",)
"""Methods that need a policy's calls only, not its values."""


@dataclass(frozen=True)
class ExplainedPolicy:
    """A policy to be explained.

    Attributes:
        agent, about: the network and the metadata of its model file.
        name: as the user typed it.
        folder: of the model.
        hash: first 16 hex digits of the SHA-256 of its weights; a tree of the policy is stored under it.
    """

    agent: NetworkAgent
    about: ModelMetadata
    name: str
    folder: Path
    hash: str

    @property
    def goal(self) -> Goal | None:
        """What a policy of RSRL's own learner was trained for; None for the paper's agents."""
        return GOALS[self.about.config.get("goal", "position")] if self.agent.kind == RsrlConfig.kind else None

    @property
    def unit(self) -> str:
        """Unit of the action values; where it is places they are minus finishing positions."""
        return (self.goal or GOALS["paper-reward"]).unit

    @property
    def recurrent(self) -> bool:
        """Whether the network has a memory of the laps before."""
        return self.agent.network.memory_size > 0

    def encoder(self, record: RaceRecord) -> Encoder:
        """The encoder from raw rows to the policy's input, for one race."""
        return Encoder(self.agent.feature_set, record.scaling)

    def strategist(self, record: RaceRecord) -> PolicyStrategist:
        """The policy as a strategist."""
        return PolicyStrategist(self.agent, record, self.name)

    def q_of_rows(self, features: Floats) -> Floats:
        """Values [N, 4] of encoded rows [N, F], each with an empty memory."""
        return self.agent.q_values(features, self.agent.initial_memory(len(features)))[0]

    def q_of_sequences(self, features: Floats) -> Floats:
        """Values [N, 4] of the last lap of encoded sequences [N, T, F], starting from an empty memory."""
        if not self.recurrent:
            return self.q_of_rows(features[:, -1])
        memory = self.agent.initial_memory(len(features))
        for t in range(features.shape[1]):
            q, memory = self.agent.q_values(features[:, t], memory)
        return q

    def q(self, moment: Moment) -> Floats:
        """Values [4] of the calls at a moment."""
        return self.q_of_sequences(self.encoder(moment.record)(moment.raw)[None])[0]

    def chosen(self, q: Floats, legal: NDArray[np.bool_]) -> NDArray[np.int8]:
        """Greedy calls int8 [N] from values [N, 4] and legal calls [N, 4]; an agent without an action mask may make an illegal call."""
        return np.where(legal | (not self.agent.masked), q, -np.inf).argmax(axis=1).astype(np.int8)

    def call(self, moment: Moment) -> int:
        """The call at a moment."""
        return int(self.chosen(self.q(moment)[None], moment.legal[None])[0])

    def preferred(self, moment: Moment, calls: Sequence[int]) -> int:
        """The call among `calls` that the policy values most at a moment."""
        q = self.q(moment)
        return max(calls, key=lambda call: float(q[call]))

    def decide(self, moment: Moment) -> Decision:
        """The policy's decision at a moment."""
        q = self.q(moment)
        call = int(self.chosen(q[None], moment.legal[None])[0])
        others = _others(moment, call)
        alternative = max(others, key=lambda a: float(q[a])) if others else None
        values = {name: float(value) for name, value in zip(ACTION_NAMES, q, strict=True)}
        return _decision(self, moment, call, alternative, values, outside_training(self.about, moment.record, moment.car))


@dataclass(frozen=True)
class ExplainedCaller:
    """A policy from elsewhere to be explained: it gives calls, but no values of them.

    Attributes:
        agent: the policy.
        name: as the user typed it.
        about: nothing is known of its training.
    """

    agent: ExternalPolicy
    name: str
    about: ModelMetadata = field(default_factory=ModelMetadata)

    @property
    def hash(self) -> str:
        """First 16 hex digits of the SHA-256 of its name: its weights are not known."""
        return hashlib.sha256(self.name.encode()).hexdigest()[:16]

    def encoder(self, record: RaceRecord) -> Encoder:
        """The encoder from raw rows to the policy's input, for one race."""
        return self.agent.encoder(record)

    def strategist(self, record: RaceRecord) -> ExternalPolicyStrategist:
        """The policy as a strategist."""
        return ExternalPolicyStrategist(self.agent, record, self.name)

    def call(self, moment: Moment) -> int:
        """The call at a moment."""
        return int(self.agent.calls(self.encoder(moment.record)(moment.raw[-1:]), moment.legal[None].copy(), None)[0][0])

    def preferred(self, moment: Moment, calls: Sequence[int]) -> int:
        """The policy's own call where it is among `calls`, otherwise the one for the hardest tyre."""
        own = self.call(moment)
        return own if own in calls else max(calls)

    def decide(self, moment: Moment) -> Decision:
        """The policy's decision at a moment, without values."""
        call = self.call(moment)
        others = _others(moment, call)
        return _decision(self, moment, call, others[0] if others else None, {}, ())


AnyPolicy = ExplainedPolicy | ExplainedCaller


def _others(moment: Moment, call: int) -> list[int]:
    """The other legal calls at a moment."""
    return [a for a in range(4) if a != call and moment.legal[a]]


def _decision(
    policy: AnyPolicy, moment: Moment, call: int, alternative: int | None, values: dict[str, float], warnings: Sequence[str]
) -> Decision:
    return Decision(
        model=policy.name,
        model_hash=policy.hash,
        race=moment.record.name,
        driver=moment.driver,
        lap=moment.lap,
        call=ACTION_NAMES[call],
        alternative="" if alternative is None else ACTION_NAMES[alternative],
        q_values=values,
        legal=tuple(ACTION_NAMES[a] for a in range(4) if moment.legal[a]),
        warnings=tuple(warnings),
    )


def load_explained(model: str) -> ExplainedPolicy:
    """A shipped policy by name, or one by the path of a run folder. Raises RsrlError if there is none."""
    agent, about = load_agent(folder := find_model(model))
    return ExplainedPolicy(agent, about, model, folder, weights_hash(agent))


def load_any_policy(model: str | Path | Callable[[Floats, NDArray[np.int8]], int]) -> AnyPolicy:
    """A policy to be explained, RSRL's own or one from elsewhere.

    Args:
        model: as of `load_explained`, `model.zip`, `module:function`, or a function of an observation and the mask of legal calls.

    Raises:
        RsrlError: there is none, or it cannot be read.
    """
    if not isinstance(model, str | Path):
        name = getattr(model, "__name__", type(model).__name__)
        return ExplainedCaller(of_function(model, name), name)
    policy, about = load_policy(str(model))
    return ExplainedCaller(policy, str(model), about) if isinstance(policy, ExternalPolicy) else load_explained(str(model))


def explainable(policy: AnyPolicy, methods: Sequence[str]) -> tuple[str, ...]:
    """Those of `methods` that a policy can be explained by.

    A policy from elsewhere has no values, and one with a memory cannot be asked for the calls of one lap.
    """
    if isinstance(policy, ExplainedPolicy):
        return tuple(methods)
    return () if policy.agent.recurrent else tuple(name for name in methods if name in METHODS_OF_CALLS)


def check_methods(policy: AnyPolicy, methods: Sequence[str]) -> None:
    """Raise RsrlError where a policy cannot be explained by one of `methods`."""
    refused = [name for name in methods if name not in explainable(policy, methods)]
    if not refused:
        return
    if not explainable(policy, METHODS_OF_CALLS):
        raise RsrlError(f"{policy.name}: is not RSRL's own and has a memory of the laps before, so its calls cannot be explained")
    works = ", ".join(METHODS_OF_CALLS)
    raise RsrlError(f"{policy.name}: gives calls without values, which {refused[0]} needs; a method for any policy: {works}")
