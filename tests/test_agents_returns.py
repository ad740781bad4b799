"""Golden values of Q(lambda) returns, computed by hand."""

import numpy as np
import pytest

from rsrl.agents.collection import Races
from rsrl.agents.config import RsrlConfig
from rsrl.agents.jax_setup import jax, jnp
from rsrl.agents.networks import MinGru, mask_illegal
from rsrl.agents.returns import q_lambda_returns
from rsrl.agents.rsrl import race_loss


def returns(
    rewards: list[float], values: list[float], followed: list[bool], lambda_: float, running: list[bool] | None = None
) -> list[float]:
    r, v, on, f = (np.array(x)[:, None] for x in (rewards, values, running or [True] * len(rewards), followed))
    return [float(x) for x in np.asarray(q_lambda_returns(r, v, on, f, lambda_))[:, 0]]


def test_lambda_one_is_the_sum_of_what_follows() -> None:
    assert returns([1.0, 2.0, 4.0], [9.0, 9.0, 9.0], [True] * 3, 1.0) == [7.0, 6.0, 4.0]


def test_lambda_zero_looks_one_lap_ahead() -> None:
    assert returns([1.0, 2.0, 4.0], [10.0, 20.0, 30.0], [True] * 3, 0.0) == [21.0, 32.0, 4.0]


def test_lambda_half_by_hand() -> None:
    # G2 = 4; G1 = 2 + (30 + 4) / 2 = 19; G0 = 1 + (20 + 19) / 2 = 20.5
    assert returns([1.0, 2.0, 4.0], [10.0, 20.0, 30.0], [True] * 3, 0.5) == [20.5, 19.0, 4.0]


def test_an_experiment_cuts_the_return_before_it_but_keeps_its_own() -> None:
    # Lap 1 was an experiment: G1 = 2 + G2 still counts for its own action, lap 0 bootstraps from the greedy value 20.
    assert returns([1.0, 2.0, 4.0], [10.0, 20.0, 30.0], [True, False, True], 1.0) == [21.0, 6.0, 4.0]


def test_an_experiment_on_the_first_lap_cuts_nothing() -> None:
    assert returns([1.0, 2.0, 4.0], [10.0, 20.0, 30.0], [False, True, True], 1.0) == [7.0, 6.0, 4.0]


def test_nothing_is_counted_after_the_end_of_a_race() -> None:
    running = [True, True, False]
    assert returns([1.0, -10.0, 0.0], [10.0, 20.0, 30.0], [True] * 3, 0.5, running)[:2] == [1.0 + (20.0 - 10.0) / 2, -10.0]


def test_the_value_of_a_lap_is_the_best_legal_one() -> None:
    q = jnp.array([[5.0, 9.0, 7.0, 8.0], [5.0, 1.0, 2.0, 3.0]])
    legal = jnp.array([[True, False, True, False], [False, False, True, True]])
    assert mask_illegal(q, legal, jnp).max(axis=-1).tolist() == [7.0, 3.0]


def test_illegal_values_never_reach_the_targets() -> None:
    network = MinGru(3, 8)
    params = network.init(np.random.default_rng(0))
    params["q.bias"] = np.array([0.0, 50.0, 0.0, 0.0], np.float32)  # stopping for softs looks wonderful, and is illegal
    shape = (4, 2)  # laps, races
    nothing, yes = np.zeros(shape, np.float32), np.ones(shape, bool)
    legal = np.ones((*shape, 4), bool)
    legal[..., 1] = False
    masked = Races(np.zeros((*shape, 3), np.float32), legal, np.zeros(shape, np.int8), nothing, yes, yes)
    loss = jax.jit(race_loss, static_argnums=(0, 1))
    assert float(loss(network, RsrlConfig(lambda_=0.0), params, masked)) == 0.0
    # With the stop legal, three of four laps bootstrap from 50.
    unmasked = masked._replace(legal=np.ones_like(legal))
    assert float(loss(network, RsrlConfig(lambda_=0.0), params, unmasked)) == pytest.approx(50.0**2 * 3 / 4)
