"""The vectorised environment: legality, ends of races, rows that go on alone, and agreement with the simulator."""

import numpy as np
import pytest
from numpy.typing import NDArray
from synthetic_race import quiet, synthetic_race

from rsrl.environment import RaceEnvironment
from rsrl.season import RaceRecord
from rsrl.simulator import Plan, simulate
from rsrl.simulator import layout as at
from rsrl.state import FEATURE_SETS, FIGURES

BATCH = 64


def started(record: RaceRecord, car: int = 5, batch: int = BATCH, seed: int = 3) -> RaceEnvironment:
    environment = RaceEnvironment(record, car, batch=batch)
    environment.reset(seed, np.arange(batch, dtype=np.int64))
    return environment


def random_calls(environment: RaceEnvironment, rng: np.random.Generator, box: float) -> NDArray[np.int8]:
    """Legal calls; boxes with a chance where it may."""
    legal = environment.legal
    choice = np.where(legal, rng.random(legal.shape), -1.0)
    choice[:, 0] += np.where(legal[:, 0] & (rng.random(len(legal)) > box), 2.0, 0.0)
    return choice.argmax(axis=1).astype(np.int8)


@pytest.mark.parametrize("limit", [0, 6])
@pytest.mark.parametrize("box", [0.0, 0.1, 0.6, 1.0])
def test_legal_calls_never_lead_to_an_invalid_finish(limit: int, box: float) -> None:
    plans = ("S-H@5-S@10", "M-H@6-S@11") if limit else ("S-H@6", "M-H@8")
    record = synthetic_race(max_laps_per_set=limit, plans=plans, sets=(2, 1, 3))
    environment = started(record)
    rng = np.random.default_rng(1)
    for lap in range(1, record.laps + 1):
        k = environment.races.k
        live = ~environment.done
        assert environment.legal.any(axis=1).all()
        for code in range(3):
            assert not environment.legal[live & (k[:, at.K_SOFT_SETS + code, 5] == 0), 1 + code].any()
        if lap == record.laps:
            assert (environment.legal[live] == [True, False, False, False]).all()
        if limit:
            assert (k[live, at.K_AGE, 5] < limit).all()  # the coming lap is always one the set may run
        environment.step(random_calls(environment, rng, box))
        assert (k[:, at.K_SOFT_SETS : at.K_SOFT_SETS + 3] >= 0).all()
    outcome = environment.outcome()
    assert environment.done.all()
    assert (outcome.valid | outcome.retired).all()
    assert not outcome.failed.any()
    assert (outcome.position >= 1).all()


def test_the_last_chance_for_a_second_compound_is_taken() -> None:
    record = synthetic_race(plans=("M-S@5",), **quiet())
    environment = started(record, batch=1)
    for lap in range(1, record.laps):
        expected = [True, True, True, True] if lap < record.laps - 1 else [False, True, False, True]
        assert environment.legal[0].tolist() == expected, lap
        environment.step(np.zeros(1, np.int8) if lap < record.laps - 1 else np.ones(1, np.int8))
    assert environment.legal[0].tolist() == [True, False, False, False]


def test_a_race_that_is_over_stays_as_it_is() -> None:
    environment = started(synthetic_race(retire_per_lap=0.05))
    rng = np.random.default_rng(2)
    ended_early = 0
    for _ in range(16):
        before = environment.done.copy()
        raw, features = environment.raw.copy(), environment.encoder(environment.raw)
        state = environment.races.f.copy()
        t = environment.step(random_calls(environment, rng, 0.2))
        assert (t.reward[before] == 0).all()
        assert t.terminated[before].all()
        np.testing.assert_array_equal(environment.raw[before], raw[before])
        np.testing.assert_array_equal(t.features[before], features[before])
        np.testing.assert_array_equal(environment.races.f[before], state[before])
        ended_early += before.sum()
    assert ended_early > 50
    assert environment.outcome().retired.any()


