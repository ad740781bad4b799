"""The paper's two agents: their schedules, their loss, and tasks easy enough for them."""

from typing import Any

import numpy as np
import pytest
from agents_toys import Bandit, LittleRace, mean_return
from docs_pages import benchmark

from rsrl.agents import DqnConfig, DrqnConfig, PaperConfig, changed, default_config, make_learner
from rsrl.agents.jax_setup import jax, jnp
from rsrl.agents.lstm import lstm_outputs
from rsrl.agents.networks import FeedForward, Lstm
from rsrl.agents.replay import Laps, Races
from rsrl.errors import RsrlError

SMALL: dict[str, Any] = {
    "races_at_once": 10,
    "validation_races": 20,
    "validation_episodes": 50,
    "average_steps": 10,
    "replay_episodes": 500,
}


def small(kind: str, **values: Any) -> Any:
    return changed(default_config(kind), **(SMALL | values))


def test_the_paper_table_is_what_the_paper_says() -> None:
    for kind in ("dqn", "drqn"):
        c = default_config(kind)
        assert isinstance(c, PaperConfig)
        table = (
            c.epsilon,
            c.epsilon_decay,
            c.min_epsilon,
            c.gamma,
            c.learning_rate,
            c.weight_decay,
            c.replay_episodes,
            c.target_episodes,
        )
        assert table == (1.0, 0.999, 0.005, 0.99, 0.001, 0.001, 1000, 100)
        assert c.feature_set == "paper"


def test_dqn_learns_which_action_pays() -> None:
    learner = make_learner(small("dqn", batch=16, reward_scale=0.1), Bandit(), 0)
    for _ in range(40):
        learner.advance(0.0)
    assert mean_return(learner.agent(), Bandit(), 5, 64) == 30.0


def test_drqn_learns_what_must_be_remembered() -> None:
    settings = {"batch": 8, "update_laps": 3, "reward_scale": 0.1, "epsilon_decay": 0.99, "target_episodes": 20}
    learner = make_learner(small("drqn", **settings), Bandit(remember=True), 0)
    for _ in range(60):
        learner.advance(0.0)
    assert mean_return(learner.agent(), Bandit(remember=True), 5, 64) == 30.0


def test_drqn_calls_a_race_as_well_as_can_be() -> None:
    """The best policy, known by dynamic programming, keeps a rule that costs 1000 to break and remembers a flag of the lap before."""
    race = LittleRace(delay=1)
    best, forgetful = race.best_return(remembers=True), race.best_return(remembers=False)
    assert best > forgetful
    exploring = {"epsilon_decay": 0.9985, "min_epsilon": 0.05, "target_episodes": 50, "feature_set": "full"}
    learning = {"batch": 32, "update_laps": 4, "reward_scale": 0.02, "average_steps": 100}
    learner = make_learner(small("drqn", **(exploring | learning)), race, 0)
    for _ in range(400):
        learner.advance(0.0)
    assert mean_return(learner.agent(), race, 5, 64) == pytest.approx(best)


def test_epsilon_target_and_steps_follow_races_and_laps() -> None:
    learner: Any = make_learner(small("dqn", batch=4, target_episodes=30, min_epsilon=0.97, update_laps=2), Bandit(), 0)
    start = learner.weights.target
    for n in range(1, 8):
        metrics = learner.advance(0.0)
        episodes = np.arange(10 * (n - 1), 10 * n)
        assert metrics["epsilon"] == pytest.approx(np.maximum(0.999**episodes, 0.97).mean())
        assert (learner.iteration, learner.steps) == (10 * n, 30 * n)
        assert learner.updates == 15 * n // 10 * 10  # one for two laps, ten in a call
        if n < 3:
            assert learner.weights.target is start
        if n in (3, 6):
            assert learner.weights.target is learner.weights.online
    assert learner.weights.target is not learner.weights.online


def test_the_weights_that_finished_best_on_races_set_aside_are_kept() -> None:
    learner: Any = make_learner(small("dqn"), Bandit(), 0)
    best, pays = learner.network.init(np.random.default_rng(1)), 4 * np.eye(4, dtype=np.float32)
    for layer, into in (("hidden1", 4), ("hidden2", 4), ("q", 4)):
        best[f"{layer}.weight"] = np.zeros_like(best[f"{layer}.weight"])
        best[f"{layer}.weight"][:into, :4] = pays
        best[f"{layer}.bias"] = np.zeros_like(best[f"{layer}.bias"])
    worse = best | {"q.bias": np.array([1e6, 0, 0, 0], np.float32)}
    for weights, position, kept in ((worse, 3.25, worse), (best, 1.0, best), (worse, 3.25, best)):
        learner.weights = learner.weights._replace(average=weights)
        learner.validate()
        assert learner.validation_position == pytest.approx(position, abs=0.6)
        assert (learner.kept["q.bias"] == kept["q.bias"]).all()
    assert learner.kept_position == 1.0
    assert (learner.agent().params["q.weight"] == 100 * best["q.weight"]).all()  # rewards were scaled by 0.01


@pytest.mark.parametrize("kind", ["dqn", "drqn"])
def test_the_same_seed_gives_the_same_bits_and_resuming_changes_none(kind: str) -> None:
    config = small(kind, batch=4, update_laps=2)
    straight = make_learner(config, Bandit(), 3)
    first = make_learner(config, Bandit(), 3)
    for _ in range(6):
        straight.advance(0.0)
    for _ in range(3):
        first.advance(0.0)
    second = make_learner(config, Bandit(), 3)
    second.restore(first.state())
    for _ in range(3):
        second.advance(0.0)
    state, again = straight.state(), second.state()
    assert sorted(state) == sorted(again)
    assert all(np.array_equal(state[name], again[name]) for name in state)
    other = make_learner(config, Bandit(), 4)
    for _ in range(6):
        other.advance(0.0)
    assert not np.array_equal(other.state()["weights/online/q.weight"], state["weights/online/q.weight"])


