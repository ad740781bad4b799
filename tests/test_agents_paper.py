"""The paper's two agents: their schedules, and tasks easy enough for them."""

from typing import Any

import numpy as np
import pytest
from agents_toys import Bandit, mean_return

from rsrl.agents import DqnConfig, DrqnConfig, PaperConfig, changed, default_config, make_learner
from rsrl.agents.jax_setup import jnp
from rsrl.agents.networks import Lstm


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
            c.replay_transitions,
            c.target_episodes,
        )
        assert table == (1.0, 0.999, 0.005, 0.99, 0.001, 0.001, 1000, 100)
        assert c.feature_set == "paper"


def test_dqn_learns_which_action_pays() -> None:
    learner = make_learner(DqnConfig(batch=16), Bandit(), 0)
    for _ in range(150):
        learner.advance(0.0)
    assert mean_return(learner.agent(), Bandit(), 5, 64) == 30.0


def test_drqn_learns_what_must_be_remembered() -> None:
    learner = make_learner(DrqnConfig(sequence_laps=3, update_laps=1, epsilon_decay=0.99, target_episodes=20), Bandit(remember=True), 0)
    for _ in range(350):
        learner.advance(0.0)
    assert mean_return(learner.agent(), Bandit(remember=True), 5, 64) == 30.0


def test_epsilon_and_target_follow_their_schedules() -> None:
    learner: Any = make_learner(DqnConfig(batch=4, target_episodes=3, min_epsilon=0.995), Bandit(), 0)
    start = learner.target
    epsilons = []
    for _ in range(8):
        learner.advance(0.0)
        epsilons.append(learner.epsilon)
        if learner.iteration < 3:
            assert learner.target is start
        if learner.iteration in (3, 6):
            assert learner.target is learner.params
    assert epsilons[:5] == pytest.approx([0.999**k for k in range(1, 6)])
    assert epsilons[5:] == [0.995] * 3
    assert learner.target is not learner.params


@pytest.mark.parametrize("kind", ["dqn", "drqn"])
def test_the_same_seed_gives_the_same_bits_and_resuming_changes_none(kind: str) -> None:
    config = changed(default_config(kind), batch=4)
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


def test_without_a_mask_the_papers_agents_may_choose_what_is_illegal() -> None:
    learner: Any = make_learner(DqnConfig(), Bandit(), 0)
    agent = learner.agent()
    agent.params["q.bias"][2] = 100.0
    legal = np.array([[True, False, False, False]])
    assert agent.act(np.zeros((1, 4), np.float32), legal, agent.initial_memory(1))[0].tolist() == [2]


def test_drqn_targets_come_from_the_successor_within_the_piece() -> None:
    from rsrl.agents.drqn import sequence_targets
    from rsrl.agents.replay import Laps

    network = Lstm(2, 3)
    target = network.init(np.random.default_rng(0))
    rng = np.random.default_rng(1)
    seen = rng.standard_normal((4, 1, 2)).astype(np.float32)
    ended = np.array([[False], [False], [True]])
    reward = np.array([[1.0], [2.0], [3.0]], np.float32)
    laps = Laps(seen[:3], np.zeros((3, 1), np.int8), reward, seen[1:], ended)
    memory, expected = np.zeros((1, 6), np.float32), []
    for lap in range(4):
        q, memory = network.step(target, seen[lap], memory)
        if lap:
            expected.append(reward[lap - 1, 0] + 0.99 * q.max() * (not ended[lap - 1, 0]))
    got = sequence_targets(network, DrqnConfig(), {k: jnp.asarray(v) for k, v in target.items()}, laps)
    np.testing.assert_allclose(np.asarray(got)[:, 0], expected, rtol=1e-5)
