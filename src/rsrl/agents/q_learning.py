"""Gradient steps of the paper's agents: one-step targets by a target network, squared error, AdamW, averaged weights."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import optax

from rsrl.agents.config import PaperConfig
from rsrl.agents.jax_setup import jax, jnp
from rsrl.agents.networks import N_ACTIONS, Network, Params

Array = Any

Loss = Callable[[Network, PaperConfig, Params, Params, Any], Array]
"""Loss of (network, settings, learning weights, target weights, batch)."""


class Weights(NamedTuple):
    """The weights that learn, the copy of them that makes targets, and their average over recent steps, which is tried and kept."""

    online: Params
    target: Params
    average: Params


def optimiser_of(config: PaperConfig) -> optax.GradientTransformation:
    """AdamW as the paper's Table 2 has it."""
    return optax.flatten(optax.adamw(config.learning_rate, weight_decay=config.weight_decay))


@partial(jax.jit, static_argnums=(0, 1, 2))
def descend(
    loss: Loss, network: Network, config: PaperConfig, weights: Weights, optimiser: Any, batches: Any
) -> tuple[Params, Params, Any]:
    """One step for each of `batches`, arrays with a leading axis of steps; returns learning weights, their average and optimiser state."""

    def step(carry: tuple[Params, Params, Any], batch: Any) -> tuple[tuple[Params, Params, Any], None]:
        online, average, optimiser = carry
        gradient = jax.grad(loss, argnums=2)(network, config, online, weights.target, batch)
        change, optimiser = optimiser_of(config).update(gradient, optimiser, online)
        online = optax.apply_updates(online, change)
        average = jax.tree.map(lambda mean, new: mean + (new - mean) / config.average_steps, average, online)
        return (online, average, optimiser), None

    after: tuple[Params, Params, Any] = jax.lax.scan(step, (weights.online, weights.average, optimiser), batches)[0]
    return after


def one_step_targets(config: PaperConfig, reward: Array, next_q: Array, ended: Array) -> Array:
    """Scaled `r + gamma max Q'`, or `r` at the end of a race; `next_q` [..., 4] is the target network's, of the lap after."""
    return config.reward_scale * reward + config.gamma * jnp.where(ended, 0.0, next_q.max(axis=-1))


def squared_errors(q: Array, action: Array, targets: Array) -> Array:
    """Squared errors of the values `q` [..., 4] of the actions taken, in the shape of `targets`.

    Not clipped: with rewards of -1000 to 2500 a Huber loss of delta 1 would count the sign of an error alone, and learn medians.
    """
    chosen = jnp.sum(jnp.where(action[..., None] == jnp.arange(N_ACTIONS), q, 0.0), axis=-1)
    return (chosen - targets) ** 2
