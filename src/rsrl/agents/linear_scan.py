"""The recurrence `h[t] = keep[t] h[t-1] + add[t]` with a gradient of its own, for speed."""

from typing import Any

from rsrl.agents.jax_setup import jax, jnp

Array = Any


@jax.custom_vjp
def linear_scan(keep: Array, add: Array) -> Array:
    """All states h [T, B, H] of `h[t] = keep[t] h[t-1] + add[t]` from h[-1] = 0; `keep` and `add` [T, B, H]."""
    return _run(keep, add, reverse=False)


def _run(keep: Array, add: Array, reverse: bool) -> Array:
    def lap(state: Array, inputs: tuple[Array, Array]) -> tuple[Array, Array]:
        state = inputs[0] * state + inputs[1]
        return state, state

    return jax.lax.scan(lap, jnp.zeros_like(add[0]), (keep, add), reverse=reverse)[1]


def _forward(keep: Array, add: Array) -> tuple[Array, tuple[Array, Array]]:
    states = _run(keep, add, reverse=False)
    return states, (keep, states)


def _backward(saved: tuple[Array, Array], gradient: Array) -> tuple[Array, Array]:
    # The gradient of h[t] is its own plus keep[t+1] times that of h[t+1]: the same recurrence, backwards.
    keep, states = saved
    keep_next = jnp.concatenate([keep[1:], jnp.zeros_like(keep[:1])])
    total = _run(keep_next, gradient, reverse=True)
    previous = jnp.concatenate([jnp.zeros_like(states[:1]), states[:-1]])
    return total * previous, total


linear_scan.defvjp(_forward, _backward)
