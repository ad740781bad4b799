import numpy as np
import pytest

from rsrl.agents.jax_setup import jax, jnp
from rsrl.agents.linear_scan import linear_scan
from rsrl.agents.networks import NETWORKS, MinGru, greedy_actions

LAPS, BATCH, FEATURES, WIDTH = 7, 5, 11, 8


@pytest.fixture(params=sorted(NETWORKS))
def network(request: pytest.FixtureRequest):  # type: ignore[no-untyped-def]
    return NETWORKS[request.param](FEATURES, WIDTH)


def random_weights(network) -> dict[str, np.ndarray]:  # type: ignore[no-untyped-def]
    rng = np.random.default_rng(3)
    return {name: value + 0.1 * rng.standard_normal(value.shape).astype(np.float32) for name, value in network.init(rng).items()}


def test_lap_by_lap_in_numpy_equals_whole_races_in_jax(network) -> None:  # type: ignore[no-untyped-def]
    params = random_weights(network)
    features = np.random.default_rng(1).standard_normal((LAPS, BATCH, FEATURES)).astype(np.float32)
    memory = np.zeros((BATCH, network.memory_size), np.float32)
    lap_by_lap = []
    for lap in features:
        q, memory = network.step(params, lap, memory)
        assert q.dtype == memory.dtype == np.float32
        lap_by_lap.append(q)
    np.testing.assert_allclose(np.array(lap_by_lap), np.asarray(network.sequence(params, features)), rtol=1e-4, atol=1e-5)


def test_a_step_leaves_its_arguments_alone(network) -> None:  # type: ignore[no-untyped-def]
    params = random_weights(network)
    features, memory = np.ones((BATCH, FEATURES), np.float32), np.ones((BATCH, network.memory_size), np.float32)
    network.step(params, features, memory)
    assert (features == 1).all()
    assert (memory == 1).all()


@pytest.mark.parametrize("name", ["lstm", "mingru"])
def test_recurrent_networks_remember_the_first_lap(name: str) -> None:
    network = NETWORKS[name](FEATURES, WIDTH)
    params = random_weights(network)
    features = np.zeros((LAPS, 2, FEATURES), np.float32)
    features[0, 1] = 1.0
    last = np.asarray(network.sequence(params, features))[-1]
    assert abs(last[0] - last[1]).max() > 1e-4


def test_linear_scan_by_hand() -> None:
    keep, add = jnp.array([0.5, 0.5, 2.0])[:, None, None], jnp.array([1.0, 2.0, 3.0])[:, None, None]
    assert linear_scan(keep, add).ravel().tolist() == [1.0, 2.5, 8.0]


def test_linear_scan_has_the_gradient_of_the_plain_loop() -> None:
    rng = np.random.default_rng(0)
    keep, add, weight = (jnp.asarray(rng.uniform(0.1, 1.0, (6, 3, 4)), jnp.float32) for _ in range(3))

    def plain(keep: jax.Array, add: jax.Array) -> jax.Array:
        def lap(state: jax.Array, inputs: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
            state = inputs[0] * state + inputs[1]
            return state, state

        return (jax.lax.scan(lap, jnp.zeros((3, 4)), (keep, add))[1] * weight).sum()

    ours = jax.grad(lambda k, a: (linear_scan(k, a) * weight).sum(), argnums=(0, 1))(keep, add)
    for mine, theirs in zip(ours, jax.grad(plain, argnums=(0, 1))(keep, add), strict=True):
        np.testing.assert_allclose(np.asarray(mine), np.asarray(theirs), rtol=1e-5, atol=1e-6)


def test_a_fresh_rsrl_network_prefers_to_stay_out() -> None:
    network = MinGru(FEATURES, WIDTH)
    q, _ = network.step(network.init(np.random.default_rng(0)), np.ones((1, FEATURES), np.float32), np.zeros((1, WIDTH), np.float32))
    assert q.tolist() == [[0.0] * 4]


def test_greedy_actions_obey_the_mask_and_take_the_first_on_a_tie() -> None:
    q = np.array([[1, 4, 3, 2], [1, 4, 3, 2], [2, 2, 2, 2]], np.float32)
    legal = np.array([[True, False, True, True], [True, False, False, False], [False, True, True, True]])
    assert greedy_actions(q, legal).tolist() == [2, 0, 1]
    assert greedy_actions(q, None).tolist() == [1, 1, 0]
