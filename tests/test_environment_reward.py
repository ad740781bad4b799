"""The reward is the paper's, case by case and in its order, alone and through the environment."""

import itertools

import numpy as np
import pytest
from synthetic_race import quiet, synthetic_race

from rsrl.environment import RaceEnvironment
from rsrl.environment.reward import reward_of
from rsrl.season import RaceRecord

POINTS = [25, 18, 15, 12, 10, 8, 6, 4, 2, 1]
reward = reward_of.py_func if hasattr(reward_of, "py_func") else reward_of


def paper(action: int, available: bool, valid_before: bool, terminal: bool, retired: bool, valid_after: bool, position: int) -> float:
    """R^t as printed, case after case; beside it the one exception made: a retired car is not failed for a missing stop."""
    cases = [
        (-1000.0, action == 1 and not available),
        (-1000.0, action == 2 and not available),
        (-1000.0, action == 3 and not available),
        (-1000.0, terminal and not valid_after and not retired),
        (-10.0, action != 0 and valid_before),
        (100.0 * POINTS[position - 1] if position <= 10 else 0.0, position <= 10 and terminal),
        (0.0, position > 10 and terminal),
        (1.0, True),
    ]
    return next(value for value, holds in cases if holds)


def test_all_cases_in_their_order() -> None:
    flag = (False, True)
    for case in itertools.product(range(4), flag, flag, flag, flag, flag, range(1, 21)):
        assert reward(*case) == paper(*case)


@pytest.mark.parametrize(
    ("what", "arguments", "value"),
    [
        ("a normal lap", (0, True, False, False, False, False, 20), 1),
        ("the first stop for a second compound", (3, True, False, False, False, True, 20), 1),
        ("a stop more", (1, True, True, False, False, True, 20), -10),
        ("a stop without a set, whatever else holds", (1, False, True, True, False, True, 1), -1000),
        ("the flag on one compound", (0, True, False, True, False, False, 1), -1000),
        ("the flag on one compound with a late call", (2, True, False, True, False, False, 1), -1000),
        ("an extra call on the last lap counts before the position", (1, True, True, True, False, True, 1), -10),
        ("a win", (0, True, True, True, False, True, 1), 2500),
        ("tenth", (0, True, True, True, False, True, 10), 100),
        ("eleventh", (0, True, True, True, False, True, 11), 0),
        ("retired on one compound", (0, True, False, True, True, False, 17), 0),
        ("retired as one of few left", (0, True, False, True, True, False, 9), 200),
    ],
)
def test_cases_by_name(what: str, arguments: tuple[int, bool, bool, bool, bool, bool, int], value: float) -> None:
    assert reward(*arguments) == value, what


def played(record: RaceRecord, calls: dict[int, int], car: int = 0) -> tuple[list[float], RaceEnvironment]:
    """Rewards of a race with calls by lap, from 1."""
    environment = RaceEnvironment(record, car)
    environment.reset(1, np.zeros(1, np.int64))
    rewards = []
    for lap in range(1, record.laps + 1):
        t = environment.step(np.array([calls.get(lap, 0)], np.int8))
        rewards.append(float(t.reward[0]))
        assert not t.truncated[0]
        if t.terminated[0]:
            break
    return rewards, environment


STARTS_ON_MEDIUM = {"laps": 10, "plans": ("M-S@5",)}


@pytest.mark.parametrize(
    ("calls", "rewards"),
    [
        ({5: 1}, [1] * 9),  # the finish stands below
        ({4: 2, 6: 1}, [1] * 9),  # medium to medium leaves the car invalid: no penalty, as the paper has it
        ({3: 1, 6: 3}, [1, 1, 1, 1, 1, -10, 1, 1, 1]),
        ({3: 1, 6: 1, 7: 3}, [1, 1, 1, 1, 1, -1000]),  # two sets of softs: one on the car, one for the stop... see sets below
        ({1: 1, 10: 3}, [1] * 9),
    ],
)
def test_rewards_of_whole_races(calls: dict[int, int], rewards: list[float]) -> None:
    record = synthetic_race(**STARTS_ON_MEDIUM, sets=(1, 2, 2), pace_step_s=3.0, **quiet())  # type: ignore[arg-type]
    found, environment = played(record, calls)
    outcome = environment.outcome()
    if rewards[-1] == -1000:
        assert found == rewards
        assert outcome.failed[0]
        assert not outcome.valid[0]
        assert outcome.position[0] == 20
    else:
        assert found[:-1] == rewards
        late_call = calls.get(10, 0) > 0
        assert found[-1] == (-10 if late_call else 100 * POINTS[outcome.position[0] - 1])
        assert outcome.stops[0] == len([lap for lap in calls if lap < 10])
        assert outcome.valid[0]


def test_staying_out_to_the_flag_fails() -> None:
    record = synthetic_race(laps=10, plans=("M-S@5",), **quiet())
    found, environment = played(record, {})
    assert found == [1.0] * 9 + [-1000.0]
    assert environment.outcome().position[0] == 20  # behind every car that used two compounds
    assert not environment.outcome().valid[0]
    assert not environment.outcome().failed[0]
