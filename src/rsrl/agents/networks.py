"""The three Q-networks, as pure functions of a flat dictionary of weights.

Each network is written once, against an array library `xp`: NumPy for inference (no compilation, any batch size, no JAX needed), JAX for
training. Weights are float32 and named `layer.weight` [inputs, outputs] and `layer.bias` [outputs], as in a model file.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

N_ACTIONS: Final = 4
"""No pit, pit soft, pit medium, pit hard."""

Params = dict[str, Any]
"""Weights by name: NumPy or JAX arrays."""

Array = Any
"""A NumPy or a JAX array."""


@dataclass(frozen=True)
class Network(ABC):
    """Shape of a Q-network, without weights.

    Attributes:
        n_features: length of one observation.
        width: units of each hidden layer, and of the LSTM.
    """

    name: ClassVar[str]
    n_features: int
    width: int

    @property
    @abstractmethod
    def memory_size(self) -> int:
        """Size of the state carried from lap to lap; zero for a feed-forward network."""

    @abstractmethod
    def init(self, rng: np.random.Generator) -> Params:
        """Initial weights as NumPy arrays."""

    @abstractmethod
    def step(self, params: Params, features: Array, memory: Array, xp: Any = np) -> tuple[Array, Array]:
        """One lap: features [B, F] and memory [B, M] to action values [B, 4] and the next memory [B, M]."""

    @abstractmethod
    def sequence(self, params: Params, features: Array) -> Array:
        """All laps at once, in JAX, from a zero memory: features [T, B, F] to action values [T, B, 4]."""


@dataclass(frozen=True)
class FeedForward(Network):
    """Two hidden layers of rectified units: the paper's first model, after Boettinger and Klotz (2023)."""

    name: ClassVar[str] = "feed-forward"

    @property
    def memory_size(self) -> int:
        """Zero."""
        return 0

    def init(self, rng: np.random.Generator) -> Params:
        """Uniform in +-1/sqrt(inputs)."""
        params: Params = {}
        _uniform_layer(params, rng, "hidden1", self.n_features, self.width)
        _uniform_layer(params, rng, "hidden2", self.width, self.width)
        _uniform_layer(params, rng, "q", self.width, N_ACTIONS)
        return params

    def step(self, params: Params, features: Array, memory: Array, xp: Any = np) -> tuple[Array, Array]:
        """See `Network.step`; works on any leading shape."""
        hidden = xp.maximum(_dense(params, "hidden1", features), 0.0)
        hidden = xp.maximum(_dense(params, "hidden2", hidden), 0.0)
        return _dense(params, "q", hidden), memory

    def sequence(self, params: Params, features: Array) -> Array:
        """See `Network.sequence`."""
        from rsrl.agents.jax_setup import jnp

        return self.step(params, features, None, jnp)[0]


@dataclass(frozen=True)
class Lstm(Network):
    """A layer of rectified units, an LSTM, a linear head: DRQN of Hausknecht and Stone (2015), their convolutions left out."""

    name: ClassVar[str] = "lstm"

    @property
    def memory_size(self) -> int:
        """Hidden and cell state."""
        return 2 * self.width

    def init(self, rng: np.random.Generator) -> Params:
        """Uniform in +-1/sqrt(inputs)."""
        params: Params = {}
        _uniform_layer(params, rng, "hidden1", self.n_features, self.width)
        _uniform_layer(params, rng, "lstm", 2 * self.width, 4 * self.width)
        _uniform_layer(params, rng, "q", self.width, N_ACTIONS)
        return params

    def step(self, params: Params, features: Array, memory: Array, xp: Any = np) -> tuple[Array, Array]:
        """See `Network.step`; gates in the order input, forget, output, candidate."""
        width = self.width
        encoded = xp.maximum(_dense(params, "hidden1", features), 0.0)
        hidden, cell = memory[:, :width], memory[:, width:]
        gates = _dense(params, "lstm", xp.concatenate([encoded, hidden], axis=1))
        opened = _sigmoid(gates[:, : 3 * width], xp)
        cell = opened[:, width : 2 * width] * cell + opened[:, :width] * xp.tanh(gates[:, 3 * width :])
        hidden = opened[:, 2 * width :] * xp.tanh(cell)
        return _dense(params, "q", hidden), xp.concatenate([hidden, cell], axis=1)

    def sequence(self, params: Params, features: Array) -> Array:
        """See `Network.sequence`."""
        from rsrl.agents.jax_setup import jnp
        from rsrl.agents.lstm import lstm_outputs

        encoded = jnp.maximum(_dense(params, "hidden1", features), 0.0)
        from_inputs, recurrent = params["lstm.weight"][: self.width], params["lstm.weight"][self.width :]
        return _dense(params, "q", lstm_outputs(recurrent, encoded @ from_inputs + params["lstm.bias"]))


