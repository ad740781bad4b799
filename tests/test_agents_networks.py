import numpy as np
import pytest

from rsrl.agents.networks import NETWORKS, Duelling, Lstm, greedy_actions, mask_illegal

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


def test_the_lstm_remembers_the_first_lap_and_the_others_have_no_memory() -> None:
    network = Lstm(FEATURES, WIDTH)
    features = np.zeros((LAPS, 2, FEATURES), np.float32)
    features[0, 1] = 1.0
    last = np.asarray(network.sequence(random_weights(network), features))[-1]
    assert abs(last[0] - last[1]).max() > 1e-4
    assert {name: kind(FEATURES, WIDTH).memory_size for name, kind in NETWORKS.items()} == {"duelling": 0, "feed-forward": 0, "lstm": 16}


def test_a_fresh_rsrl_network_finds_all_calls_alike() -> None:
    network = Duelling(FEATURES, WIDTH)
    q, _ = network.step(network.init(np.random.default_rng(0)), np.ones((1, FEATURES), np.float32), np.zeros((1, 0), np.float32))
    assert q.tolist() == [[0.0] * 4]


def test_the_duelling_head_by_hand() -> None:
    """Two inputs, two units: hidden (2, 0) and then (3, 1); heads 4, 3, -1, 6 and the linear path add up to value and advantages."""
    params = {
        "hidden1.weight": np.array([[1, 0], [1, -1]], np.float32),
        "hidden1.bias": np.array([-1, 1], np.float32),
        "hidden2.weight": np.array([[1, 0], [5, 5]], np.float32),
        "hidden2.bias": np.array([1, 1], np.float32),
        "q.weight": np.array([[1, 1, 0, 2], [1, 0, -1, 0]], np.float32),
        "q.bias": np.zeros(4, np.float32),
        "skip.weight": np.array([[0, 0, 0, 0], [10, 0, 0, 1]], np.float32),
    }
    q, _ = Duelling(2, 2).step(params, np.array([[1, 2]], np.float32), np.zeros((1, 0), np.float32))
    assert q.tolist() == [[24.0, 24.0 + 3.0, 24.0 - 1.0, 24.0 + 8.0]]


@pytest.mark.parametrize("name", ["duelling", "feed-forward"])
def test_a_network_without_a_memory_takes_any_leading_shape(name: str) -> None:
    network = NETWORKS[name](FEATURES, WIDTH)
    params = random_weights(network)
    features = np.random.default_rng(1).standard_normal((2, 3, BATCH, FEATURES)).astype(np.float32)
    q, _ = network.step(params, features, None)
    flat, _ = network.step(params, features.reshape(-1, FEATURES), None)
    np.testing.assert_allclose(q.reshape(-1, 4), flat, rtol=1e-5, atol=1e-6)


def test_greedy_actions_obey_the_mask_and_take_the_first_on_a_tie() -> None:
    q = np.array([[1, 4, 3, 2], [1, 4, 3, 2], [2, 2, 2, 2]], np.float32)
    legal = np.array([[True, False, True, True], [True, False, False, False], [False, True, True, True]])
    assert greedy_actions(q, legal).tolist() == [2, 0, 1]
    assert greedy_actions(q, None).tolist() == [1, 1, 0]


def test_illegal_actions_are_worth_nothing_at_all() -> None:
    q = np.array([[1, 4, 3, 2]], np.float32)
    assert mask_illegal(q, np.array([[True, False, True, False]])).tolist() == [[1.0, -np.inf, 3.0, -np.inf]]
