"""RSRL's learner on branched races whose best policy is known, and its loss and starting point by hand."""

import dataclasses
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from agents_toys import LittleRace, LittleRaces, mean_return

from rsrl.agents import TRAINING_SEED, RsrlConfig, changed, default_config, make_learner
from rsrl.agents.jax_setup import jax, jnp
from rsrl.agents.networks import Duelling, Params
from rsrl.agents.rsrl import EXPECTED_FEATURES, branch_loss, expected_time_weights, shrunk_to_start
from rsrl.errors import RsrlError
from rsrl.rollouts import Branches, Branching

SMALL = RsrlConfig(
    width=24,
    races=64,
    minibatch=64,
    epochs=4,
    learning_rate=5e-3,
    final_learning_rate=5e-4,
    branch_most=1.0,
    branch_least=0.3,
    branch_scale=1.0,
    own_after=0.2,
    plan_share=0.5,
    pit_chance=0.2,
)


def trained(iterations: int, seed: int = 0, config: RsrlConfig = SMALL) -> Any:
    learner = make_learner(config, LittleRaces(), seed)
    for k in range(iterations):
        learner.advance(k / iterations)
    return learner


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_it_solves_the_little_race(seed: int) -> None:
    toy = LittleRace()
    best, blind = toy.best_return(remembers=True), toy.best_return(remembers=False)
    assert blind < best - 20, "the flag must be worth a look"
    assert mean_return(trained(1, seed).agent(), toy, 5, 64) < best - 20
    assert mean_return(trained(40, seed).agent(), toy, 5, 64) == pytest.approx(best, abs=1e-3)


def test_action_values_are_minus_the_positions_to_be_expected() -> None:
    agent, toy = trained(60).agent(), LittleRace()
    seen = toy.reset(3, np.arange(64))
    value = agent.q_values(seen.features, agent.initial_memory(64))[0].max(axis=1).mean()
    assert value == pytest.approx(toy.best_return(remembers=True) / LittleRaces.points_a_place, abs=0.5)


def same(one: dict[str, Any], two: dict[str, Any]) -> bool:
    return sorted(one) == sorted(two) and all(np.array_equal(one[name], two[name]) for name in one)


def test_the_same_seed_gives_the_same_bits() -> None:
    assert same(trained(3).state(), trained(3).state())
    assert not np.array_equal(trained(3).state()["params/hidden1.weight"], trained(3, seed=1).state()["params/hidden1.weight"])


def test_a_restored_learner_goes_on_bit_by_bit() -> None:
    straight = trained(4)
    first = make_learner(SMALL, LittleRaces(), 0)
    for k in range(2):
        first.advance(k / 4)
    second = make_learner(SMALL, LittleRaces(), 0)
    second.restore({name: value.copy() for name, value in first.state().items()})
    for k in range(2, 4):
        second.advance(k / 4)
    assert same(straight.state(), second.state())
    assert (straight.iteration, straight.steps) == (second.iteration, second.steps)


def test_a_foreign_training_state_is_refused() -> None:
    learner = make_learner(SMALL, LittleRaces(), 0)
    state = learner.state()
    with pytest.raises(RsrlError, match="lacks params"):
        learner.restore({})
    with pytest.raises(RsrlError, match="unknown arrays"):
        learner.restore(state | {"surprise": np.zeros(2)})
    with pytest.raises(RsrlError, match="not as this learner needs it"):
        learner.restore(state | {"params/q.bias": np.zeros(3, np.float32)})


class Recorder(LittleRaces):
    """Keeps what it was asked to drive."""

    def __init__(self) -> None:
        super().__init__()
        self.asked: list[tuple[Params, Branching, tuple[int, int, int]]] = []

    def branch(self, params: Params, branching: Branching, seed: int, iteration: int, races: int) -> Branches:
        self.asked.append(({n: np.array(v) for n, v in params.items()}, branching, (seed, iteration, races)))
        return super().branch(params, branching, seed, iteration, races)


def test_races_are_driven_by_the_first_calls_and_then_with_the_weights_of_the_iteration_before() -> None:
    races = Recorder()
    learner: Any = make_learner(changed(SMALL, own_after=0.5), races, 7)
    start, learned = learner._start, [learner.agent().params]
    for k in range(3):
        learner.advance(k / 3)
        learned.append(learner.agent().params)
    learner._next.result()
    assert [names for _, _, names in races.asked] == [(TRAINING_SEED + 7, k, SMALL.races) for k in range(4)]
    for (driver, _, _), params in zip(races.asked, (start, start, start, learned[2]), strict=True):
        assert same(driver, params)
    assert not same(learned[1], learned[2])


def test_the_policy_before_learning_calls_as_the_one_it_starts_from() -> None:
    learner: Any = make_learner(SMALL, LittleRaces(), 3)
    rng = np.random.default_rng(0)
    features = rng.standard_normal((50, learner.races.n_features)).astype(np.float32)
    agent = learner.agent()
    first, _ = Duelling(learner.races.n_features, 1).step(learner._start, features, np.zeros((50, 0), np.float32))
    np.testing.assert_allclose(agent.q_values(features, agent.initial_memory(50))[0], first, atol=1e-5)


