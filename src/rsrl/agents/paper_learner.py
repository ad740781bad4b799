"""The training loop of the paper's DQN and DRQN: epsilon-greedy, replay of races, target network, no mask.

Races are driven side by side in the compiled environment, each with an epsilon of its own; then come the gradient steps that their laps
call for, several in one compiled call. Epsilon, target network and steps count races and laps as if the races had come one by one; the
weights that drive are up to `races_at_once` races old.
"""

from abc import abstractmethod
from typing import Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from rsrl.agents.config import LearnerConfig, PaperConfig
from rsrl.agents.interface import TRAINING_SEED, Learner, Metrics, NetworkAgent, TrainingEnvironment
from rsrl.agents.networks import N_ACTIONS, Network, Params
from rsrl.agents.q_learning import Loss, Weights, descend, optimiser_of
from rsrl.agents.replay import Races, Replay
from rsrl.agents.weights import join_state, split_state, to_numpy
from rsrl.errors import RsrlError

STEPS_A_CALL: Final = 10
"""Gradient steps of one compiled call; to call costs as much as a step of the DQN."""

FIRST_VALIDATION_RACE: Final = 2**33
"""Number of the first race, of a learner's own seed, on which its weights are tried; training starts at 0, evaluations on such a seed at
`evaluation.paired.APART`, 2^32."""

_INIT, _EPISODE, _VALIDATION = 0, 1, 2
"""Streams of the learner's random numbers."""


