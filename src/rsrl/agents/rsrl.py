"""RSRL's own learner: policy iteration on branched races.

At some decisions of a race the same race is run on once for each call, a policy calling the rest. Luck is the same in all
branches, so the difference between their finishing places is a sharp, unbiased measure of what a call is worth: its variance
is a tenth of that of two separate races. The network learns those differences.

For most of the budget the races are driven and run on by the calls of least expected time that learning starts from, whose
value does not move while it is learned; then by the policy itself, so that it also learns what its own later calls make of each.

An iteration learns from races driven with the weights of the iteration before, so that the simulator (compiled, on its own
threads) works while XLA computes the update. That lag is exactly one iteration, whatever the machine's speed, so the same
seed and schedule give the same bits.
"""

from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import Any, ClassVar, Protocol

import numpy as np
import optax
from numpy.typing import NDArray

from rsrl.agents.config import LearnerConfig, RsrlConfig
from rsrl.agents.interface import TRAINING_SEED, Learner, Metrics, NetworkAgent
from rsrl.agents.jax_setup import jax, jnp
from rsrl.agents.networks import N_ACTIONS, Duelling, Params
from rsrl.agents.weights import join_state, split_state, to_numpy
from rsrl.errors import RsrlError
from rsrl.rollouts import Branches, Branching

Array = Any

EXPECTED_FEATURES = ("expected_stay_s", "expected_soft_s", "expected_medium_s", "expected_hard_s")
"""The features that say what each action is expected to cost to the flag on an empty track, by action."""

MIDFIELD = -10.0
"""Value of a decision before anything is learned: minus a finishing position."""

_INIT, _SHUFFLE = 0, 1
"""Purposes of the learner's random numbers, so that no two draws share a stream."""


class BranchingEnvironment(Protocol):
    """What this learner needs of an environment; `rsrl.environment.BranchingRaces` is the real one, toys are others."""

    feature_set: str
    feature_names: tuple[str, ...]
    n_features: int
    expected_scale_s: float  # seconds that the range of an expected-time feature stands for

    def branch(self, params: Params, branching: Branching, seed: int, iteration: int, races: int) -> Branches:
        """Drive an iteration's races with these weights and branch; a pure function of its arguments."""


class RsrlLearner(Learner):
    """See the module; `RsrlConfig` holds the settings."""

    kind: ClassVar[str] = "rsrl"

    def __init__(self, config: LearnerConfig, environment: Any, seed: int) -> None:
        super().__init__(config, environment, seed)
        assert isinstance(config, RsrlConfig)
        _check(config)
        self.config = config
        self.races: BranchingEnvironment = environment
        self.network = Duelling(environment.n_features, config.width)
        self.params: Params = self.network.init(np.random.default_rng([seed, _INIT]))
        self.params |= {name: starting_policy(environment, config)[name] for name in ("q.bias", "skip.weight")}
        self.optimiser: Any = _optimiser(config).init(self.params)
        self._start = starting_policy(environment, config)
        self._own = False  # whether the races at hand are driven by the policy learned
        self._driver: Params = self._start  # the weights that drive, or drove, them
        self._branching = _branching(config)
        self._pool = ThreadPoolExecutor(1)
        self._next: Future[Branches] | None = None

    def advance(self, fraction: float) -> Metrics:
        """Learn from the races at hand while the next ones are driven; see `Learner.advance`."""
        branches = (self._next or self._drive(self.iteration)).result()
        self._own = fraction >= self.config.own_after
        self._driver = to_numpy(self.params) if self._own else self._start
        self.iteration += 1
        self._next = self._drive(self.iteration)
        if not len(branches.positions):  # a handful of races may have no decision close enough
            return {"decisions": 0.0}
        losses = self._learn(branches, fraction)
        self.steps += int(np.isfinite(branches.positions).sum())
        return _summary(branches) | losses

    def _drive(self, iteration: int) -> Future[Branches]:
        return self._pool.submit(self.races.branch, self._driver, self._branching, TRAINING_SEED + self.seed, iteration, self.config.races)

    def _learn(self, branches: Branches, fraction: float) -> Metrics:
        config = self.config
        rng = np.random.default_rng([self.seed, _SHUFFLE, self.iteration])
        rate = jnp.float32(config.learning_rate + (config.final_learning_rate - config.learning_rate) * min(max(fraction, 0.0), 1.0))
        tried = np.isfinite(branches.positions)
        scores = np.where(tried, -branches.positions, 0.0).astype(np.float32)
        errors = []
        for _ in range(config.epochs):
            order = rng.permutation(len(scores))
            for first in range(0, len(order), config.minibatch):
                rows = np.resize(order[first : first + config.minibatch], config.minibatch)  # filled up: one shape
                batch = (branches.features[rows], scores[rows], tried[rows])
                self.params, self.optimiser, error = update(self.network, config, self.params, self.optimiser, batch, rate)
                errors.append(error)
        difference, value = np.array(errors, np.float64).mean(axis=0)
        return {"difference_error": float(difference), "value_error": float(value)}

    def agent(self) -> NetworkAgent:
        """The policy; its action values are minus expected finishing positions, those of stops pulled a little towards expected time."""
        environment = self.races
        params = pulled(to_numpy(self.params), self._start["skip.weight"], self.config.expected_share)
        return NetworkAgent(self.kind, environment.feature_set, environment.feature_names, True, self.network, params)

    def state(self) -> dict[str, NDArray[Any]]:
        """Weights now and those which the races at hand are driven with; optimiser; counters."""
        counters = np.array([self.iteration, self.steps, self._own], np.int64)
        driver = self._driver if self._own else self.params
        return join_state(params=self.params, driver=driver, optimiser=self.optimiser, counters=counters)

    def restore(self, state: dict[str, NDArray[Any]]) -> None:
        """See `Learner.restore`; the races at hand are driven again, which gives the same ones."""
        like = {"params": self.params, "driver": self.params, "optimiser": self.optimiser, "counters": np.zeros(3, np.int64)}
        parts = split_state(state, like)
        self.params, self.optimiser = parts["params"], parts["optimiser"]
        self.iteration, self.steps = (int(n) for n in parts["counters"][:2])
        self._own = bool(parts["counters"][2])
        self._driver = parts["driver"] if self._own else self._start
        self._next = None


