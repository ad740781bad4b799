"""What holds for every strategist: known by name, legal, random by race and not by batch."""

import numpy as np
import pytest
from reactive_race import reactive

from rsrl.agents import default_config
from rsrl.agents.interface import NetworkAgent
from rsrl.agents.networks import NETWORKS
from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.rollouts.hashing import uniform
from rsrl.season import RaceRecord
from rsrl.state import input_names
from rsrl.strategists import (
    STRATEGISTS,
    BestPlanStrategist,
    HindsightStrategist,
    PlannerStrategist,
    PolicyStrategist,
    Strategist,
    Tree,
    TreeStrategist,
    make_strategist,
)
from rsrl.strategists.interface import made_legal

CAR, BUDGET = 6, 4000
NAMES = (*STRATEGISTS, "policy")
RULE = Tree(
    np.array([0, -1, 1, -1, -1], np.int32), np.array([18.5, 0, 0.2, 0, 0], np.float32), np.array([1, -1, 3, -1, -1], np.int32),
    np.array([2, -1, 4, -1, -1], np.int32), np.array([0, 0, 0, 3, 1], np.int8), np.zeros((5, 4), np.int64),
    ("tyre_age_laps", "gap_ahead_trend_s"),
)  # fmt: skip
"""Old tyres are changed, for softs where the car ahead pulls away."""


def random_agent(kind: str = "rsrl") -> NetworkAgent:
    """An untrained agent of a kind, with weights large enough to make it box now and then."""
    config = default_config(kind)
    names = input_names(config.feature_set)
    network = NETWORKS["lstm" if kind == "drqn" else "duelling"](len(names), 16)
    rng = np.random.default_rng(3)
    params = {name: value + rng.normal(0, 0.3, np.shape(value)).astype(np.float32) for name, value in network.init(rng).items()}
    return NetworkAgent(kind, config.feature_set, names, True, network, params)


def make(name: str, record: RaceRecord) -> Strategist:
    if name == "policy":
        return PolicyStrategist(random_agent(), record)
    if name == "tree":
        return TreeStrategist(RULE)
    if name.startswith("best-plan"):
        return BestPlanStrategist(record, CAR, 0, sc_rule=name == "best-plan-sc", budget=BUDGET)
    if name == "hindsight":
        return HindsightStrategist(record, CAR, 0, plans_per_race=120, budget=BUDGET)
    if name.startswith("planner"):
        return PlannerStrategist(record, CAR, 3, budget_ms=1.0, name=name)
    return make_strategist(name, record, CAR, seed=3)


def called(strategist: Strategist, record: RaceRecord, races: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Calls [races, laps] and positions; asserts that each call was legal."""
    environment = RaceEnvironment(record, CAR, batch=len(races))
    numbers = np.array(races, np.int64)
    environment.reset(21, numbers)
    strategist.begin(environment, 21, numbers)
    calls = np.zeros((len(races), environment.laps), np.int8)
    for lap in range(environment.laps):
        calls[:, lap] = strategist.decide(environment)
        legal = environment.legal[np.arange(len(races)), calls[:, lap]]
        assert (legal | environment.done).all()
        calls[environment.done, lap] = 0
        environment.step(calls[:, lap])
    assert environment.done.all()
    outcome = environment.outcome()
    assert (outcome.valid | outcome.retired).all()
    return calls, outcome.position


@pytest.mark.parametrize("name", NAMES)
def test_calls_are_legal_and_a_race_is_called_the_same_in_any_batch(bahrain: RaceRecord, name: str) -> None:
    record = reactive(bahrain) if name == "imitation" else bahrain
    calls, positions = called(make(name, record), record, list(range(96)))
    for races in ([5], [90, 3, 44]):
        again, places = called(make(name, record), record, races)
        np.testing.assert_array_equal(again, calls[races])
        np.testing.assert_array_equal(places, positions[races])


def test_an_unknown_strategist_is_refused_with_those_there_are(bahrain: RaceRecord) -> None:
    with pytest.raises(RsrlError, match="unknown strategist 'oracle'; there are fixed, heuristic, best-plan, best-plan-sc"):
        make_strategist("oracle", bahrain, CAR)


def test_an_agent_of_another_feature_schema_is_refused(bahrain: RaceRecord) -> None:
    agent = random_agent()
    foreign = NetworkAgent(agent.kind, agent.feature_set, agent.feature_names[::-1], True, agent.network, agent.params)
    with pytest.raises(RsrlError, match="another version of the 'full' features"):
        PolicyStrategist(foreign, bahrain)


def test_what_is_not_legal_is_replaced_by_staying_out_then_by_the_hardest_set() -> None:
    legal = np.array([[1, 1, 1, 1], [1, 0, 1, 1], [0, 1, 1, 1], [0, 1, 1, 0], [0, 1, 0, 0]], np.bool_)
    calls = np.array([1, 1, 0, 3, 0], np.int8)
    assert made_legal(calls, legal).tolist() == [1, 0, 3, 2, 1]
    assert calls.tolist() == [1, 1, 0, 3, 0], "its argument is left alone"


def test_luck_is_uniform_and_a_function_of_seed_race_lap_and_purpose() -> None:
    races = np.arange(20_000, dtype=np.int64)
    drawn = uniform((1, 2), races, 5)
    assert abs(drawn.mean() - 0.5) < 0.01
    assert np.abs(np.histogram(drawn, 10, (0, 1))[0] / 2000 - 1).max() < 0.1
    np.testing.assert_array_equal(uniform((1, 2), races[[7, 3]], 5), drawn[[7, 3]])
    np.testing.assert_array_equal(uniform((1, 2), races[:3], np.array([5, 5, 5])), drawn[:3])
    for other in (uniform((2, 1), races, 5), uniform((1, 2), races, 6), uniform((1, 2), races, 5, 1), uniform((1, 2), races + 1, 5)):
        assert abs(np.corrcoef(drawn, other)[0, 1]) < 0.03