class PaperLearner(Learner):
    """Training loop of the paper's two agents; its settings are in `PaperConfig`."""

    network_kind: ClassVar[type[Network]]

    def __init__(self, config: LearnerConfig, environment: TrainingEnvironment, seed: int) -> None:
        super().__init__(config, environment, seed)
        assert isinstance(config, PaperConfig)
        _check(config)
        self.config = config
        self.network = self.network_kind(environment.n_features, config.width)
        initial = self.network.init(np.random.default_rng([seed, _INIT]))
        self.weights = Weights(initial, initial, initial)
        self.optimiser: Any = optimiser_of(config).init(initial)
        self.replay = Replay(config.replay_episodes, environment.laps, environment.n_features)
        self.updates = 0
        self.kept: Params = initial
        self.kept_position = self.validation_position = np.inf

    @property
    @abstractmethod
    def loss(self) -> Loss:
        """What a gradient step descends."""

    @abstractmethod
    def sample(self, rng: np.random.Generator) -> Any:
        """What `STEPS_A_CALL` gradient steps learn from, arrays with a leading axis of steps."""

    def advance(self, fraction: float) -> Metrics:
        """Drive `races_at_once` races and learn from them; the paper's schedules count episodes, so `fraction` is ignored."""
        del fraction
        config = self.config
        if self.iteration == 0:
            self.validate()
        rng = np.random.default_rng([self.seed, _EPISODE, self.iteration])
        episodes = self.iteration + np.arange(config.races_at_once)
        epsilon = np.maximum(config.epsilon * config.epsilon_decay**episodes, config.min_epsilon)
        races, position = self._drive(self.weights.online, episodes, rng, epsilon)
        self.replay.add(races)
        self.iteration += len(episodes)
        self.steps += int(races.laps.sum())
        self._learn(rng)
        if self._completed(config.target_episodes):
            self.weights = self.weights._replace(target=self.weights.online)
        if self._completed(config.validation_episodes):
            self.validate()
        return {
            "mean_return": float(races.reward.sum(axis=0).mean()),
            "laps": float(races.laps.mean()),
            "epsilon": float(epsilon.mean()),
            "mean_position": float(position.mean()),
            "mean_validation_position": self.validation_position,
        }

    def validate(self) -> None:
        """Call the races set aside greedily with the averaged weights; keep these where they finish further in front than those kept."""
        config, average = self.config, to_numpy(self.weights.average)
        rng, greedy = np.random.default_rng([self.seed, _VALIDATION]), np.zeros(config.races_at_once)
        firsts = range(FIRST_VALIDATION_RACE, FIRST_VALIDATION_RACE + config.validation_races, config.races_at_once)
        positions = [self._drive(average, first + np.arange(config.races_at_once), rng, greedy)[1] for first in firsts]
        self.validation_position = float(np.mean(positions))
        if self.validation_position < self.kept_position:
            self.kept, self.kept_position = average, self.validation_position

    def _drive(
        self, params: Params, numbers: NDArray[np.int64], rng: np.random.Generator, epsilon: NDArray[np.float64]
    ) -> tuple[Races, NDArray[np.int64]]:
        """Races of these numbers [N] to the flag, called greedily but for a share `epsilon` [N] of random calls; finishing positions."""
        environment, count = self.environment, len(numbers)
        policy = to_numpy(params)
        races = Races.empty(environment.laps, count, environment.n_features)
        memory = np.zeros((count, self.network.memory_size), np.float32)
        races.features[0] = environment.reset(TRAINING_SEED + self.seed, numbers).features
        going, lap = np.ones(count, np.bool_), 0
        while going.any():
            q, memory = self.network.step(policy, races.features[lap], memory)
            explores = rng.random(count) < epsilon
            races.action[lap] = np.where(explores, rng.integers(N_ACTIONS, size=count), q.argmax(axis=1))
            seen = environment.step(races.action[lap])
            races.features[lap + 1], races.reward[lap] = seen.features, seen.reward
            races.laps[going] += 1
            lap += 1
            going &= ~(seen.terminated | seen.truncated) & (lap < environment.laps)
        return races, environment.outcome().position

    def _learn(self, rng: np.random.Generator) -> None:
        """The gradient steps that the laps driven so far call for; those short of a whole call are left to the next time."""
        while self.steps // self.config.update_laps - self.updates >= STEPS_A_CALL:
            batches = self.sample(rng)
            online, average, self.optimiser = descend(self.loss, self.network, self.config, self.weights, self.optimiser, batches)
            self.weights = self.weights._replace(online=online, average=average)
            self.updates += STEPS_A_CALL

    def _completed(self, every: int) -> bool:
        """Whether the races just driven completed another `every` episodes."""
        return self.iteration // every > (self.iteration - self.config.races_at_once) // every

    def agent(self) -> NetworkAgent:
        """The greedy policy of the weights kept, without a mask as in the paper; its action values are unscaled."""
        environment, params = self.environment, to_numpy(self.kept)
        params |= {name: params[name] / np.float32(self.config.reward_scale) for name in ("q.weight", "q.bias")}
        return NetworkAgent(self.kind, environment.feature_set, environment.feature_names, False, self.network, params)

    def state(self) -> dict[str, NDArray[Any]]:
        """Weights, optimiser state, replay buffer and counters."""
        return join_state(**self._parts())

    def restore(self, state: dict[str, NDArray[Any]]) -> None:
        """See `Learner.restore`."""
        parts = split_state(state, self._parts())
        self.weights, self.optimiser, self.kept = parts["weights"], parts["optimiser"], parts["kept"]
        self.iteration, self.steps, self.updates = (int(n) for n in parts["counters"])
        self.kept_position, self.validation_position = (float(p) for p in parts["positions"])
        self.replay.restore(parts["replay"])

    def _parts(self) -> dict[str, Any]:
        return {
            "weights": self.weights,
            "optimiser": self.optimiser,
            "kept": self.kept,
            "positions": np.array([self.kept_position, self.validation_position]),
            "counters": np.array([self.iteration, self.steps, self.updates], np.int64),
            "replay": self.replay.state(),
        }


def _check(config: PaperConfig) -> None:
    if min(config.batch, config.update_laps, config.average_steps, config.races_at_once, config.validation_races) < 1:
        raise RsrlError(f"batch, update_laps, average_steps, races_at_once and validation_races of {config.kind} must be at least one")
    if config.validation_races % config.races_at_once or config.races_at_once > config.replay_episodes:
        raise RsrlError(
            f"{config.kind} drives {config.races_at_once} races at once: validation_races must be a multiple of that, "
            "and replay_episodes no less"
        )
