"""A simulated race, translated and observed, is the environment's own raw row bit for bit."""

from collections.abc import Iterator

import numpy as np
import pytest
from synthetic_race import synthetic_race

from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.season import RaceRecord
from rsrl.simulator import Plan, simulate
from rsrl.simulator import layout as at
from rsrl.state import COLUMN, Action, Observer, UnifiedRaceStrategy
from rsrl.translators import SimulatedRace, Translator, simulated_state

BATCH = 24


def decisions(environment: RaceEnvironment, seed: int) -> Iterator[None]:
    """A batch of races stepped to the flag with random legal calls, one stop in six laps; yields before each decision."""
    rng = np.random.default_rng(seed)
    environment.reset(seed, np.arange(BATCH, dtype=np.int64))
    while not environment.done.all():
        yield
        choice = np.where(environment.legal, rng.random((BATCH, 4)), -1.0)
        choice[:, 0] += np.where(environment.legal[:, 0] & (rng.random(BATCH) < 5 / 6), 2.0, 0.0)
        environment.step(choice.argmax(axis=1).astype(np.int8))


@pytest.mark.parametrize("cars", [20, 17])
def test_observed_translation_is_the_environments_raw_row_bit_for_bit(cars: int) -> None:
    record = synthetic_race(cars=cars, retire_per_lap=0.02)
    met = {"safety car": 0, "virtual": 0, "retired rival": 0, "own stop": 0, "leading": 0, "last": 0}
    for car in (0, 6, cars - 1):
        environment = RaceEnvironment(record, car, batch=BATCH)
        observer = Observer(record, car)
        for _ in decisions(environment, seed=car + 1):
            for row in np.flatnonzero(~environment.done):
                state = simulated_state(record, environment.races, int(row), car)
                np.testing.assert_array_equal(observer.row(state).view(np.int32), environment.raw[row].view(np.int32))
                own = next(c for c in state.cars if c.driver == state.driver)
                running = sum(c.running for c in state.cars)
                met["safety car"] += state.track_status == 2
                met["virtual"] += state.track_status == 1
                met["retired rival"] += running < cars
                met["own stop"] += own.just_stopped
                met["leading"] += own.position == 1
                met["last"] += own.position == running
    assert min(met.values()) > 10, met  # each of these happened


def test_bahrain_translates_bit_for_bit(bahrain: RaceRecord) -> None:
    car = bahrain.car_index("HAM")
    environment = RaceEnvironment(bahrain, car, batch=BATCH)
    observer = Observer(bahrain, car)
    for lap, _ in enumerate(decisions(environment, seed=3)):
        if lap % 4 == 0:
            for row in np.flatnonzero(~environment.done):
                raw = observer.row(simulated_state(bahrain, environment.races, int(row), car))
                np.testing.assert_array_equal(raw.view(np.int32), environment.raw[row].view(np.int32))


def test_a_translated_race_that_follows_a_plan_is_the_simulated_race() -> None:
    record = synthetic_race()
    plan = Plan.parse("S-H@5-M@11")
    calls = {4: Action.PIT_HARD, 10: Action.PIT_MEDIUM}
    results = simulate(record, 20, 5, plans={4: plan})
    same = 0
    for number in range(20):
        race: Translator = SimulatedRace(record, 4, 5, number)
        assert isinstance(race, SimulatedRace)
        first = race.state()
        assert first is not None
        if first.cars[4].compound != "S":
            continue  # the simulator chose another starting tyre for the called car than the plan has
        while (state := race.state()) is not None:
            race.apply(UnifiedRaceStrategy(calls.get(state.laps_completed, Action.NO_PIT)))
        if not results.retired[number, 4]:
            assert race.position() == results.positions[number, 4]
            assert race.batch.r[0, at.R_LAP] == record.laps
            same += 1
    assert same > 2


def test_after_the_end_there_is_no_state_and_no_call() -> None:
    record = synthetic_race(laps=6, plans=("S-H@3",))
    race = SimulatedRace(record, 2, 1)
    while race.state() is not None:
        race.apply(UnifiedRaceStrategy(Action.NO_PIT))
    with pytest.raises(RsrlError, match="the race is over for C02"):
        race.apply(UnifiedRaceStrategy(Action.NO_PIT))


def test_a_call_without_a_set_is_refused_by_name() -> None:
    race = SimulatedRace(synthetic_race(sets=(1, 2, 1), plans=("S-H@3",)), 2, 1)
    with pytest.raises(RsrlError, match="C02 has no set of softs left after lap 0"):
        race.apply(UnifiedRaceStrategy(Action.PIT_SOFT))


def test_a_state_of_another_car_is_not_observed() -> None:
    record = synthetic_race()
    state = SimulatedRace(record, 2, 1).state()
    assert state is not None
    with pytest.raises(RsrlError, match="does not belong to C03"):
        Observer(record, 3).row(state)
    assert Observer(record, 2).row(state)[COLUMN["position"]] == 3
