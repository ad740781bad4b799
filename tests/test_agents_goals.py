"""Goals of training: scores by hand, and policies that follow the goal they were given where two goals ask for different calls."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rsrl.agents import ModelMetadata, RsrlConfig, changed, make_learner
from rsrl.agents.goals import GOALS
from rsrl.agents.networks import Params
from rsrl.errors import RsrlError
from rsrl.explanation import ExplainedPolicy
from rsrl.rollouts import Branches, Branching

NAN = np.nan
POSITIONS = np.array([[1.0, 2.0, 10.0, 11.0], [20.0, NAN, 3.0, NAN]])
STOPS = np.array([[0.0, 1.0, 2.0, 0.0], [1.0, NAN, 0.0, NAN]])


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("position", [[-1, -2, -10, -11], [-20, 0, -3, 0]]),
        ("points", [[25, 18, 1, 0], [0, 0, 15, 0]]),
        ("paper-reward", [[2500, 1800 - 11, 100 - 22, 0], [-11, 0, 1500, 0]]),
    ],
)
def test_scores_by_hand(name: Any, expected: list[list[float]]) -> None:
    goal = GOALS[name]
    np.testing.assert_allclose(goal.scores(POSITIONS, STOPS) * goal.place, expected)


def test_every_goal_starts_at_the_worth_of_tenth_place() -> None:
    starts = {name: goal.start * goal.place for name, goal in GOALS.items()}
    assert starts == {"position": -10.0, "points": 1.0, "paper-reward": 100.0}


class Gamble:
    """One decision, over and over: to stay brings sixth place; to box brings a win in a share of the races, else eleventh place.

    What pays depends on the goal: in places a sure sixth place beats four wins in ten, in points it does not. The stop is an extra one.
    """

    feature_set, feature_names, n_features, expected_scale_s = "full", ("one",), 1, 0.0

    def __init__(self, wins: float) -> None:
        self.wins = wins

    def branch(self, params: Params, branching: Branching, seed: int, iteration: int, races: int) -> Branches:
        rng = np.random.default_rng([seed, iteration])
        positions = np.full((races, 4), np.nan, np.float32)
        positions[:, 0], positions[:, 3] = 6.0, np.where(rng.random(races) < self.wins, 1.0, 11.0)
        legal = np.isfinite(positions)
        extra = np.where(legal, np.arange(4) == 3, np.nan).astype(np.float32)
        return Branches(np.ones((races, 1), np.float32), legal, positions, extra)


CONFIG = RsrlConfig(width=8, races=512, minibatch=128, epochs=4, learning_rate=3e-2, final_learning_rate=1e-3)


def values(goal: Any, wins: float) -> Any:
    """Learned values of staying and of boxing."""
    learner: Any = make_learner(changed(CONFIG, goal=goal), Gamble(wins), 0)
    for k in range(40):
        learner.advance(k / 40)
    agent = learner.agent()
    return agent.q_values(np.ones((1, 1), np.float32), agent.initial_memory(1))[0][0][[0, 3]]


@pytest.mark.parametrize(
    ("goal", "stay", "box"),
    [("position", -6.0, -0.4 * 1 - 0.6 * 11), ("points", 8.0, 0.4 * 25), ("paper-reward", 800.0, 0.4 * 2500 - 11)],
)
def test_values_are_expected_scores_in_the_unit_of_the_goal(goal: Any, stay: float, box: float) -> None:
    learned = values(goal, wins=0.4)
    place = GOALS[goal].place
    np.testing.assert_allclose(learned / place, np.array([stay, box]) / place, atol=0.3)
    assert (learned[1] > learned[0]) == (box > stay), "in places the gamble loses, in points it pays"


def test_an_unknown_goal_is_refused() -> None:
    with pytest.raises(RsrlError, match="no goal 'laps'; there are position, points, paper-reward"):
        make_learner(changed(CONFIG, goal="laps"), Gamble(0.5), 0)


@pytest.mark.parametrize(("goal", "unit"), [({}, "places"), ({"goal": "position"}, "places"), ({"goal": "points"}, "points")])
def test_explanations_name_the_unit_of_the_goal(goal: dict[str, str], unit: str) -> None:
    learner: Any = make_learner(CONFIG, Gamble(0.5), 0)
    assert ExplainedPolicy(learner.agent(), ModelMetadata(config=goal), "model", Path(), "").unit == unit
