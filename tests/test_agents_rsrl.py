"""RSRL's learner on a race whose best policy is known, and which cannot be driven well without a memory."""

from typing import Any

import numpy as np
import pytest
from agents_toys import LittleRace, mean_return

from rsrl.agents import RsrlConfig, default_config, make_learner
from rsrl.agents.collection import collect, empty_races
from rsrl.agents.exploration import draw_experiments
from rsrl.errors import RsrlError

SMALL = RsrlConfig(
    width=24,
    races=128,
    minibatch_races=16,
    epochs=4,
    learning_rate=5e-3,
    final_learning_rate=5e-4,
    plan_share=0.5,
    final_plan_share=0.5,
    pit_chance=0.2,
)


def trained(iterations: int, seed: int = 0) -> Any:
    learner = make_learner(SMALL, LittleRace(), seed)
    for k in range(iterations):
        learner.advance(k / iterations)
    return learner


@pytest.mark.slow
def test_it_solves_the_little_race_which_needs_a_memory() -> None:
    toy = LittleRace()
    best = toy.best_return(remembers=True)
    blind = toy.best_return(remembers=False)
    assert blind < best - 20
    assert mean_return(trained(150).agent(), toy, 5, 64) == pytest.approx(best, abs=1.0)


def test_the_same_seed_gives_the_same_bits() -> None:
    one, two, other = trained(3), trained(3), trained(3, seed=1)
    state, again = one.state(), two.state()
    assert all(np.array_equal(state[name], again[name]) for name in state)
    assert not np.array_equal(state["params/encoder.weight"], other.state()["params/encoder.weight"])


def test_a_restored_learner_goes_on_bit_by_bit() -> None:
    straight = trained(4)
    first = make_learner(SMALL, LittleRace(), 0)
    for k in range(2):
        first.advance(k / 4)
    second = make_learner(SMALL, LittleRace(), 0)
    second.restore(first.state())
    for k in range(2, 4):
        second.advance(k / 4)
    state, again = straight.state(), second.state()
    assert all(np.array_equal(state[name], again[name]) for name in state)
    assert (straight.iteration, straight.steps) == (second.iteration, second.steps)


def test_a_foreign_training_state_is_refused() -> None:
    learner = make_learner(SMALL, LittleRace(), 0)
    state = learner.state()
    with pytest.raises(RsrlError, match="lacks params"):
        learner.restore({})
    with pytest.raises(RsrlError, match="unknown arrays"):
        learner.restore(state | {"surprise": np.zeros(2)})
    with pytest.raises(RsrlError, match="not as this learner needs it"):
        learner.restore(state | {"params/q.bias": np.zeros(3, np.float32)})


def test_it_never_chooses_the_tyre_that_is_never_legal() -> None:
    learner: Any = make_learner(SMALL, LittleRace(), 0)
    params = dict(learner.agent().params)
    params["q.bias"] = np.array([0, 0, 100, 0], np.float32)  # it loves the illegal medium
    races = empty_races(SMALL, LittleRace())
    drawn = draw_experiments(np.random.default_rng(0), LittleRace.laps, SMALL.races, 0.5)
    collect(races, SMALL, LittleRace(), learner.network, params, (0, np.arange(SMALL.races)), drawn)
    assert races.running.all()
    assert not (races.actions == 2).any()
    assert (races.actions == 1).any()


def test_races_that_are_over_do_not_count() -> None:
    class Short(LittleRace):
        def step(self, actions: Any) -> Any:
            lap = super().step(actions)
            self.done[::2] |= self.lap >= 4
            return lap

    races = empty_races(SMALL, LittleRace())
    learner: Any = make_learner(SMALL, Short(), 0)
    drawn = draw_experiments(np.random.default_rng(0), LittleRace.laps, SMALL.races, 0.0)
    collect(races, SMALL, Short(), learner.network, learner.agent().params, (0, np.arange(SMALL.races)), drawn)
    assert races.running[:, :, ::2].sum(axis=1).tolist() == [[4] * 8] * 8
    assert (races.rewards[:, 4:, ::2] == 0).all()
    assert races.running[:, :, 1::2].all()


def test_action_values_are_in_units_of_reward() -> None:
    learner = trained(30)
    agent, toy = learner.agent(), LittleRace()
    seen = toy.reset(3, np.arange(4))
    q, _ = agent.q_values(seen.features, agent.initial_memory(4))
    inside, _ = learner.network.step(learner.params, seen.features, agent.initial_memory(4))
    np.testing.assert_allclose(q, np.asarray(inside) / SMALL.reward_scale, rtol=1e-4)


def test_unknown_agents_and_unfit_settings_are_refused() -> None:
    with pytest.raises(RsrlError, match="unknown agent 'ppo'; known agents: dqn, drqn, rsrl"):
        default_config("ppo")
    with pytest.raises(RsrlError, match="must be a multiple"):
        make_learner(RsrlConfig(races=65), LittleRace(), 0)
    with pytest.raises(RsrlError, match="learns on the 'paper' features"):
        make_learner(default_config("dqn"), LittleRace(), 0)
