"""Interfaces of agents, learners and training environments."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from rsrl.agents.config import LearnerConfig
from rsrl.agents.networks import Network, Params, greedy_actions

TRAINING_SEED: Final = 1_000_000
"""Added to a learner's seed for its races, so that no training race has an evaluation seed below a million."""


FloatArray = NDArray[np.float32]


class Observed(Protocol):
    """Result of a reset."""

    @property
    def features(self) -> NDArray[np.float32]:
        """Scaled and one-hot encoded features, [B, F]."""

    @property
    def legal(self) -> NDArray[np.bool_]:
        """Which of the four actions are legal, [B, 4]."""


class Stepped(Observed, Protocol):
    """Result of a lap."""

    @property
    def reward(self) -> NDArray[np.float32]:
        """Reward of the lap, [B]."""

    @property
    def terminated(self) -> NDArray[np.bool_]:
        """The race is over, [B]."""

    @property
    def truncated(self) -> NDArray[np.bool_]:
        """The race was cut short, [B]; learners treat that as its end."""


class Ended(Protocol):
    """Result of races."""

    @property
    def position(self) -> NDArray[np.int64]:
        """Finishing position of each race, [B]; 1 is the best."""


class TrainingEnvironment(Protocol):
    """What a learner needs of an environment; the real one is `rsrl.environment.RaceEnvironment`.

    All B races advance together, one decision per lap. A terminated race stays terminated, with reward 0, whatever the actions. Arrays may
    be views of buffers that the next call overwrites.
    """

    @property
    def laps(self) -> int:
        """Number of decisions in a full race."""

    @property
    def n_features(self) -> int:
        """Number of features, F."""

    @property
    def feature_set(self) -> str:
        """ "paper", "full" or "named"."""

    @property
    def feature_names(self) -> tuple[str, ...]:
        """Names of the features."""

    def reset(self, seed: int, races: NDArray[np.int64]) -> Observed:
        """Start the races of these numbers, [B]; seed and number determine all random numbers of a race."""

    def step(self, actions: NDArray[np.int8]) -> Stepped:
        """Drive one lap with these actions, [B]."""

    def outcome(self) -> Ended:
        """How the races ended, once all of them have."""


EnvironmentFactory = Callable[[LearnerConfig], Any]
"""Makes the environment for a learner of these settings: a `TrainingEnvironment` for the paper's agents, a `rsrl.BranchingEnvironment` for
RSRL's."""


class Agent(Protocol):
    """Maps the features of a lap and a memory of earlier laps to values of the four actions."""

    @property
    def kind(self) -> str:
        """Name in `AGENTS`."""

    @property
    def feature_set(self) -> str:
        """Feature set it reads: "paper", "full" or "named"."""

    @property
    def feature_names(self) -> tuple[str, ...]:
        """Names of its features."""

    def initial_memory(self, batch: int) -> FloatArray:
        """Memory at the start of a race, [B, M]."""

    def q_values(self, features: FloatArray, memory: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Action values [B, 4] and the next memory."""

    def act(self, features: FloatArray, legal: NDArray[np.bool_], memory: FloatArray) -> tuple[NDArray[np.int8], FloatArray]:
        """The best action of each race, [B], and the next memory."""


@dataclass(frozen=True)
class NetworkAgent:
    """An agent with a Q-network, evaluated in NumPy; kinds differ in the network and in action masking.

    Attributes:
        kind: name in `AGENTS`.
        feature_set: it was trained on: "paper", "full" or "named".
        feature_names: names of its features, in order.
        masked: whether illegal actions are masked; the paper's agents are not masked.
        network: shape of the network.
        params: weights, float32 arrays by name. Action values are expected returns; RSRL's are minus expected finishing positions.
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
        """Action values float32 [B, 4] and the next memory, from features [B, F] and memory [B, M], neither of which is changed."""
        return self.network.step(self.params, features, memory)

    def act(self, features: FloatArray, legal: NDArray[np.bool_], memory: FloatArray) -> tuple[NDArray[np.int8], FloatArray]:
        """The best action of each race, int8 [B], and the next memory."""
        q, memory = self.q_values(features, memory)
        return greedy_actions(q, legal if self.masked else None), memory


Metrics = dict[str, float]
"""Metrics of one iteration: `mean_position`, `mean_return` in reward and `mean_validation_position` (DQN, DRQN), and others."""


class Learner(ABC):
    """A training run in progress, advanced by `training.train`.

    It is a deterministic function of settings, environment, seed and the fractions that it is advanced with.
    """

    kind: ClassVar[str]

    def __init__(self, config: LearnerConfig, environment: Any, seed: int) -> None:
        self.environment = environment
        self.seed = seed
        self.iteration = 0
        self.steps = 0

    @abstractmethod
    def advance(self, fraction: float) -> Metrics:
        """One iteration (RSRL) or a few episodes (DQN, DRQN); schedules follow `fraction`, the share of the budget used so far."""

    @abstractmethod
    def agent(self) -> NetworkAgent:
        """The current policy, with a copy of the weights."""

    @abstractmethod
    def state(self) -> dict[str, NDArray[Any]]:
        """Everything needed to continue bit for bit, as named arrays."""

    @abstractmethod
    def restore(self, state: dict[str, NDArray[Any]]) -> None:
        """Continue from the `state()` of a learner with the same settings, environment and seed."""
