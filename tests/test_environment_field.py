"""Any car observed as the called one is; rivals called by a policy; races that run on other figures than believed."""

import dataclasses

import numpy as np
import pytest
from synthetic_race import figure, synthetic_race

from rsrl.agents import NetworkAgent
from rsrl.agents.networks import NETWORKS
from rsrl.environment import FieldEnvironment, FieldObserver, RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.evaluation import PolicyField, run_in, self_play
from rsrl.season import RaceRecord
from rsrl.simulator import layout as at
from rsrl.state import COLUMN, input_names
from rsrl.strategists import PolicyStrategist, make_strategist

RACES = np.arange(6, dtype=np.int64)


def agent(masked: bool = True, kind: str = "lstm") -> NetworkAgent:
    names = input_names("full")
    network = NETWORKS[kind](len(names), 8)
    return NetworkAgent("rsrl", "full", names, masked, network, network.init(np.random.default_rng(3)))


class Recorder:
    """Calls all rivals in on given laps, and remembers what it was shown."""

    def __init__(self, laps: tuple[int, ...] = ()) -> None:
        self.laps, self.lap = laps, 0
        self.shown: list[tuple[np.ndarray, np.ndarray]] = []

    def begin(self, cars: int, batch: int, rows: np.ndarray) -> None:
        self.lap = 0

    def decide(self, raw: np.ndarray, legal: np.ndarray) -> np.ndarray:
        self.lap += 1
        self.shown.append((raw.copy(), legal.copy()))
        hardest = 3 - legal[..., ::-1][..., :3].argmax(axis=-1)
        return np.where((self.lap in self.laps) & legal[..., 1:].any(axis=-1), hardest, 0).astype(np.int8)


@pytest.fixture(scope="module")
def record() -> RaceRecord:
    return synthetic_race()


def test_a_car_is_observed_as_its_own_environment_would(record: RaceRecord) -> None:
    own = RaceEnvironment(record, 7, batch=6)
    field = FieldObserver(record, (3, 7, 12), 6)
    own.reset(5, RACES)
    for lap in range(10):
        field.observe(own.races)
        going = ~own.done
        np.testing.assert_array_equal(field.raw[1][going], own.raw[going])
        np.testing.assert_array_equal(field.legal[1][going], own.legal[going])
        np.testing.assert_array_equal(field.raw[0][:, COLUMN["position"]], own.races.k[:, 1, 3] + 1)
        own.step(np.where(own.legal[:, 3] & (lap == 5), 3, 0).astype(np.int8))


def test_rivals_do_as_they_are_called(record: RaceRecord) -> None:
    caller = Recorder((4, 9))
    environment = FieldEnvironment(record, 5, batch=6, caller=caller)
    environment.reset(1, RACES)
    for lap in range(1, 11):
        before = environment.races.k[:, at.K_STOPS].copy()
        running = environment.races.k[:, 1] < environment.races.r[:, 4:5]
        environment.step(np.zeros(6, np.int8))
        made = environment.races.k[:, at.K_STOPS] - before
        others = running & (environment.races.k[:, 1] < environment.races.r[:, 4:5])
        others[:, 5] = False
        others[environment.done] = False
        if lap in caller.laps:
            assert (made[others] == 1).all()
        elif not (environment.races.r[:, 15] > 0).any():
            assert (made[others] == 0).all()
    assert caller.shown[0][0].shape[:2] == (19, 6)


def test_figures_that_are_not_as_believed_change_the_race_and_not_the_belief(record: RaceRecord) -> None:
    true = dataclasses.replace(record, pit=dataclasses.replace(record.pit, loss_green_s=figure(30.0)))
    environment = FieldEnvironment(true, 5, batch=6, believed=record)
    plain, honest = RaceEnvironment(record, 5, batch=6), RaceEnvironment(true, 5, batch=6)
    cost = COLUMN["pit_cost_s"]
    observation = environment.reset(2, RACES)
    np.testing.assert_array_equal(observation.features, plain.reset(2, RACES).features)
    honest.reset(2, RACES)
    assert environment.record == record
    for _ in range(8):
        calls = np.where(environment.legal[:, 3] & (environment.raw[:, COLUMN["tyre_age_laps"]] == 4), 3, 0).astype(np.int8)
        environment.step(calls)
        honest.step(calls)
    np.testing.assert_array_equal(environment.races.f, honest.races.f)
    np.testing.assert_array_equal(environment.outcome().position, honest.outcome().position)
    green = environment.raw[:, COLUMN["safety_car"]] == 0
    assert green.any()
    assert (honest.raw[green, cost] - environment.raw[green, cost]).min() == pytest.approx(10.0, abs=1e-4)


def test_another_way_of_rivals_gives_another_race(record: RaceRecord) -> None:
    with pytest.raises(RsrlError, match=r"no rivals\.hazard"):
        RaceEnvironment(record, 5, rivals="reactive")
    assert RaceEnvironment(record, 5, rivals="plans").races.callers[0] == -1


def test_the_policy_against_itself(record: RaceRecord) -> None:
    policy, other = PolicyStrategist(agent(), record, "policy"), make_strategist("heuristic", record, 5)
    told: list[tuple[int, int]] = []
    logs = self_play(agent(), [policy, other], record, 5, 3, 20, progress=lambda done, total: told.append((done, total)))
    assert [log.strategist for log in logs] == ["policy", "heuristic"]
    assert told == [(1, 2), (2, 2)]
    np.testing.assert_array_equal(logs[0].start, logs[1].start)
    again = self_play(agent(), [policy], record, 5, 3, 20)[0]
    np.testing.assert_array_equal(again.position, logs[0].position)
    naive = run_in(RaceEnvironment(record, 5, batch=20), policy, 3, 20)
    assert (naive.position != logs[0].position).any()


@pytest.mark.parametrize("kind", ["lstm", "feed-forward"])
def test_all_cars_of_a_race_called_alike_fill_all_places_once(record: RaceRecord, kind: str) -> None:
    """The called car's calls are those the field would make for it: seen from any car, the race is the same race."""
    policy = agent(kind=kind)
    places = np.array([self_play(policy, [PolicyStrategist(policy, record, "x")], record, car, 3, 8)[0].position for car in range(20)])
    for race in range(8):
        assert sorted(places[:, race]) == list(range(1, 21))


def test_memory_of_races_begun_anew_is_emptied(record: RaceRecord) -> None:
    field = PolicyField(agent(), record)
    field.begin(2, 3, np.arange(3))
    raw = np.random.default_rng(0).random((2, 3, len(COLUMN)), np.float32)
    legal = np.ones((2, 3, 4), np.bool_)
    field.decide(raw, legal)
    filled = field._memory.copy()
    field.begin(2, 3, np.array([1]))
    assert (field._memory[:, 1] == 0).all()
    np.testing.assert_array_equal(field._memory[:, [0, 2]], filled[:, [0, 2]])


def test_a_rival_s_call_is_always_legal(record: RaceRecord) -> None:
    field = PolicyField(agent(masked=False), record)
    field.begin(1, 4, np.arange(4))
    legal = np.eye(4, dtype=np.bool_)[None]
    calls = field.decide(np.zeros((1, 4, len(COLUMN)), np.float32), legal)
    np.testing.assert_array_equal(calls, [[0, 1, 2, 3]])