def test_rows_can_start_anew_while_others_go_on() -> None:
    record = synthetic_race()
    whole = started(record, batch=8)
    part = started(record, batch=8)
    stay = np.zeros(8, np.int8)
    for _ in range(5):
        whole.step(stay)
        part.step(stay)
    rows = np.array([6, 2], np.int64)
    part.reset_rows(3, np.array([40, 41], np.int64), rows)
    fresh = RaceEnvironment(record, 5, batch=2)
    fresh.reset(3, np.array([40, 41], np.int64))
    others = np.setdiff1d(np.arange(8), rows)
    for _ in range(6):
        np.testing.assert_array_equal(part.raw[others], whole.raw[others])
        np.testing.assert_array_equal(part.raw[rows], fresh.raw)
        np.testing.assert_array_equal(part.legal[rows], fresh.legal)
        for environment in (whole, part, fresh):
            environment.step(stay[: environment.batch])


def test_a_batch_of_any_size_runs_the_same_races() -> None:
    record = synthetic_race()
    big = started(record, batch=30)
    small = [RaceEnvironment(record, 5, batch=1) for _ in range(30)]
    for number, environment in enumerate(small):
        environment.reset(3, np.array([number], np.int64))
    for lap in range(10):
        calls = np.where(big.legal[:, 1] & (lap == 4), 1, 0).astype(np.int8)
        t = big.step(calls)
        for number, environment in enumerate(small):
            one = environment.step(calls[number : number + 1])
            np.testing.assert_array_equal(one.features[0], t.features[number])
            assert (one.reward[0], one.terminated[0]) == (t.reward[number], t.terminated[number])


def test_following_a_plan_ends_where_the_simulator_says() -> None:
    """Also for a car that retires: its place on that lap is the one it is classified in at the flag."""
    record = synthetic_race(plans=("M-S@9", "M-H@8"), retire_per_lap=0.02)
    plan = Plan.parse("M-S@7-H@12")
    environment = started(record, batch=200)
    calls = dict(zip(plan.laps, (1, 3), strict=True))
    for lap in range(1, record.laps + 1):
        environment.step(np.full(200, calls.get(lap, 0), np.int8))
    results = simulate(record, 200, 3, plans={5: plan})
    outcome = environment.outcome()
    np.testing.assert_array_equal(outcome.position, results.positions[:, 5])
    np.testing.assert_array_equal(outcome.retired, results.retired[:, 5])
    np.testing.assert_array_equal(outcome.stops, results.stops[:, 5])
    assert outcome.retired.sum() > 20


def test_other_cars_can_be_given_plans() -> None:
    record = synthetic_race(plans=("M-S@9",), **quiet())
    environment = RaceEnvironment(record, 5, plans={0: Plan.parse("H-M@5")})
    environment.reset(1, np.zeros(1, np.int64))
    for _ in range(6):
        environment.step(np.zeros(1, np.int8))
    assert environment.races.k[0, at.K_STOPS, :20].tolist() == [1] + [0] * 19
    assert environment.races.k[0, at.K_COMPOUND, :2].tolist() == [1, 1]


def test_features_of_bahrain_stay_in_range(bahrain: RaceRecord) -> None:
    for name in FEATURE_SETS:
        environment = RaceEnvironment(bahrain, bahrain.car_index("HAM"), batch=64, feature_set=name)
        o = environment.reset(1, np.arange(64, dtype=np.int64))
        low = np.array([f.low for f in environment.encoder.features for _ in range(f.width)])
        rng = np.random.default_rng(1)
        spread = np.zeros(environment.n_features)
        for _ in range(environment.laps):
            features = environment.step(random_calls(environment, rng, 0.06)).features
            assert np.isfinite(features).all()
            assert (features >= low).all()
            assert (features <= 1).all()
            spread = np.maximum(spread, np.abs(features - o.features[:1]).max(axis=0))
        constant = {n for n, s in zip(environment.feature_names, spread, strict=True) if s == 0}
        assert all(n.startswith("track=") or n in {f.name for f in FIGURES} for n in constant), constant
