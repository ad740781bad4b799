"""The compiled network: the function of the agents' networks, the same bits row by row and in a batch."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rsrl.agents.networks import Duelling, FeedForward, Network
from rsrl.rollouts import compiled_network, network_memory, value_rows
from rsrl.rollouts.compiled_network import action_values

FEATURES = 37


@pytest.mark.parametrize("kind", [Duelling, FeedForward])
@given(seed=st.integers(0, 1000), width=st.sampled_from([1, 3, 8, 64]), zeros=st.floats(0, 1))
def test_the_compiled_network_is_the_agents(kind: type[Network], seed: int, width: int, zeros: float) -> None:
    rng = np.random.default_rng(seed)
    network = kind(FEATURES, width)
    params = {n: v + rng.standard_normal(np.shape(v)).astype(np.float32) for n, v in network.init(rng).items()}
    x = (rng.standard_normal((5, FEATURES)) * (rng.random((5, FEATURES)) >= zeros)).astype(np.float32)
    compiled = compiled_network(params, duelling=kind is Duelling)
    q, one = np.zeros((5, 4), np.float32), np.zeros(4, np.float32)
    value_rows(compiled, x, network_memory(compiled), q)
    exact, _ = network.step({n: v.astype(np.float64) for n, v in params.items()}, x.astype(np.float64), None)
    plain, _ = network.step(params, x, None)
    size = 1 + np.abs(exact).max()
    np.testing.assert_allclose(q, exact, atol=2e-5 * size * width**0.5)
    np.testing.assert_allclose(q, plain, atol=2e-5 * size * width**0.5)
    action_values(compiled, x[3], network_memory(compiled), one)
    np.testing.assert_array_equal(one, q[3])


def test_sums_run_from_the_first_input_to_the_last() -> None:
    """The summation order that training has had from the start: another one would change the bits of every trained policy."""
    rng = np.random.default_rng(0)
    network = Duelling(FEATURES, 20)
    params = {n: rng.standard_normal(np.shape(v)).astype(np.float32) for n, v in network.init(rng).items()}
    x = rng.standard_normal(FEATURES).astype(np.float32) * (rng.random(FEATURES) > 0.3)

    def layer(inputs: np.ndarray, name: str) -> np.ndarray:
        total = params[f"{name}.bias"].copy()
        for value, row in zip(inputs, params[f"{name}.weight"], strict=True):
            total += value * row
        return total

    hidden = np.maximum(layer(np.maximum(layer(x, "hidden1"), 0), "hidden2"), 0)
    q = params["q.bias"].copy()
    for inputs, name in ((x, "skip.weight"), (hidden, "q.weight")):
        for value, row in zip(inputs, params[name], strict=True):
            q += value * row
    q[1:] += q[0]
    compiled, out = compiled_network(params), np.zeros(4, np.float32)
    action_values(compiled, x, network_memory(compiled), out)
    np.testing.assert_array_equal(out, q)
