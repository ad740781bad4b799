"""RSRL's own learner: Q(lambda) through whole races.

An iteration learns from races driven with the weights of the iteration before, so that the simulator (in compiled
code, on this thread) works while XLA computes the update on another. That lag is exactly one iteration, whatever
the machine's speed, so the same seed and schedule give the same bits.
"""

from functools import partial
from typing import Any, ClassVar

import numpy as np
import optax
from numpy.typing import NDArray

from rsrl.agents.collection import Races, collect, empty_races
from rsrl.agents.config import LearnerConfig, RsrlConfig
from rsrl.agents.exploration import draw_experiments
from rsrl.agents.interface import TRAINING_SEED, Learner, Metrics, NetworkAgent, TrainingEnvironment, mean_position
from rsrl.agents.jax_setup import jax, jnp
from rsrl.agents.networks import N_ACTIONS, MinGru, Network, Params, mask_illegal
from rsrl.agents.returns import q_lambda_returns
from rsrl.agents.weights import join_state, rescaled_head, split_state, to_numpy
from rsrl.errors import RsrlError

Array = Any

OUTLOOK_FEATURES = ("outlook_stay_s", "outlook_soft_s", "outlook_medium_s", "outlook_hard_s")
"""The features that say what each action costs to the flag in clean air, by action."""

_INIT, _EXPLORE = 0, 1
"""Purposes of the learner's random numbers, so that no two draws share a stream."""


class RsrlLearner(Learner):
    """See the module; `RsrlConfig` holds the settings."""

    kind: ClassVar[str] = "rsrl"

    def __init__(self, config: LearnerConfig, environment: TrainingEnvironment, seed: int) -> None:
        super().__init__(config, environment, seed)
        assert isinstance(config, RsrlConfig)
        if config.races % config.minibatch_races:
            raise RsrlError(f"races ({config.races}) must be a multiple of minibatch_races ({config.minibatch_races})")
        self.config = config
        self.network = MinGru(environment.n_features, config.width)
        self.params: Params = self.network.init(np.random.default_rng([seed, _INIT]))
        self.params["skip.weight"] = outlook_start(environment.feature_names, config.outlook_weight)
        self.optimiser: Any = _optimiser(config).init(self.params)
        self._driver: Params = self.params  # the weights that drove, or will drive, the races in `_next`
        self._buffers = (empty_races(config, environment), empty_races(config, environment))
        self._metrics: Metrics = {}
        self._collected = False
        self._next_fraction = 0.0

    def advance(self, fraction: float) -> Metrics:
        """Learn from the races at hand while driving the next ones; see `Learner.advance`."""
        if not self._collected:
            self._drive(self.iteration, self._next_fraction)
        races, metrics, driver = self._buffers[self.iteration % 2], self._metrics, self.params
        rate = _between(self.config.learning_rate, self.config.final_learning_rate, fraction)
        self.params, self.optimiser, loss = update(self.network, self.config, self.params, self.optimiser, races, jnp.float32(rate))
        self._driver = to_numpy(driver)
        self.iteration += 1
        self._next_fraction = fraction
        self._drive(self.iteration, fraction)
        self.steps += int(races.running.sum())
        return metrics | {"loss": float(loss)}

    def _drive(self, iteration: int, fraction: float) -> None:
        config, races = self.config, self._buffers[iteration % 2]
        share = _between(config.plan_share, config.final_plan_share, fraction)
        rng = np.random.default_rng([self.seed, _EXPLORE, iteration])
        experiments = draw_experiments(rng, self.environment.laps, config.races, share)
        names = iteration * config.races + np.arange(config.races, dtype=np.int64)
        collect(races, config, self.environment, self.network, self._driver, (TRAINING_SEED + self.seed, names), experiments)
        self._metrics = _summary(races, self.environment)
        self._collected = True

    def agent(self) -> NetworkAgent:
        """The policy, its action values in the reward's units."""
        params = rescaled_head(to_numpy(self.params), 1.0 / self.config.reward_scale)
        environment = self.environment
        return NetworkAgent(self.kind, environment.feature_set, environment.feature_names, True, self.network, params)

    def state(self) -> dict[str, NDArray[Any]]:
        """Weights now and of the iteration before, which the races at hand were driven with; optimiser; counters."""
        counters = np.array([self.iteration, self.steps], np.int64)
        fraction = np.array(self._next_fraction)
        return join_state(params=self.params, driver=self._driver, optimiser=self.optimiser, counters=counters, fraction=fraction)

    def restore(self, state: dict[str, NDArray[Any]]) -> None:
        """See `Learner.restore`; the races at hand are driven again, which gives the same ones."""
        like = {"params": self.params, "driver": self._driver, "optimiser": self.optimiser}
        parts = split_state(state, like | {"counters": np.zeros(2, np.int64), "fraction": np.zeros(())})
        self.params, self._driver, self.optimiser = parts["params"], parts["driver"], parts["optimiser"]
        self.iteration, self.steps = (int(n) for n in parts["counters"])
        self._next_fraction = float(parts["fraction"])
        self._collected = False


