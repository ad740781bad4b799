"""RSRL's own learner: policy improvement on branched races, starting from dynamic programming.

Learning does not start from scratch. It starts from the calls with the least expected race time: the value table that the strategist `dp`
uses (`state.expectation`) gives four of the features, and these initialise the network's linear path. Most of the result is due to that
table. Over the 14 tracks of the study the shipped policy `all` finishes 0.018 places [0.003, 0.033] ahead of `dp`; `fixed`, the paper's
baseline, is 1.08 places behind it (13 tracks; benchmarks/results/generalise.json). The policy trained for Bahrain 2023 alone finishes
0.105 [0.088, 0.121] ahead of `dp` there, and 0.783 ahead of `fixed` (benchmarks/results/leaderboard-fresh-seed.json).

At some decisions of a race, the rest of the race is simulated once for each call, a policy making the later calls. All branches share
their random numbers, so the difference between how they end is an unbiased estimate of the advantage of a call, with a tenth of the
variance of two independent races. The network learns these differences, in finishing positions or by another goal (`rsrl.agents.goals`).

For most of the budget the behaviour policy is the one that learning starts from, so the targets are stationary: this is one step of policy
improvement. After that the learned policy drives the races, so that it also learns the consequences of its own later calls.

Each iteration learns from races driven with the weights of the iteration before, so that the simulator (compiled, on threads of its own)
runs while XLA computes the update. The lag is exactly one iteration on any machine, so the same seed and schedule give the same bits.
"""

from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import Any, ClassVar, Protocol

import numpy as np
import optax
from numpy.typing import NDArray

from rsrl.agents.config import LearnerConfig, RsrlConfig
from rsrl.agents.goals import GOALS
from rsrl.agents.interface import TRAINING_SEED, Learner, Metrics, NetworkAgent
from rsrl.agents.jax_setup import jax, jnp
from rsrl.agents.networks import N_ACTIONS, Duelling, Params
from rsrl.agents.weights import join_state, split_state, to_numpy
from rsrl.errors import RsrlError
from rsrl.rollouts import Branches, Branching

Array = Any

EXPECTED_FEATURES = ("expected_stay_s", "expected_soft_s", "expected_medium_s", "expected_hard_s")
"""Features with the expected time to the flag after each action, for a car alone on the track, by action."""

_INIT, _SHUFFLE = 0, 1
"""Streams of the learner's random numbers."""


class BranchingEnvironment(Protocol):
    """What this learner needs of an environment; the real one is `rsrl.rollouts.BranchingRaces`."""

    feature_set: str
    feature_names: tuple[str, ...]
    n_features: int
    expected_scale_s: float  # seconds that a scaled expected-time feature of 1 stands for

    def branch(self, params: Params, branching: Branching, seed: int, iteration: int, races: int) -> Branches:
        """Drive and branch the races of an iteration with these weights; a pure function of the arguments."""