@dataclass(frozen=True)
class Duelling(Network):
    """RSRL's network: two hidden layers of rectified units, a duelling head (value of staying out, advantages of the stops), a linear path.

    `rsrl.rollouts.compiled_network` is the same function inside the compiled race.
    """

    name: ClassVar[str] = "duelling"

    @property
    def memory_size(self) -> int:
        """Zero: earlier laps are summarised in the features."""
        return 0

    def init(self, rng: np.random.Generator) -> Params:
        """He initialisation; head and linear path start at zero, so all actions have equal values."""
        params: Params = {}
        _normal_layer(params, rng, "hidden1", self.n_features, self.width)
        _normal_layer(params, rng, "hidden2", self.width, self.width)
        params["q.weight"] = np.zeros((self.width, N_ACTIONS), np.float32)
        params["q.bias"] = np.zeros(N_ACTIONS, np.float32)
        params["skip.weight"] = np.zeros((self.n_features, N_ACTIONS), np.float32)
        return params

    def step(self, params: Params, features: Array, memory: Array, xp: Any = np) -> tuple[Array, Array]:
        """See `Network.step`; works on any leading shape."""
        hidden = xp.maximum(_dense(params, "hidden1", features), 0.0)
        hidden = xp.maximum(_dense(params, "hidden2", hidden), 0.0)
        head = _dense(params, "q", hidden) + features @ params["skip.weight"]
        value, advantages = head[..., :1], head[..., 1:]
        return xp.concatenate([value, value + advantages], axis=-1), memory

    def sequence(self, params: Params, features: Array) -> Array:
        """See `Network.sequence`."""
        from rsrl.agents.jax_setup import jnp

        return self.step(params, features, None, jnp)[0]


NETWORKS: Final[dict[str, type[Network]]] = {kind.name: kind for kind in (Duelling, FeedForward, Lstm)}
"""Networks by their names in model files."""


def mask_illegal(q: Array, legal: Array, xp: Any = np) -> Array:
    """Action values with minus infinity for illegal actions; `legal` is bool, in the shape of `q`."""
    return xp.where(legal, q, -xp.inf)


def greedy_actions(q: NDArray[np.float32], legal: NDArray[np.bool_] | None) -> NDArray[np.int8]:
    """The best action of each row of `q` [B, 4], int8 [B], among legal actions where a mask is given; ties go to the first."""
    values = q if legal is None else mask_illegal(q, legal)
    return values.argmax(axis=1).astype(np.int8)


def _dense(params: Params, layer: str, inputs: Array) -> Array:
    return inputs @ params[f"{layer}.weight"] + params[f"{layer}.bias"]


def _sigmoid(x: Array, xp: Any) -> Array:
    # By tanh, which overflows in neither library.
    return 0.5 * xp.tanh(0.5 * x) + 0.5


def _uniform_layer(params: Params, rng: np.random.Generator, layer: str, inputs: int, outputs: int) -> None:
    bound = inputs**-0.5
    params[f"{layer}.weight"] = rng.uniform(-bound, bound, (inputs, outputs)).astype(np.float32)
    params[f"{layer}.bias"] = rng.uniform(-bound, bound, outputs).astype(np.float32)


def _normal_layer(params: Params, rng: np.random.Generator, layer: str, inputs: int, outputs: int) -> None:
    params[f"{layer}.weight"] = (rng.standard_normal((inputs, outputs)) * (2.0 / inputs) ** 0.5).astype(np.float32)
    params[f"{layer}.bias"] = np.zeros(outputs, np.float32)
