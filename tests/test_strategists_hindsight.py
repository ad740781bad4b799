"""Hindsight as a bound: what it simulates is what is driven, it finds the optimum of a toy, and others are not ahead of it."""

import dataclasses

import numpy as np
import pytest
from synthetic_race import synthetic_race
from test_strategists_dp import every_plan

from rsrl.environment import RaceEnvironment
from rsrl.evaluation import run_races
from rsrl.season import RaceRecord
from rsrl.simulator import Plan, compile_figures, simulate_plans
from rsrl.strategists import BestPlanStrategist, DpStrategist, FixedStrategist, HeuristicStrategist, HindsightStrategist
from rsrl.strategists.plan_search.hindsight import scores_of
from rsrl.strategists.plan_search.plan_table import PlanTable, with_extra_stop

TUNING_SEED, RACES, BUDGET = 1_000_003, 96, 4000


def begun(record: RaceRecord, car: int, races: int, seed: int, plans_per_race: int) -> tuple[HindsightStrategist, RaceEnvironment]:
    strategist = HindsightStrategist(record, car, 0, budget=BUDGET, plans_per_race=plans_per_race)
    environment = RaceEnvironment(record, car, batch=races)
    numbers = np.arange(races, dtype=np.int64)
    environment.reset(seed, numbers)
    strategist.begin(environment, seed, numbers)
    return strategist, environment


def driven(strategist: HindsightStrategist, environment: RaceEnvironment) -> np.ndarray:
    for _ in range(environment.laps):
        environment.step(strategist.decide(environment))
    assert environment.done.all()
    assert not (~environment.outcome().valid & ~environment.outcome().retired).any()
    return environment.outcome().position


@pytest.fixture(scope="module")
def hindsight(bahrain: RaceRecord) -> np.ndarray:
    """Positions by hindsight on the first races of the tuning seed."""
    return driven(*begun(bahrain, bahrain.car_index("HAM"), RACES, TUNING_SEED, 400))


def test_no_plan_and_no_rule_is_ahead_of_it_on_any_race(bahrain: RaceRecord, hindsight: np.ndarray) -> None:
    """They are among its first plans, so that this holds for each race and not for most."""
    car = bahrain.car_index("HAM")
    for other in (
        FixedStrategist(bahrain, car, 0),
        BestPlanStrategist(bahrain, car, 0, budget=BUDGET),
        DpStrategist(bahrain, car, 0),
        HeuristicStrategist(bahrain, car, 0),
    ):
        positions = run_races(other, bahrain, car, TUNING_SEED, RACES).position
        assert (hindsight <= positions).all()
        assert positions.mean() - hindsight.mean() > 0.5


def test_plans_beyond_its_search_are_seldom_ahead_of_it(bahrain: RaceRecord, hindsight: np.ndarray) -> None:
    car = bahrain.car_index("HAM")
    for sc_rule in (False, True):
        other = BestPlanStrategist(bahrain, car, 5, sc_rule=sc_rule, budget=2 * BUDGET)
        positions = run_races(other, bahrain, car, TUNING_SEED, RACES).position
        assert (positions < hindsight).mean() <= 0.02


def test_a_race_is_driven_to_the_position_that_was_simulated(bahrain: RaceRecord) -> None:
    car = bahrain.car_index("HAM")
    strategist, environment = begun(bahrain, car, 40, 9, 150)
    plans = [strategist._plans[row] for row in strategist._rows.tolist()]
    simulated = [
        int(simulate_plans(compile_figures(bahrain), car, [plan], 9, np.array([i], np.int64))[0][0, 0]) for i, plan in enumerate(plans)
    ]
    assert driven(strategist, environment).tolist() == simulated


def test_it_races_the_rivals_of_the_environment_it_is_given() -> None:
    """Rivals with plans of their own: simulated with them, not with those of the record."""
    record = synthetic_race(laps=12, plans=("S-H@6", "M-H@8"))
    rivals = {i: Plan.parse("H-S@2-S@4") for i in range(9)}
    strategist = HindsightStrategist(record, 9, 0, plans_per_race=60, budget=BUDGET)
    numbers = np.arange(30, dtype=np.int64)
    environment = RaceEnvironment(record, 9, batch=30, plans=rivals)
    environment.reset(4, numbers)
    strategist.begin(environment, 4, numbers)
    position = driven(strategist, environment)
    dp, twin = DpStrategist(record, 9, 0), RaceEnvironment(record, 9, batch=30, plans=rivals)
    twin.reset(4, numbers)
    dp.begin(twin, 4, numbers)
    for _ in range(record.laps):
        twin.step(dp.decide(twin))
    assert (position <= twin.outcome().position).all()


def test_on_a_toy_it_finds_the_best_of_all_plans() -> None:
    record = synthetic_race(laps=9, plans=("S-H@4",), sets=(2, 1, 2), loss_green_s=4.0, loss_sc_s=2.0, loss_vsc_s=3.0, sc_per_lap=0.1)
    position = driven(*begun(record, 9, 24, 3, 500))
    plans = every_plan(record, 0, 3)
    positions, _ = simulate_plans(compile_figures(record), 9, plans, 3, np.arange(24, dtype=np.int64))
    assert len(plans) > 500
    assert (position - positions.min(axis=0)).mean() < 0.1
    assert position.mean() < positions.mean(axis=1).min() - 0.5


def test_the_score_is_the_position_and_then_the_gap_to_the_car_ahead() -> None:
    positions = np.array([[2, 1, 3], [1, 2, 3], [2, 1, 3]], np.int8)
    times_s = np.array([[101.0, 100.0, 110.0], [99.0, 100.0, 110.0], [900.0, 100.0, 110.0]], np.float32)
    np.testing.assert_allclose(scores_of(positions, times_s, 0), [2.01, 1.0, 2.99])


def test_moves_are_legal_numbered_once_and_reach_more_and_fewer_stops() -> None:
    record = synthetic_race(laps=16, sets=(2, 2, 2))
    table = PlanTable(record, 0)
    (number,) = table.add([Plan.parse("S-H@6-S@11")])
    moves = [str(table[n]) for n in table.neighbours(number)]
    on_lap_3 = [str(table[n]) for n in table.with_stop_on(number, [3])]
    assert len(set(moves)) == len(moves)
    assert {"S-H@7-S@11", "S-H@6-S@9", "S-M@6-S@11", "S-H@6", "S-H@3-H@6-S@11"} <= {*moves, *on_lap_3}
    assert "S-S@11" not in moves, "one compound only"
    assert {p.stops for p in map(table.__getitem__, table.neighbours(number))} == {1, 2, 3}
    laps = {table[n].laps for n in table.with_stop_on(number, [8])}
    assert laps == {(8, 11), (6, 8), (6, 8, 11)}
    assert table.add([Plan.parse("S-S@5"), table[number]]) == [number]
    assert len(table.rows()) == max(table.neighbours(number) + tuple(table.with_stop_on(number, [3, 8]))) + 1
    assert not list(with_extra_stop(Plan.parse("S-H@6"), 6))
    full = dataclasses.replace(Plan.parse("S-H@1"), compounds=(0, *[2] * 8), laps=tuple(range(1, 9)))
    assert not list(with_extra_stop(full, 12))