def pulled(params: Params, start: NDArray[np.float32], share: float) -> Params:
    """The network with its advantages a `share` of the way to those of the linear weights `start` [F, 4]; itself where those are zero."""
    if not start.any():
        return params
    kept = np.array([1.0, *[1.0 - share] * (N_ACTIONS - 1)], np.float32)  # the value of staying out stays
    towards = np.array([0.0, *[share] * (N_ACTIONS - 1)], np.float32)
    skip = params["skip.weight"] * kept + start * towards
    return params | {"q.weight": params["q.weight"] * kept, "q.bias": params["q.bias"] * kept, "skip.weight": skip}


def starting_policy(environment: BranchingEnvironment, config: RsrlConfig) -> Params:
    """The calls learning starts from, as the weights of a tiny `Duelling`: those of least expected time, and level values."""
    params = Duelling(environment.n_features, 1).init(np.random.default_rng(0))
    params["q.bias"] = np.array([MIDFIELD, 0.0, 0.0, 0.0], np.float32)
    params["skip.weight"] = expected_start(environment.feature_names, config.expected_weight * environment.expected_scale_s)
    return params


def expected_start(names: tuple[str, ...], weight: float) -> NDArray[np.float32]:
    """Linear weights [F, 4] by which each stop is first valued at what it loses or gains in expected time against staying out.

    Learning then starts from the best calls for an empty track instead of from staying out for ever. Zero without such features.
    """
    weights = np.zeros((len(names), N_ACTIONS), np.float32)
    if set(EXPECTED_FEATURES) <= set(names):
        for action, feature in enumerate(EXPECTED_FEATURES[1:], start=1):
            weights[names.index(feature), action] = -weight
            weights[names.index(EXPECTED_FEATURES[0]), action] = weight
    return weights


def _check(config: RsrlConfig) -> None:
    if min(config.races, config.minibatch, config.epochs, config.decisions) < 1:
        raise RsrlError("races, minibatch, epochs and decisions of rsrl must be one at least")
    for name in ("own_after", "expected_share", "branch_most", "branch_least", "all_calls", "plan_share", "pit_chance", "delay_chance"):
        if not 0.0 <= getattr(config, name) <= 1.0:
            raise RsrlError(f"{name} of rsrl is {getattr(config, name)}; it must lie between 0 and 1")
    if not config.branch_scale > 0.0:
        raise RsrlError(f"branch_scale of rsrl is {config.branch_scale}; it must be above 0")


def _branching(config: RsrlConfig) -> Branching:
    return Branching(
        decisions=config.decisions,
        most=config.branch_most,
        least=config.branch_least,
        scale=config.branch_scale,
        all_calls=config.all_calls,
        plan_share=config.plan_share,
        pit_chance=config.pit_chance,
        delay_chance=config.delay_chance,
    )


def _summary(branches: Branches) -> Metrics:
    """Decisions branched, and the mean position over their branches."""
    return {"decisions": float(len(branches.positions)), "mean_position": float(np.nanmean(branches.positions))}


def _optimiser(config: RsrlConfig) -> optax.GradientTransformation:
    # The learning rate changes from iteration to iteration, so it is applied outside.
    return optax.flatten(optax.chain(optax.clip_by_global_norm(config.clip), optax.scale_by_adam()))


@partial(jax.jit, static_argnums=(0, 1))
def update(
    network: Duelling, config: RsrlConfig, params: Params, optimiser: Any, batch: tuple[Array, Array, Array], learning_rate: Array
) -> tuple[Params, Any, Array]:
    """One gradient step; gives weights, optimiser state and the two errors [2] of `branch_loss`."""
    (_, errors), gradient = jax.value_and_grad(branch_loss, argnums=2, has_aux=True)(network, config, params, *batch)
    steps, optimiser = _optimiser(config).update(gradient, optimiser, params)
    return jax.tree.map(lambda p, s: p - learning_rate * s, params, steps), optimiser, errors


def branch_loss(network: Duelling, config: RsrlConfig, params: Params, features: Array, scores: Array, tried: Array) -> tuple[Array, Array]:
    """Mean squared error of the differences between the calls tried, and a little of that of their mean.

    `features` [N, F]; `scores` [N, 4] what each call led to, `tried` bool [N, 4] where it was. Gives the loss and both errors [2].
    """
    q = network.sequence(params, features)
    count = tried.sum(axis=1, keepdims=True)

    def mean(values: Array) -> Array:
        return jnp.where(tried, values, 0.0).sum(axis=1, keepdims=True) / count

    wrong = jnp.where(tried, (q - mean(q)) - (scores - mean(scores)), 0.0)
    difference = (wrong**2).sum(axis=1).mean()
    value = ((mean(q) - mean(scores)) ** 2).mean()
    return difference + config.value_weight * value, jnp.stack([difference, value])
