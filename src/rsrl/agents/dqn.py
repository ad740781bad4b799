"""The paper's DQN, and the training loop it shares with the DRQN: one race at a time, epsilon-greedy, replay, target network, no mask."""

from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar

import numpy as np
import optax
from numpy.typing import NDArray

from rsrl.agents.config import LearnerConfig, PaperConfig
from rsrl.agents.interface import TRAINING_SEED, Learner, Metrics, NetworkAgent, TrainingEnvironment, mean_position
from rsrl.agents.jax_setup import jax, jnp
from rsrl.agents.networks import N_ACTIONS, FeedForward, Network, Params
from rsrl.agents.replay import Laps, Replay
from rsrl.agents.weights import join_state, split_state, to_numpy

Array = Any

_INIT, _EPISODE = 0, 1
"""Streams of the learner's random numbers."""


class PaperLearner(Learner):
    """Training loop of the paper's two agents; its settings are in `PaperConfig`."""

    network_kind: ClassVar[type[Network]]

    def __init__(self, config: LearnerConfig, environment: TrainingEnvironment, seed: int) -> None:
        super().__init__(config, environment, seed)
        assert isinstance(config, PaperConfig)
        self.config = config
        self.network = self.network_kind(environment.n_features, config.width)
        self.params: Params = self.network.init(np.random.default_rng([seed, _INIT]))
        self.target: Params = self.params
        self._policy: Params = self.params
        self.optimiser: Any = _optimiser(config).init(self.params)
        self.replay = Replay(config.replay_transitions, environment.n_features)
        self.epsilon = config.epsilon

    def gradient_step(self, rng: np.random.Generator) -> None:
        """One gradient step on a sample of the replay buffer."""
        raise NotImplementedError

    def advance(self, fraction: float) -> Metrics:
        """Drive one race and learn from it; the paper's schedules count episodes, so `fraction` is ignored."""
        del fraction
        config, environment = self.config, self.environment
        rng = np.random.default_rng([self.seed, _EPISODE, self.iteration])
        features = environment.reset(TRAINING_SEED + self.seed, np.array([self.iteration], np.int64)).features.copy()
        memory = np.zeros((1, self.network.memory_size), np.float32)
        total, ended, lap = 0.0, False, 0
        while not ended:
            q, memory = self.network.step(self._policy, features, memory)
            explores = rng.random() < self.epsilon
            action = int(rng.integers(N_ACTIONS)) if explores else int(q[0].argmax())
            seen = environment.step(np.array([action], np.int8))
            reward, ended = float(seen.reward[0]), bool(seen.terminated[0] or seen.truncated[0] or lap == environment.laps - 1)
            self.replay.add(features[0], action, reward, seen.features[0], ended, first=lap == 0)
            features, total, lap = seen.features.copy(), total + reward, lap + 1
            self.steps += 1
            if self.replay.size >= config.batch and self.steps % config.update_laps == 0:
                self.gradient_step(rng)
        self._end_episode()
        return {"mean_return": total, "laps": float(lap), "epsilon": self.epsilon} | mean_position(environment, np.ones(1, np.bool_))

    def _end_episode(self) -> None:
        self.iteration += 1
        self.epsilon = max(self.epsilon * self.config.epsilon_decay, self.config.min_epsilon)
        if self.iteration % self.config.target_episodes == 0:
            self.target = self.params

    def apply(self, step: Callable[..., tuple[Params, Any]], *batch: Any) -> None:
        """Run a compiled gradient step; the next lap is decided with the new weights, copied to NumPy arrays."""
        self.params, self.optimiser = step(self.network, self.config, self.params, self.target, self.optimiser, *batch)
        self._policy = {name: np.asarray(value) for name, value in self.params.items()}

    def agent(self) -> NetworkAgent:
        """The greedy policy, without a mask as in the paper."""
        environment = self.environment
        return NetworkAgent(self.kind, environment.feature_set, environment.feature_names, False, self.network, to_numpy(self.params))

    def state(self) -> dict[str, NDArray[Any]]:
        """Both networks, optimiser state, replay buffer and counters."""
        return join_state(**self._parts(), replay=self.replay.state())

    def restore(self, state: dict[str, NDArray[Any]]) -> None:
        """See `Learner.restore`."""
        parts = split_state(state, self._parts() | {"replay": self.replay.state()})
        self.params, self.target, self.optimiser = parts["params"], parts["target"], parts["optimiser"]
        self._policy = to_numpy(self.params)
        self.iteration, self.steps = (int(n) for n in parts["counters"])
        self.epsilon = float(parts["epsilon"])
        self.replay.restore(parts["replay"])

    def _parts(self) -> dict[str, Any]:
        counters = np.array([self.iteration, self.steps], np.int64)
        return {
            "params": self.params,
            "target": self.target,
            "optimiser": self.optimiser,
            "counters": counters,
            "epsilon": np.array(self.epsilon),
        }


class DqnLearner(PaperLearner):
    """The paper's first model; its settings are in `DqnConfig`."""

    kind: ClassVar[str] = "dqn"
    network_kind = FeedForward

    def gradient_step(self, rng: np.random.Generator) -> None:
        """One step on transitions sampled from the replay buffer."""
        self.apply(_transition_step, self.replay.sample(rng, self.config.batch))


def _optimiser(config: PaperConfig) -> optax.GradientTransformation:
    return optax.flatten(optax.adamw(config.learning_rate, weight_decay=config.weight_decay))


def descend(config: PaperConfig, loss: Callable[[Params], Array], params: Params, optimiser: Any) -> tuple[Params, Any]:
    """One AdamW step on `loss`; returns weights and optimiser state."""
    steps, optimiser = _optimiser(config).update(jax.grad(loss)(params), optimiser, params)
    return optax.apply_updates(params, steps), optimiser


def one_step_targets(config: PaperConfig, reward: Array, next_q: Array, ended: Array) -> Array:
    """One-step targets: `r + gamma max Q'`, or `r` at the end of a race; `next_q` [..., 4] is the target network's."""
    return reward + config.gamma * jnp.where(ended, 0.0, next_q.max(axis=-1))


def clipped_errors(config: PaperConfig, q: Array, action: Array, targets: Array) -> Array:
    """Huber loss of the values of the actions taken, in the shape of `targets`."""
    chosen = jnp.sum(jnp.where(action[..., None] == jnp.arange(N_ACTIONS), q, 0.0), axis=-1)
    return optax.losses.huber_loss(chosen, targets, delta=config.huber_delta)


@partial(jax.jit, static_argnums=(0, 1))
def _transition_step(
    network: Network, config: PaperConfig, params: Params, target: Params, optimiser: Any, laps: Laps
) -> tuple[Params, Any]:
    targets = one_step_targets(config, laps.reward, network.sequence(target, laps.next_features), laps.ended)

    def loss(params: Params) -> Array:
        return clipped_errors(config, network.sequence(params, laps.features), laps.action, targets).mean()

    return descend(config, loss, params, optimiser)