class RsrlLearner(Learner):
    """The learner described above; its settings are in `RsrlConfig`."""

    kind: ClassVar[str] = "rsrl"

    def __init__(self, config: LearnerConfig, environment: Any, seed: int) -> None:
        super().__init__(config, environment, seed)
        assert isinstance(config, RsrlConfig)
        _check(config)
        self.config, self._goal = config, GOALS[config.goal]
        self.races: BranchingEnvironment = environment
        self.network = Duelling(environment.n_features, config.width)
        self.params: Params = self.network.init(np.random.default_rng([seed, _INIT]))
        self.params |= {name: initial_policy(environment, config)[name] for name in ("q.bias", "skip.weight")}
        self.optimiser: Any = _optimiser(config).init(self.params)
        self._start = initial_policy(environment, config)
        self._on_policy = False  # whether the learned policy drives the races under way
        self._behaviour: Params = self._start  # weights of the policy that drives them
        self._branching = _branching(config)
        self._pool = ThreadPoolExecutor(1)
        self._next: Future[Branches] | None = None

    def advance(self, fraction: float) -> Metrics:
        """Learn from the races just driven while the next ones are simulated; see `Learner.advance`."""
        branches = (self._next or self._drive(self.iteration)).result()
        self._on_policy = fraction >= self.config.own_after
        self._behaviour = to_numpy(self.params) if self._on_policy else self._start
        self.iteration += 1
        self._next = self._drive(self.iteration)
        if not len(branches.positions):  # with very few races there may be no branched decision
            return {"decisions": 0.0}
        losses = self._learn(branches, fraction)
        self.steps += int(np.isfinite(branches.positions).sum())
        return _summary(branches) | losses

    def _drive(self, iteration: int) -> Future[Branches]:
        return self._pool.submit(
            self.races.branch, self._behaviour, self._branching, TRAINING_SEED + self.seed, iteration, self.config.races
        )

    def _learn(self, branches: Branches, fraction: float) -> Metrics:
        config = self.config
        rng = np.random.default_rng([self.seed, _SHUFFLE, self.iteration])
        rate = jnp.float32(config.learning_rate + (config.final_learning_rate - config.learning_rate) * min(max(fraction, 0.0), 1.0))
        tried = np.isfinite(branches.positions)
        scores = self._goal.scores(branches.positions, branches.extra_stops).astype(np.float32)
        errors = []
        for _ in range(config.epochs):
            order = rng.permutation(len(scores))
            for first in range(0, len(order), config.minibatch):
                rows = np.resize(
                    order[first : first + config.minibatch], config.minibatch
                )  # padded to one shape, so that XLA compiles once
                batch = (branches.features[rows], scores[rows], tried[rows])
                self.params, self.optimiser, error = update(self.network, config, self.params, self.optimiser, batch, rate)
                errors.append(error)
        difference, value = np.array(errors, np.float64).mean(axis=0)
        return {"difference_error": float(difference), "value_error": float(value)}

    def agent(self) -> NetworkAgent:
        """The policy; action values are expected scores in the goal's unit, advantages shrunk towards expected time by `expected_share`."""
        environment = self.races
        params = shrunk_to_start(to_numpy(self.params), self._start["skip.weight"], self.config.expected_share)
        params |= {name: params[name] * np.float32(self._goal.place) for name in ("q.weight", "q.bias", "skip.weight")}
        return NetworkAgent(self.kind, environment.feature_set, environment.feature_names, True, self.network, params)

    def state(self) -> dict[str, NDArray[Any]]:
        """Current weights, weights of the behaviour policy, optimiser state and counters."""
        counters = np.array([self.iteration, self.steps, self._on_policy], np.int64)
        behaviour = self._behaviour if self._on_policy else self.params
        return join_state(params=self.params, behaviour=behaviour, optimiser=self.optimiser, counters=counters)

    def restore(self, state: dict[str, NDArray[Any]]) -> None:
        """See `Learner.restore`; the races under way are simulated again, with the same results."""
        like = {"params": self.params, "behaviour": self.params, "optimiser": self.optimiser, "counters": np.zeros(3, np.int64)}
        parts = split_state(state, like)
        self.params, self.optimiser = parts["params"], parts["optimiser"]
        self.iteration, self.steps = (int(n) for n in parts["counters"][:2])
        self._on_policy = bool(parts["counters"][2])
        self._behaviour = parts["behaviour"] if self._on_policy else self._start
        self._next = None


def shrunk_to_start(params: Params, start: NDArray[np.float32], share: float) -> Params:
    """The network with advantages moved a `share` of the way to those of linear weights `start` [F, 4]; unchanged where these are zero."""
    if not start.any():
        return params
    kept = np.array([1.0, *[1.0 - share] * (N_ACTIONS - 1)], np.float32)  # the value of staying out does not change
    towards = np.array([0.0, *[share] * (N_ACTIONS - 1)], np.float32)
    skip = params["skip.weight"] * kept + start * towards
    return params | {"q.weight": params["q.weight"] * kept, "q.bias": params["q.bias"] * kept, "skip.weight": skip}