def test_without_a_mask_the_papers_agents_may_choose_what_is_illegal() -> None:
    learner: Any = make_learner(DqnConfig(), Bandit(), 0)
    agent = learner.agent()
    agent.params["q.bias"][2] = 1e6
    legal = np.array([[True, False, False, False]])
    assert agent.act(np.zeros((1, 4), np.float32), legal, agent.initial_memory(1))[0].tolist() == [2]


@pytest.mark.parametrize("values", [{"validation_races": 15}, {"replay_episodes": 5}, {"update_laps": 0}])
def test_settings_that_cannot_be(values: dict[str, Any]) -> None:
    with pytest.raises(RsrlError, match=next(iter(values))):
        make_learner(small("dqn", **values), Bandit(), 0)


def test_dqn_loss_is_the_squared_error_of_one_step_targets() -> None:
    from rsrl.agents.dqn import lap_loss

    network, rng = FeedForward(2, 3), np.random.default_rng(1)
    online, target = (network.init(np.random.default_rng(seed)) for seed in (0, 1))
    features, following = rng.standard_normal((2, 5, 2)).astype(np.float32)
    action, reward = np.array([0, 1, 2, 3, 1], np.int8), np.array([1, -10, -1000, 2500, 0], np.float32)
    ended = np.array([False, False, True, True, False])
    q, next_q = network.step(online, features, None)[0], network.step(target, following, None)[0]
    targets = 0.01 * reward + 0.99 * np.where(ended, 0.0, next_q.max(axis=1))
    got = lap_loss(network, DqnConfig(), online, target, Laps(features, action, reward, following, ended))
    assert float(got) == pytest.approx(np.mean((q[np.arange(5), action] - targets) ** 2), rel=1e-5)


def test_drqn_loss_follows_each_network_through_the_race_and_ends_with_it() -> None:
    from rsrl.agents.drqn import race_loss

    network, rng, laps = Lstm(2, 3), np.random.default_rng(1), np.array([3, 4], np.int32)
    online, target = (network.init(np.random.default_rng(seed)) for seed in (0, 1))
    races = Races(
        rng.standard_normal((5, 2, 2)).astype(np.float32), rng.integers(0, 4, (4, 2)).astype(np.int8), np.full((4, 2), 100.0, "f4"), laps
    )
    wrong = []
    for race in range(2):
        memories = {name: np.zeros((1, 6), np.float32) for name in ("online", "target")}
        values: dict[str, list[Any]] = {"online": [], "target": []}
        for lap in range(5):
            for name, params in (("online", online), ("target", target)):
                q, memories[name] = network.step(params, races.features[lap, race : race + 1], memories[name])
                values[name].append(q[0])
        for lap in range(laps[race]):
            later = 0.99 * values["target"][lap + 1].max() * (lap < laps[race] - 1)
            wrong.append(values["online"][lap][races.action[lap, race]] - (1.0 + later))
    assert float(race_loss(network, DrqnConfig(), online, target, races)) == pytest.approx(np.mean(np.square(wrong)), rel=1e-5)


def test_the_written_gradient_of_the_lstm_is_that_of_its_steps() -> None:
    network, rng = Lstm(3, 5), np.random.default_rng(2)
    params = {name: jnp.asarray(value) for name, value in network.init(rng).items()}
    features = jnp.asarray(rng.standard_normal((6, 4, 3)), jnp.float32)
    wanted = jnp.asarray(rng.standard_normal((6, 4, 4)), jnp.float32)

    def by_steps(params: Any) -> Any:
        memory, rows = jnp.zeros((4, 10)), []
        for lap in range(6):
            q, memory = network.step(params, features[lap], memory, jnp)
            rows.append(q)
        return jnp.sum((jnp.stack(rows) - wanted) ** 2)

    def by_sequence(params: Any) -> Any:
        return jnp.sum((network.sequence(params, features) - wanted) ** 2)

    (one, slow), (two, fast) = (jax.value_and_grad(loss)(params) for loss in (by_steps, by_sequence))
    assert float(one) == pytest.approx(float(two), rel=1e-5)
    for name in params:
        np.testing.assert_allclose(np.asarray(fast[name]), np.asarray(slow[name]), rtol=1e-4, atol=1e-5)
    assert lstm_outputs(params["lstm.weight"][5:], jnp.zeros((2, 3, 20))).shape == (2, 3, 5)


@pytest.mark.parametrize(("kind", "golden"), [("dqn", 7.2035333), ("drqn", 11.363157)])
def test_a_short_run_gives_the_weights_it_gave(kind: str, golden: float) -> None:
    learner: Any = make_learner(small(kind, batch=4, update_laps=2), Bandit(remember=True), 0)
    for _ in range(8):
        learner.advance(0.0)
    norm = sum(float(np.sum(np.asarray(value, np.float64) ** 2)) for value in learner.weights.online.values()) ** 0.5
    assert norm == pytest.approx(golden, rel=1e-3)  # sums of float32 differ a little between processors


def test_the_trials_of_the_benchmark_are_settings_that_can_be() -> None:
    trials = benchmark("paper_agents")
    configs = {name: trials.paper_config("drqn", changes) for name, changes in trials.TRIALS.items()}
    assert configs["as shipped"] == default_config("drqn")
    assert len(set(configs.values())) == len(configs)
    for config in configs.values():
        make_learner(config, Bandit(), 0)
