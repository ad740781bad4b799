"""Q(lambda) targets over whole races, in JAX."""

from typing import Any

from rsrl.agents.jax_setup import jax, jnp

Array = Any


def q_lambda_returns(rewards: Array, values: Array, running: Array, followed: Array, lambda_: float) -> Array:
    """Watkins' Q(lambda) returns, undiscounted.

    `G[t] = r[t] + (1 - w) v[t+1] + w G[t+1]`, with `w = lambda` where lap t+1 was driven greedily and 0 where it was an
    experiment: what an experiment brought is no news about the greedy policy (Watkins, 1989; Sutton and Barto, 2018,
    section 12.10). After the end of a race nothing follows.

    Args:
        rewards: reward of each lap's decision, [T, B].
        values: best legal action value before each decision, [T, B].
        running: the race was still running before this decision, bool [T, B].
        followed: the decision was the greedy one, bool [T, B].
        lambda_: 0 bootstraps from the next lap, 1 from the end of the race or the next experiment.

    Returns:
        G [T, B]; laps at which the race was no longer running hold their (zero) rewards.
    """

    def lap(later: Array, inputs: tuple[Array, Array, Array, Array]) -> tuple[Array, Array]:
        reward, value, is_running, is_followed = inputs
        total = reward + later
        weight = lambda_ * is_followed
        return jnp.where(is_running, (1.0 - weight) * value + weight * total, 0.0), total

    return jax.lax.scan(lap, jnp.zeros_like(rewards[0]), (rewards, values, running, followed), reverse=True)[1]