def test_its_settings_are_those_of_the_branching() -> None:
    odd = {"decisions": 3, "branch_most": 0.5, "branch_least": 0.1, "branch_scale": 0.7, "all_calls": 0.6}
    races = Recorder()
    learner: Any = make_learner(changed(SMALL, **odd, plan_share=0.4, pit_chance=0.3, delay_chance=0.9), races, 0)
    learner.advance(0.0)
    learner._next.result()
    expected = Branching(decisions=3, most=0.5, least=0.1, scale=0.7, all_calls=0.6, plan_share=0.4, pit_chance=0.3, delay_chance=0.9)
    assert races.asked[0][1] == expected
    assert len(dataclasses.fields(Branching)) == 8


def test_it_tells_how_much_was_branched_and_how_it_ended() -> None:
    races = LittleRaces()
    learner: Any = make_learner(SMALL, races, 4)
    branches = races.branch(learner.agent().params, learner._branching, TRAINING_SEED + 4, 0, SMALL.races)
    metrics = learner.advance(0.0)
    assert metrics["decisions"] == len(branches.positions)
    assert metrics["mean_position"] == pytest.approx(np.nanmean(branches.positions))
    assert learner.steps == np.isfinite(branches.positions).sum()
    assert metrics["difference_error"] > 0
    assert metrics["value_error"] > 0


def test_an_iteration_without_a_decision_teaches_nothing() -> None:
    class Quiet(LittleRaces):
        def branch(self, *arguments: Any) -> Branches:
            whole = super().branch(*arguments)
            return Branches(whole.features[:0], whole.legal[:0], whole.positions[:0], whole.extra_stops[:0])

    learner: Any = make_learner(SMALL, Quiet(), 0)
    before = learner.agent().params
    assert learner.advance(0.0) == {"decisions": 0.0}
    assert same(before, learner.agent().params)
    assert (learner.iteration, learner.steps) == (1, 0)


def test_the_step_size_falls_with_the_budget() -> None:
    def moved(fraction: float) -> float:
        learner = make_learner(changed(SMALL, epochs=1, minibatch=4096), LittleRaces(), 0)
        before = learner.agent().params["q.weight"]
        learner.advance(fraction)
        return float(np.abs(learner.agent().params["q.weight"] - before).max())

    assert moved(0.0) == pytest.approx(5e-3, rel=0.01)  # Adam's first step is the step size itself
    assert moved(0.5) == pytest.approx(2.75e-3, rel=0.01)
    assert moved(1.0) == moved(2.0) == pytest.approx(5e-4, rel=0.01)


def test_it_never_calls_what_is_not_legal() -> None:
    learner: Any = make_learner(SMALL, LittleRaces(), 0)
    agent = learner.agent()
    agent.params["q.bias"] = np.array([0, 0, 100, 0], np.float32)  # it loves the medium, of which there is none
    assert agent.masked
    seen, memory = LittleRace().reset(0, np.arange(8)), agent.initial_memory(8)
    assert (agent.q_values(seen.features, memory)[0].argmax(axis=1) == 2).all()
    assert set(agent.act(seen.features, seen.legal, memory)[0]) <= {0, 1, 3}
    branches = LittleRaces().branch(agent.params, learner._branching, 0, 0, 64)
    assert np.isnan(branches.positions[:, 2]).all()


def hand_made() -> tuple[Duelling, Params]:
    """Two decisions, told apart by a feature each; values (1, 3, 1, 0) and (0, 0, 3, 1) come by the linear path."""
    network = Duelling(2, 3)
    params = network.init(np.random.default_rng(0))
    params["skip.weight"] = np.array([[1, 2, 0, -1], [0, 0, 3, 1]], np.float32)
    return network, params


ONE_HOT = np.eye(2, dtype=np.float32)
SCORES = np.array([[-4, -5, 0, 0], [2, 0, 2, 5]], np.float32)
TRIED = np.array([[True, True, False, False], [True, False, True, True]])


def test_the_loss_by_hand() -> None:
    """Differences from the mean of the calls tried: (-1, 1) for (.5, -.5), and (-4, 5, -1)/3 for (-1, -1, 2)."""
    network, params = hand_made()
    loss, errors = branch_loss(network, RsrlConfig(value_weight=0.5), params, ONE_HOT, SCORES, TRIED)
    difference = (1.5**2 + 1.5**2 + (1 / 3) ** 2 + (8 / 3) ** 2 + (7 / 3) ** 2) / 2
    value = ((2 - -4.5) ** 2 + (4 / 3 - 3) ** 2) / 2
    np.testing.assert_allclose(np.asarray(errors), [difference, value], rtol=1e-5)
    assert float(loss) == pytest.approx(difference + 0.5 * value, rel=1e-5)


