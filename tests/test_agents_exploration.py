import numpy as np
import pytest

from rsrl.agents.exploration import draw_experiments, drawn_stop, explore

LAPS, RACES = 20, 4000


def test_plans_have_one_to_three_stops_and_their_share() -> None:
    drawn = draw_experiments(np.random.default_rng(0), LAPS, RACES, 0.3)
    stops = (drawn.plan > 0).sum(axis=0)
    assert set(stops) == {1, 2, 3}
    assert (drawn.plan_until > 0).mean() == pytest.approx(0.3, abs=0.03)
    assert drawn.plan_until.max() == LAPS


def test_the_same_draws_from_the_same_seed() -> None:
    one, two = (draw_experiments(np.random.default_rng([4, 2]), LAPS, 8, 0.5) for _ in range(2))
    assert all((a == b).all() for a, b in zip(vars(one).values(), vars(two).values(), strict=True))


def test_small_departures_come_at_their_rate() -> None:
    drawn = draw_experiments(np.random.default_rng(1), LAPS, RACES, 0.0)
    legal = np.ones((RACES, 4), bool)
    stay, pit = np.zeros(RACES, np.int8), np.full(RACES, 2, np.int8)
    stops = np.mean([(explore(drawn, lap, stay, legal, 0.05, 0.25) > 0).mean() for lap in range(LAPS)])
    delays = np.mean([(explore(drawn, lap, pit, legal, 0.05, 0.25) == 0).mean() for lap in range(LAPS)])
    assert stops == pytest.approx(0.05, abs=0.005)
    assert delays == pytest.approx(0.25, abs=0.01)


def test_a_planned_race_follows_its_plan_then_the_policy() -> None:
    drawn = draw_experiments(np.random.default_rng(2), LAPS, RACES, 1.0)
    legal, greedy = np.ones((RACES, 4), bool), np.full(RACES, 3, np.int8)
    for lap in range(LAPS):
        actions = explore(drawn, lap, greedy, legal, 0.0, 0.0)
        planned = lap < drawn.plan_until
        assert (actions[planned] == drawn.plan[lap, planned]).all()
        assert (actions[~planned] == 3).all()


def test_no_experiment_is_illegal() -> None:
    rng = np.random.default_rng(3)
    drawn = draw_experiments(rng, LAPS, RACES, 0.5)
    for lap in range(LAPS):
        legal = rng.random((RACES, 4)) < 0.4
        legal[:, 0] |= ~legal.any(axis=1)
        greedy = legal.argmax(axis=1).astype(np.int8)
        actions = explore(drawn, lap, greedy, legal, 0.3, 0.3)
        assert legal[np.arange(RACES), actions].all()


def test_a_drawn_stop_takes_the_legal_tyre_of_highest_priority() -> None:
    priority = np.array([[0.9, 0.1, 0.5, 0.8]] * 3, np.float32)
    legal = np.array([[True, True, True, True], [True, True, True, False], [True, False, False, False]])
    assert drawn_stop(priority, legal).tolist() == [3, 2, 0]
