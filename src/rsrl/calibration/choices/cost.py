"""What a plan costs: seconds of every stint, and the value of every sequence over its stop laps (JAX).

A stint of L laps on one compound costs `offset L + wear L^2 / 2`, its wear dearer on a full tank. A sequence is worth the soft minimum
over its stop laps on a grid, so that a pit wall that misses the best lap by two loses little, and a plan with a wide window is worth more.
"""

from typing import Any, Final

import jax
import jax.numpy as jnp
import numpy as np

from rsrl.calibration.choices.sequences import SEQUENCES

STEPS: Final = 24
"""Grid of stop laps over the race."""

OVER_LIMIT_S: Final = 3.0  # s a lap beyond the laps a set may run: a soft wall, so that the cost has a slope
IMPOSSIBLE_S: Final = 1e4

_TWO, _THREE, _FOUR = (np.array([c for c in SEQUENCES if len(c) == n]) for n in (2, 3, 4))


def stint_cost(offset: Any, wear: Any, first: Any, laps: Any, race_laps: Any, fuel: Any, limit: Any) -> Any:
    """Seconds a stint costs against fresh mediums without wear; `first` is the laps run before it, `limit` the laps a set may run."""
    heavy = 1 + fuel * (0.5 - (first + 0.5 * laps) / race_laps)
    return offset * laps + wear * laps**2 / 2 * heavy + OVER_LIMIT_S * jnp.maximum(laps - limit, 0.0)


def soft_minimum(costs: Any, temperature: Any) -> Any:
    """Soft minimum over the last axis."""
    return -temperature * jax.nn.logsumexp(-costs / temperature, axis=-1)


def sequence_costs(offset: Any, wear: Any, stop_s: Any, race_laps: Any, limit: Any, undercut: Any, temperature: Any, fuel: Any) -> Any:
    """Cost of every sequence of one race by the lap of its first stop, later stops at their soft minimum.

    Args:
        offset, wear: by compound, [3].
        stop_s: what a stop costs, s.
        race_laps: laps of the race.
        limit: laps a set may run.
        undercut: s that each lap of the first stint costs, by compound, [3].
        temperature: of the choice of stop laps, s.
        fuel: see `stint_cost`.

    Returns:
        [sequences, STEPS - 1]; column j: first stop after (j + 1) / STEPS of the race.
    """
    step = race_laps / STEPS
    begin, end = jnp.arange(STEPS) * step, (jnp.arange(STEPS) + 1) * step
    laps = end[None, :] - begin[:, None]
    stint = stint_cost(offset[:, None, None], wear[:, None, None], begin[:, None], jnp.maximum(laps, 0.1), race_laps, fuel, limit)
    stint = jnp.where(laps > 0.5 * step, stint, IMPOSSIBLE_S)  # [compound, begin, end]
    last = stint[:, 1:, -1]  # to the flag, from the end of each earlier step
    middle = stint[:, :, :-1]
    two = soft_minimum(middle[:, None] + last[None, :, None, :], temperature) + stop_s  # two stints from `begin` to the flag
    three = soft_minimum(middle[:, None, None] + two[None, :, :, None, 1:], temperature) + stop_s
    opening = middle[:, 0, :] + undercut[:, None] * end[None, :-1]
    return stop_s + jnp.concatenate(
        [
            opening[_TWO[:, 0]] + last[_TWO[:, 1]],
            opening[_THREE[:, 0]] + two[_THREE[:, 1], _THREE[:, 2]][:, 1:],
            opening[_FOUR[:, 0]] + three[_FOUR[:, 1], _FOUR[:, 2], _FOUR[:, 3]][:, 1:],
        ]
    )