def initial_policy(environment: BranchingEnvironment, config: RsrlConfig) -> Params:
    """The policy that learning starts from, as weights of a `Duelling` network of one unit: the call with the least expected time."""
    params = Duelling(environment.n_features, 1).init(np.random.default_rng(0))
    params["q.bias"] = np.array([GOALS[config.goal].start, 0.0, 0.0, 0.0], np.float32)
    params["skip.weight"] = expected_time_weights(environment.feature_names, config.expected_weight * environment.expected_scale_s)
    return params


def expected_time_weights(names: tuple[str, ...], weight: float) -> NDArray[np.float32]:
    """Linear weights [F, 4] that make the advantage of each stop its gain in expected time over staying out, times `weight`.

    All zero where the feature set has no expected times; learning then starts from staying out for ever.
    """
    weights = np.zeros((len(names), N_ACTIONS), np.float32)
    if set(EXPECTED_FEATURES) <= set(names):
        for action, feature in enumerate(EXPECTED_FEATURES[1:], start=1):
            weights[names.index(feature), action] = -weight
            weights[names.index(EXPECTED_FEATURES[0]), action] = weight
    return weights


def _check(config: RsrlConfig) -> None:
    if min(config.races, config.minibatch, config.epochs, config.decisions) < 1:
        raise RsrlError("races, minibatch, epochs and decisions of rsrl must be at least one")
    for name in ("own_after", "expected_share", "branch_most", "branch_least", "all_calls", "plan_share", "pit_chance", "delay_chance"):
        if not 0.0 <= getattr(config, name) <= 1.0:
            raise RsrlError(f"{name} of rsrl is {getattr(config, name)}; it must lie between 0 and 1")
    if config.goal not in GOALS:
        raise RsrlError(f"no goal {config.goal!r}; there are {', '.join(GOALS)}")
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
    """Number of branched decisions, and mean position over their branches."""
    return {"decisions": float(len(branches.positions)), "mean_position": float(np.nanmean(branches.positions))}


def _optimiser(config: RsrlConfig) -> optax.GradientTransformation:
    # The learning rate changes with each iteration and is applied outside.
    return optax.flatten(optax.chain(optax.clip_by_global_norm(config.clip), optax.scale_by_adam()))


@partial(jax.jit, static_argnums=(0, 1))
def update(
    network: Duelling, config: RsrlConfig, params: Params, optimiser: Any, batch: tuple[Array, Array, Array], learning_rate: Array
) -> tuple[Params, Any, Array]:
    """One gradient step; returns weights, optimiser state and the two errors [2] of `branch_loss`."""
    (_, errors), gradient = jax.value_and_grad(branch_loss, argnums=2, has_aux=True)(network, config, params, *batch)
    steps, optimiser = _optimiser(config).update(gradient, optimiser, params)
    return jax.tree.map(lambda p, s: p - learning_rate * s, params, steps), optimiser, errors


def branch_loss(network: Duelling, config: RsrlConfig, params: Params, features: Array, scores: Array, tried: Array) -> tuple[Array, Array]:
    """Squared error of the differences between the calls tried, plus `value_weight` times that of their mean.

    Args:
        features: [N, F].
        scores: how the race ended after each call, in places, [N, 4] (`Goal.scores`).
        tried: which calls were simulated, bool [N, 4].

    Returns:
        The loss and its two parts [2].
    """
    q = network.sequence(params, features)
    count = tried.sum(axis=1, keepdims=True)

    def mean(values: Array) -> Array:
        return jnp.where(tried, values, 0.0).sum(axis=1, keepdims=True) / count

    wrong = jnp.where(tried, (q - mean(q)) - (scores - mean(scores)), 0.0)
    difference = (wrong**2).sum(axis=1).mean()
    value = ((mean(q) - mean(scores)) ** 2).mean()
    return difference + config.value_weight * value, jnp.stack([difference, value])
