"""Races of 2, 22 and 24 cars, from the grid to what stands on the compiled race; and what a car draws whatever the field."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from reactive_race import reactive
from slow_features import SlowFeatures
from synthetic_race import synthetic_race
from test_rollouts_branching import EVERYTHING, constant_policy
from test_translators_simulator import decisions

from rsrl.agents import ModelMetadata, NetworkAgent
from rsrl.agents.networks import Duelling
from rsrl.drawing import TracePanel, plot_race_trace
from rsrl.environment import RaceEnvironment, with_scaling
from rsrl.evaluation import plot_positions, run_races
from rsrl.explanation import ExplainedPolicy
from rsrl.explanation.what_if import explain_what_if, moment_from_state
from rsrl.rollouts import BranchingRaces
from rsrl.season import MAX_CARS, POINTS, RaceRecord, find_car
from rsrl.simulator import RaceBatch, compile_figures, lap_means, simulate, summarise, trace_races
from rsrl.simulator import layout as at
from rsrl.state import COLUMN, Encoder, Observer, input_names
from rsrl.strategists import DpStrategist, HeuristicStrategist, ImitationStrategist, PlannerStrategist, search_plans
from rsrl.translators import simulated_state

FIELDS = (2, 22, 24)


def record_of(cars: int) -> RaceRecord:
    """A race that tells everything apart: rivals that react, retirements, safety cars, random stints."""
    return reactive(synthetic_race(cars=cars, retire_per_lap=0.02, pace_step_s=0.05, stint_sd_s=0.2), spread=0.2)


@pytest.mark.parametrize("cars", FIELDS)
@pytest.mark.parametrize("rivals", ["reactive", "plans"])
def test_every_car_is_raced_and_classified(cars: int, rivals: str) -> None:
    record = record_of(cars)
    results = simulate(record, 64, 3, rivals=rivals)  # type: ignore[arg-type]
    assert results.positions.shape == results.stops.shape == results.retired.shape == results.race_time_s.shape == (64, cars)
    np.testing.assert_array_equal(np.sort(results.positions), np.tile(np.arange(1, cars + 1), (64, 1)))
    assert results.retired.any(axis=0).all(), "each car retires at times"
    assert (~results.retired).any(axis=0).all()
    assert (results.stops[~results.retired] >= 1).all()
    assert results.points(0).max() == POINTS[0]
    for summary in summarise(record, results):
        assert len(summary.positions) == cars
        assert sum(summary.positions) == pytest.approx(1)


@pytest.mark.parametrize("cars", FIELDS)
def test_traces_and_lap_means_have_a_column_for_each_car(cars: int) -> None:
    record = record_of(cars)
    trace, means, results = trace_races(record, 64, 3), lap_means(record, 64, 3), simulate(record, 64, 3)
    np.testing.assert_array_equal(means.results.positions, results.positions)
    np.testing.assert_array_equal(trace.stopped.sum(axis=1), results.stops)
    assert means.lap_time_s.shape == means.position.shape == (record.laps, cars)
    assert means.first_stop.shape == (record.laps + 1, cars)
    assert means.first_stop.sum() == 64 * cars
    for place, running in zip(trace.place[:, -1], trace.running[:, -1], strict=True):
        assert sorted(place[running]) == list(range(1, running.sum() + 1))
    assert np.nanmax(means.position) <= cars


def test_a_car_draws_the_same_whatever_the_field() -> None:
    """Form, start, retirement and plan of cars that are there in every field."""
    large = record_of(24)
    batches = []
    for cars in (2, 20, 22, 24):
        record = dataclasses.replace(large, cars=large.cars[:cars])
        batch = RaceBatch(compile_figures(record), 50)
        batch.start(5, np.arange(50, dtype=np.int64))
        batches.append(batch)
    first = batches[0]
    assert len(np.unique(first.f[:, at.F_USE, 0])) == 50
    for batch in batches[1:]:
        np.testing.assert_array_equal(batch.f[:, :, :2], first.f[:, :, :2])
        np.testing.assert_array_equal(batch.k[:, :, :2], first.k[:, :, :2])
    np.testing.assert_array_equal(batches[-1].f[:, :, :20], batches[1].f[:, :, :20])
    pace = batches[-1].f[:, at.F_PACE] - large_paces(large)
    assert len(np.unique(pace, axis=1)[0]) == 24, "and no two cars the same"


def large_paces(record: RaceRecord) -> np.ndarray:
    return np.array([car.pace_s.value for car in record.cars], np.float32)


@pytest.mark.parametrize("cars", FIELDS)
def test_the_environment_shows_what_the_definitions_say(cars: int) -> None:
    record = record_of(cars)
    car = cars - 1
    environment, observer = RaceEnvironment(record, car, batch=24), Observer(record, car)
    slow = SlowFeatures(record, car, [float(c) for c in observer.context.pit_cost_s])
    seen = 0
    for lap, _ in enumerate(decisions(environment, seed=car)):
        for row in np.flatnonzero(~environment.done)[lap % 4 :: 4]:
            state = simulated_state(record, environment.races, int(row), car)
            assert len(state.cars) == cars
            raw = observer.row(state)
            np.testing.assert_array_equal(raw.view(np.int32), environment.raw[row].view(np.int32))
            for name, value in slow(state).items():
                assert raw[COLUMN[name]] == pytest.approx(float(value), abs=2e-3), (name, state)
            seen += 1
    assert seen > 40
    outcome = environment.outcome()
    assert (outcome.position >= 1).all()
    assert (outcome.position <= cars).all()


def test_input_of_a_policy_keeps_its_range_behind_place_20() -> None:
    """A policy has met twenty places: those behind the last of them look like it."""
    record = record_of(24)
    environment = RaceEnvironment(record, 23, batch=4)
    features = environment.reset(1, np.arange(4, dtype=np.int64)).features
    at_grid = environment.feature_names.index("grid"), environment.feature_names.index("position")
    assert (environment.raw[:, COLUMN["position"]] == 24).all()
    assert (features[:, at_grid] == 1.0).all()
    assert features.min() >= -1.0
    assert features.max() <= 1.0


def test_a_call_that_cannot_be_carried_out_counts_as_the_last_place() -> None:
    for cars in (2, 19, 20, 22, 24):
        record = synthetic_race(cars=cars, sets=(1, 2, 2), plans=("S-H@6",), retire_per_lap=0.0, retire_lap1=0.0)
        environment = RaceEnvironment(record, 1, batch=1)
        environment.reset(1, np.zeros(1, np.int64))
        reward = environment.step(np.ones(1, np.int8)).reward[0]
        assert (reward, environment.outcome().position[0], environment.outcome().failed[0]) == (-1000.0, max(cars, 20), True)


def test_the_last_of_a_large_field_is_paid_like_every_place_without_points() -> None:
    record = synthetic_race(cars=24, pace_step_s=0.5, plans=("S-H@6",), retire_per_lap=0.0, retire_lap1=0.0)
    environment = RaceEnvironment(record, 23, batch=1)
    environment.reset(1, np.zeros(1, np.int64))
    for lap in range(record.laps):
        reward = environment.step(np.full(1, 3 if lap == 7 else 0, np.int8)).reward[0]
    assert environment.outcome().position[0] == 24
    assert reward == 0.0


@pytest.mark.parametrize("cars", FIELDS)
def test_strategists_call_any_field(cars: int) -> None:
    record = record_of(cars)
    car = cars - 1
    for strategist in (
        DpStrategist(record, car, 0), HeuristicStrategist(record, car, 0), ImitationStrategist(record, car, 0),
        PlannerStrategist(record, car, 0, 1.0),
    ):  # fmt: skip
        log = run_races(strategist, record, car, 2, 8)
        assert not log.invalid.any()
        assert log.position.max() <= cars
    found = search_plans(record, car, 0, seed=1, budget=2000)
    assert found.best.compounds[0] == 0
    assert all(1 <= ranked.mean_position <= cars for ranked in found.ranked)


@pytest.mark.parametrize("cars", FIELDS)
def test_training_branches_in_any_field(cars: int) -> None:
    record = synthetic_race(cars=cars, pace_step_s=0.3, retire_per_lap=0.0, retire_lap1=0.0)
    branches = BranchingRaces([(record, cars - 1)], threads=1).branch(constant_policy(0.0, -1.0, -1.0, -1.0), EVERYTHING, 3, 0, 4)
    known = branches.positions[np.isfinite(branches.positions)]
    assert len(known) > 40
    assert known.min() >= 1
    assert known.max() == cars


@pytest.mark.parametrize("cars", FIELDS)
def test_a_state_of_any_field_is_explained(cars: int) -> None:
    record, car = record_of(cars), cars - 1
    environment = RaceEnvironment(record, car, batch=1)
    environment.reset(4, np.zeros(1, np.int64))
    for _ in range(5):
        environment.step(np.zeros(1, np.int8))
    state = simulated_state(record, environment.races, 0, car)
    moment = moment_from_state(record, car, state)
    np.testing.assert_array_equal(moment.raw[0], environment.raw[0])
    explanation = explain_what_if(toy_policy(), moment, races=32)
    shares = np.array(explanation.details["positions"])
    assert 20 <= shares.shape[1] <= max(cars, 20)
    np.testing.assert_allclose(shares.sum(axis=1), 1.0)
    assert not shares[:, cars:].any()


def toy_policy() -> ExplainedPolicy:
    network = Duelling(len(input_names("full")), 4)
    params = network.init(np.random.default_rng(0))
    params["q.bias"] = np.array([0, -3, -2, -1], np.float32)
    agent = NetworkAgent("rsrl", "full", input_names("full"), True, network, params)
    return ExplainedPolicy(agent, ModelMetadata(), "toy", Path("toy"), "0" * 16)


@pytest.mark.parametrize("cars", FIELDS)
def test_scaling_and_pictures_of_any_field(cars: int, tmp_path: Path) -> None:
    record = record_of(cars)
    scaled = with_scaling(record)
    Encoder("paper", scaled.scaling)
    low, high = scaled.scaling["gap_two_ahead_s"]
    assert (low, high) == (0.0, 60.0) if cars == 2 else high > low
    log = run_races(HeuristicStrategist(record, cars - 1, 0), record, cars - 1, 2, 20)
    plot_positions([log], "places", tmp_path / "places.png")
    trace = trace_races(record, 1, 3)
    time_s = np.where(trace.running[0], trace.race_time_s[0], np.nan)
    names, teams = [car.driver for car in record.cars], [car.team for car in record.cars]
    plot_race_trace([TracePanel("race", names, teams, time_s, trace.track_status[0].astype(np.int64))], "trace", tmp_path / "trace.png")
    assert (tmp_path / "places.png").stat().st_size > 5000
    assert (tmp_path / "trace.png").stat().st_size > 5000


def test_the_largest_field_is_the_compiled_one() -> None:
    assert at.CARS == MAX_CARS == 24
    assert at.CARS <= 32, "as many as the counter of random draws tells apart"
    assert find_car(record_of(24), "C23") == 23