def test_what_all_calls_have_in_common_is_no_difference() -> None:
    network, params = hand_made()
    _, errors = branch_loss(network, SMALL, params, ONE_HOT, SCORES + np.array([[30], [-7]], np.float32), TRIED)
    _, plain = branch_loss(network, SMALL, params, ONE_HOT, SCORES, TRIED)
    assert float(errors[0]) == pytest.approx(float(plain[0]), rel=1e-4)
    assert float(errors[1]) != pytest.approx(float(plain[1]), rel=0.1)


def test_a_call_that_was_not_tried_has_no_gradient() -> None:
    network, params = hand_made()
    weights = {name: jnp.asarray(value) for name, value in params.items()}
    gradient = jax.grad(lambda p, s: branch_loss(network, SMALL, p, ONE_HOT, s, TRIED)[0])
    slope = np.asarray(gradient(weights, SCORES)["skip.weight"])
    assert (slope[:, 1:][~TRIED[:, 1:]] == 0).all()
    assert (np.abs(slope[:, 1:][TRIED[:, 1:]]) > 0.01).all()
    noise = np.where(TRIED, SCORES, 1e6).astype(np.float32)
    np.testing.assert_array_equal(np.asarray(gradient(weights, noise)["skip.weight"]), slope)


def test_it_starts_from_the_best_calls_for_an_empty_track() -> None:
    names = ("gap", *EXPECTED_FEATURES[::-1], "tyre")
    races = SimpleNamespace(feature_set="full", feature_names=names, n_features=len(names), expected_scale_s=10.0)
    learner = make_learner(RsrlConfig(width=8, expected_weight=0.15), races, 0)
    agent = learner.agent()
    seconds = {"expected_stay_s": 4.0, "expected_soft_s": 0.0, "expected_medium_s": 9.0, "expected_hard_s": 4.0}
    features = np.array([[seconds.get(name, 30.0) / 10.0 for name in names]], np.float32)
    values = agent.q_values(features, agent.initial_memory(1))[0][0]
    np.testing.assert_allclose(values, -10.0 + np.array([0.0, 0.6, -0.75, 0.0]), atol=1e-5)


def test_without_expected_times_it_starts_level() -> None:
    assert not expected_time_weights(("gap", *EXPECTED_FEATURES[:3]), 1.5).any()
    agent = make_learner(SMALL, LittleRaces(), 0).agent()
    values, _ = agent.q_values(np.ones((2, LittleRaces().n_features), np.float32), agent.initial_memory(2))
    np.testing.assert_array_equal(values, -10.0)


def test_unknown_agents_and_settings_are_refused() -> None:
    with pytest.raises(RsrlError, match="unknown agent 'ppo'; known agents: dqn, drqn, rsrl"):
        default_config("ppo")
    with pytest.raises(RsrlError, match="unknown setting 'lambda_' of rsrl; known settings: all_calls, branch_least"):
        changed(SMALL, lambda_=0.5)
    with pytest.raises(RsrlError, match="learns on the 'paper' features"):
        make_learner(default_config("dqn"), LittleRaces(), 0)


@pytest.mark.parametrize(
    ("setting", "value", "message"),
    [
        *((name, 0, "races, minibatch, epochs and decisions of rsrl must be at least one") for name in ("races", "minibatch", "epochs")),
        ("decisions", -1, "must be at least one"),
        *((name, 1.5, f"{name} of rsrl is 1.5; it must lie between 0 and 1") for name in ("all_calls", "plan_share", "pit_chance")),
        ("delay_chance", -0.1, "delay_chance of rsrl is -0.1; it must lie between 0 and 1"),
        ("branch_most", float("nan"), "branch_most of rsrl is nan"),
        ("branch_scale", 0.0, "branch_scale of rsrl is 0.0; it must be above 0"),
    ],
)
def test_unfit_settings_are_refused_in_one_line(setting: str, value: float, message: str) -> None:
    with pytest.raises(RsrlError, match=message) as caught:
        make_learner(changed(SMALL, **{setting: value}), LittleRaces(), 0)
    assert "\n" not in str(caught.value)


def test_the_policy_is_pulled_towards_the_calls_it_starts_from() -> None:
    rng = np.random.default_rng(4)
    network = Duelling(6, 5)
    learned = {name: rng.standard_normal(np.shape(value)).astype(np.float32) for name, value in network.init(rng).items()}
    start = np.zeros((6, 4), np.float32)
    start[2, 1:] = (0.5, -0.5, 1.0)
    features, memory = rng.standard_normal((20, 6)).astype(np.float32), np.zeros((20, 0), np.float32)
    before, after = (network.step(params, features, memory)[0] for params in (learned, shrunk_to_start(learned, start, 0.25)))
    np.testing.assert_allclose(after[:, 0], before[:, 0], rtol=1e-5)
    expected = 0.75 * (before[:, 1:] - before[:, :1]) + 0.25 * features @ start[:, 1:]
    np.testing.assert_allclose(after[:, 1:] - after[:, :1], expected, rtol=1e-3, atol=1e-4)
    assert shrunk_to_start(learned, np.zeros_like(start), 0.25) is learned