def outlook_start(names: tuple[str, ...], weight: float) -> NDArray[np.float32]:
    """Linear weights [F, 4] by which each action is first valued at minus its clean-air loss; zero without such features.

    Learning then starts from the best plan for an empty track instead of from staying out for ever.
    """
    weights = np.zeros((len(names), N_ACTIONS), np.float32)
    for action, feature in enumerate(OUTLOOK_FEATURES):
        if feature in names:
            weights[names.index(feature), action] = -weight
    return weights


def _between(start: float, end: float, fraction: float) -> float:
    return start + (end - start) * min(max(fraction, 0.0), 1.0)


def _summary(races: Races, environment: TrainingEnvironment) -> Metrics:
    """Mean return and position of the races that were driven without experiments (of all, where there is none)."""
    returns = races.rewards.sum(axis=1).ravel()
    greedy = races.followed.all(axis=1).ravel()
    among = greedy if greedy.any() else ~greedy
    return {"mean_return": float(returns[among].mean()), "return_exploring": float(returns.mean())} | mean_position(environment, among)


def _optimiser(config: RsrlConfig) -> optax.GradientTransformation:
    # The learning rate changes from iteration to iteration, so it is applied outside.
    return optax.flatten(optax.chain(optax.clip_by_global_norm(config.clip), optax.scale_by_adam()))


@partial(jax.jit, static_argnums=(0, 1))
def update(
    network: Network, config: RsrlConfig, params: Params, optimiser: Any, races: Races, learning_rate: Array
) -> tuple[Params, Any, Array]:
    """`epochs` passes over the minibatches; gives weights, optimiser state and the mean loss."""
    transform = _optimiser(config)
    groups = races.actions.shape[0]

    def one(carry: tuple[Params, Any], k: Array) -> tuple[tuple[Params, Any], Array]:
        params, optimiser = carry
        group = Races(*(jax.lax.dynamic_index_in_dim(x, k % groups, keepdims=False) for x in races))
        loss, gradient = jax.value_and_grad(race_loss, argnums=2)(network, config, params, group)
        steps, optimiser = transform.update(gradient, optimiser, params)
        return (jax.tree.map(lambda p, s: p - learning_rate * s, params, steps), optimiser), loss

    (params, optimiser), losses = jax.lax.scan(one, (params, optimiser), jnp.arange(groups * config.epochs))
    return params, optimiser, losses.mean()


def race_loss(network: Network, config: RsrlConfig, params: Params, races: Races) -> Array:
    """Mean squared error of the driven actions' values against their Q(lambda) returns, over all laps driven.

    `races` is one minibatch, [T, B, ...]. The returns use the values of the weights being learned: no target network.
    """
    q = network.sequence(params, races.features)
    values = jax.lax.stop_gradient(mask_illegal(q, races.legal, jnp).max(axis=-1))
    values = jnp.where(races.running, values, 0.0)
    targets = q_lambda_returns(races.rewards * config.reward_scale, values, races.running, races.followed, config.lambda_)
    chosen = jnp.sum(jnp.where(races.actions[..., None] == jnp.arange(q.shape[-1]), q, 0.0), axis=-1)
    errors = jnp.where(races.running, chosen - targets, 0.0)
    return jnp.sum(errors**2) / jnp.maximum(races.running.sum(), 1)
