"""What the rest of RSRL sees of agents and learners."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from rsrl.agents.config import LearnerConfig
from rsrl.agents.networks import Network, Params, greedy_actions

TRAINING_SEED: Final = 1_000_000
"""Added to a learner's seed to name its races, so that none of them is a race of an evaluation seed below a million."""


FloatArray = NDArray[np.float32]


class Observed(Protocol):
    """What a reset gives."""

    @property
    def features(self) -> NDArray[np.float32]:
        """Scaled and one-hot encoded, [B, F]."""

    @property
    def legal(self) -> NDArray[np.bool_]:
        """Which of the four actions may be chosen, [B, 4]."""


class Stepped(Observed, Protocol):
    """What a lap gives."""

    @property
    def reward(self) -> NDArray[np.float32]:
        """The lap's reward, [B]."""

    @property
    def terminated(self) -> NDArray[np.bool_]:
        """The race is over, [B]."""

    @property
    def truncated(self) -> NDArray[np.bool_]:
        """The race was broken off, [B]; learners take that for its end."""


class TrainingEnvironment(Protocol):
    """What a learner needs of an environment; `rsrl.environment.RaceEnvironment` is the real one, toys are others.

    All B races advance together, one decision a lap. A race that has terminated stays so, with reward 0, whatever
    is done. Arrays may be views of buffers that the next call reuses.
    """

    @property
    def laps(self) -> int:
        """Decisions of a full race; none lasts longer."""

    @property
    def n_features(self) -> int:
        """F."""

    @property
    def feature_set(self) -> str:
        """ "paper", "full" or "named"."""

    @property
    def feature_names(self) -> tuple[str, ...]:
        """F names."""

    def reset(self, seed: int, races: NDArray[np.int64]) -> Observed:
        """Start the races of these numbers, [B]; seed and number name a race's whole luck."""

    def step(self, actions: NDArray[np.int8]) -> Stepped:
        """Drive one lap with these actions, [B]."""


EnvironmentFactory = Callable[[LearnerConfig], Any]
"""Makes the environment a learner of these settings needs: a `TrainingEnvironment` of one race for the paper's, one whose races
branch (rsrl.py) for RSRL's."""


class Agent(Protocol):
    """Calls races: values of the four actions from what is seen now and a memory of the laps before."""

    @property
    def kind(self) -> str:
        """Name in `AGENTS`."""

    @property
    def feature_set(self) -> str:
        """Observations it reads, "paper", "full" or "named"."""

    @property
    def feature_names(self) -> tuple[str, ...]:
        """Their columns."""

    def initial_memory(self, batch: int) -> FloatArray:
        """Memory at the start of a race, [B, M]."""

    def q_values(self, features: FloatArray, memory: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Action values [B, 4] and the next memory."""

    def act(self, features: FloatArray, legal: NDArray[np.bool_], memory: FloatArray) -> tuple[NDArray[np.int8], FloatArray]:
        """The best action of each race, [B], and the next memory."""


@dataclass(frozen=True)
class NetworkAgent:
    """An agent that is a Q-network, run in NumPy; the kinds differ in network and in whether they see the mask.

    Attributes:
        kind: name in `AGENTS`.
        feature_set: observations it was trained on, "paper", "full" or "named".
        feature_names: their columns, in order.
        masked: it never chooses an action marked illegal. The paper's agents are not masked.
        network: shape of the network.
        params: its weights, NumPy float32 arrays by name; action values are in the reward's units, RSRL's minus finishing positions.
    """

    kind: str
    feature_set: str
    feature_names: tuple[str, ...]
    masked: bool
    network: Network
    params: Params = field(repr=False)

    def initial_memory(self, batch: int) -> FloatArray:
        """Empty memory [B, M] at the start of a race; M is zero for a feed-forward network."""
        return np.zeros((batch, self.network.memory_size), np.float32)

    def q_values(self, features: FloatArray, memory: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Expected return of each action, float32 [B, 4], from features [B, F] and memory [B, M]; and the next memory.

        Neither argument is written to.
        """
        return self.network.step(self.params, features, memory)

    def act(self, features: FloatArray, legal: NDArray[np.bool_], memory: FloatArray) -> tuple[NDArray[np.int8], FloatArray]:
        """The best action of each race, int8 [B], and the next memory."""
        q, memory = self.q_values(features, memory)
        return greedy_actions(q, legal if self.masked else None), memory


def mean_position(environment: TrainingEnvironment, among: NDArray[np.bool_]) -> dict[str, float]:
    """`{"mean_position": ...}` of the races `among` [B] that have just ended, where the environment knows it; else nothing."""
    outcome = getattr(environment, "outcome", None)
    if outcome is None or not among.any():
        return {}
    return {"mean_position": float(outcome().position[among].mean())}


Metrics = dict[str, float]
"""Figures of one iteration: `mean_return` in the reward's units (DQN, DRQN), `mean_position` where the environment knows it."""


class Learner(ABC):
    """A training run in progress. One is built from settings, an environment and a seed, and advanced by `training.train`.

    Everything it does is a function of those, of the fractions it is advanced with, and of nothing else.
    """

    kind: ClassVar[str]

    def __init__(self, config: LearnerConfig, environment: Any, seed: int) -> None:
        self.environment = environment
        self.seed = seed
        self.iteration = 0
        self.steps = 0

    @abstractmethod
    def advance(self, fraction: float) -> Metrics:
        """One iteration (RSRL) or episode (DQN, DRQN); `fraction` of the budget is used up, which schedules follow."""

    @abstractmethod
    def agent(self) -> NetworkAgent:
        """The policy learned so far, its weights copied."""

    @abstractmethod
    def state(self) -> dict[str, NDArray[Any]]:
        """All that is needed to continue bit by bit, as named arrays."""

    @abstractmethod
    def restore(self, state: dict[str, NDArray[Any]]) -> None:
        """Take up a state of `state()`, in a learner built from the same settings, environment and seed."""
