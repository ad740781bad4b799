"""Races that branch: greedy races and branches against the environment, exploration, draws."""

import dataclasses
from typing import Any, NamedTuple

import numpy as np
import pytest
from synthetic_race import synthetic_race, with_car

from rsrl.agents import NetworkAgent, RsrlConfig, make_learner
from rsrl.agents.goals import GOALS
from rsrl.agents.networks import Duelling, Params, greedy_actions
from rsrl.environment import RaceEnvironment
from rsrl.environment.reward import STEP
from rsrl.evaluation import run_races
from rsrl.rollouts import Branches, Branching, BranchingRaces, greedy_positions
from rsrl.season import Figure, RaceRecord
from rsrl.state import Encoder, context_figures, input_names
from rsrl.strategists import PolicyStrategist

CAR, SEED, LAPS = 6, 11, 16
NAMES = input_names("full")
RECORD = synthetic_race(retire_per_lap=0.01)
EVERYTHING = Branching(
    decisions=LAPS, most=1.0, least=1.0, scale=1.0, all_calls=1.0, plan_share=0.0, pit_chance=0.0, delay_chance=0.0
)  # every decision, every call, no experiments
CLOSE = 1e-4  # values nearer than that may be told apart by rounding alone


def random_policy(seed: int, feature_set: str = "full", width: int = 16, **bias: float) -> tuple[Duelling, Params]:
    """Weights large enough to box now and then; `bias` moves the advantage of all stops."""
    rng = np.random.default_rng(seed)
    network = Duelling(len(input_names(feature_set)), width)
    params = {n: v + rng.normal(0, 0.3, np.shape(v)).astype(np.float32) for n, v in network.init(rng).items()}
    params["q.bias"][1:] += np.float32(bias.get("stops", 0.0))
    return network, params


def constant_policy(stay: float, *stops: float) -> Params:
    """Values that do not depend on the race: of staying out, and how much better each stop is."""
    params = Duelling(len(NAMES), 4).init(np.random.default_rng(0))
    return params | {"q.bias": np.array([stay, *stops], np.float32)}


def column(branches: Branches, name: str) -> np.ndarray:
    return branches.features[:, NAMES.index(name)]


def branched(params: Params, branching: Branching = EVERYTHING, *, iteration: int = 0, races: int = 40, threads: int = 2) -> Branches:
    return BranchingRaces([(RECORD, CAR)], threads=threads).branch(params, branching, SEED, iteration, races)


class Driven(NamedTuple):
    """Races called lap by lap through the environment: [laps, races, ...]; positions and whether the car retired [races]."""

    features: np.ndarray
    legal: np.ndarray
    q: np.ndarray
    going: np.ndarray
    reward: np.ndarray
    position: np.ndarray
    retired: np.ndarray


def driven(network: Duelling, params: Params, races: np.ndarray) -> Driven:
    environment = RaceEnvironment(RECORD, CAR, batch=len(races))
    seen: Any = environment.reset(SEED, races)
    rows = []
    while not environment.done.all():
        q, _ = network.step(params, seen.features, None)
        before = (seen.features.copy(), seen.legal.copy(), q, ~environment.done)
        seen = environment.step(greedy_actions(q, seen.legal))
        rows.append((*before, seen.reward.copy()))
    features, legal, q, going, reward = (np.stack(part) for part in zip(*rows, strict=True))
    return Driven(features, legal, q, going, reward, environment.outcome().position, environment.outcome().retired)


@pytest.mark.parametrize("feature_set", ["full", "named"])
@pytest.mark.parametrize("stops", [-2.0, 0.0])
def test_greedy_races_end_as_those_called_one_by_one(feature_set: str, stops: float) -> None:
    network, params = random_policy(5, feature_set, stops=stops)
    agent = NetworkAgent("rsrl", feature_set, input_names(feature_set), True, network, params)
    log = run_races(PolicyStrategist(agent, RECORD), RECORD, CAR, SEED, 400)
    positions = greedy_positions(RECORD, CAR, params, feature_set, SEED, np.arange(400))
    assert (positions != log.position).sum() <= 4, "all but calls that rounding decides"
    assert log.stops.mean() > 1
    assert log.retired.any()
    assert len(np.unique(positions)) > 10


def test_a_greedy_race_of_bahrain_is_the_environments(bahrain: RaceRecord) -> None:
    car = bahrain.car_index("HAM")
    network, params = random_policy(2, stops=-1.0)
    agent = NetworkAgent("rsrl", "full", NAMES, True, network, params)
    log = run_races(PolicyStrategist(agent, bahrain), bahrain, car, SEED, 100)
    positions = greedy_positions(bahrain, car, params, "full", SEED, np.arange(100))
    assert (positions != log.position).sum() <= 1


def test_decisions_are_those_of_the_environment_and_the_best_call_changes_nothing() -> None:
    """No experiments and every decision branched: rows are the laps of the undisturbed races, one race after the other."""
    network, params = random_policy(5, stops=-1.0)
    races = np.arange(80, 120)
    plain, branches = driven(network, params, races), branched(params, iteration=2)
    positions = greedy_positions(RECORD, CAR, params, "full", SEED, races)
    np.testing.assert_array_equal(positions, plain.position)
    row = decided = extra = 0
    for race in range(len(races)):
        for lap in range(LAPS):
            legal, q = plain.legal[lap, race], plain.q[lap, race]
            if not plain.going[lap, race] or legal.sum() < 2:
                continue  # nothing to decide
            np.testing.assert_array_equal(branches.features[row].view(np.int32), plain.features[lap, race].view(np.int32))
            np.testing.assert_array_equal(branches.legal[row], legal)
            np.testing.assert_array_equal(np.isfinite(branches.positions[row]), legal)
            best = np.where(legal, q, -np.inf)
            assert branches.positions[row, best.argmax()] == positions[race] or np.ptp(np.sort(best)[-2:]) < CLOSE
            decided += len(set(branches.positions[row, legal])) > 1
            if not plain.retired[race]:
                own = np.array([branches.positions[row, best.argmax()]]), np.array([branches.extra_stops[row, best.argmax()]])
                paid = GOALS["paper-reward"].scores(*own)[0] * GOALS["paper-reward"].place + (LAPS - lap - 1) * STEP
                assert plain.reward[lap:, race].sum() == pytest.approx(paid) or np.ptp(np.sort(best)[-2:]) < CLOSE
                extra += int(own[1][0])
            row += 1
    assert row == len(branches.features) > 500
    assert decided > 100, "calls must matter"
    assert extra > 20, "and stops that no rule asks for must be counted"


def test_the_calls_tried_are_staying_the_best_stop_and_the_two_best_ones() -> None:
    network, params = random_policy(8)
    branches = branched(params, dataclasses.replace(EVERYTHING, all_calls=0.0))
    q, _ = network.step(params, branches.features, None)
    q = np.where(branches.legal, q, -np.inf)
    np.testing.assert_array_equal(np.isfinite(branches.positions) & ~branches.legal, False)
    order = np.argsort(-q, axis=1)
    for row in np.flatnonzero((np.diff(np.sort(np.where(np.isfinite(q), q, -1e3), axis=1), axis=1) > CLOSE).all(axis=1)):
        best, other = order[row, :2]
        expected = {best, other, best if best > 0 else other} | ({0} if branches.legal[row, 0] else set())
        assert set(np.flatnonzero(np.isfinite(branches.positions[row]))) == expected
    tried = np.isfinite(branches.positions).sum(axis=1)
    assert set(tried) == {2, 3}
    assert not branches.legal[:, 1:].all(axis=0).any()
    shares = [np.isfinite(branched(params, dataclasses.replace(EVERYTHING, all_calls=s)).positions).sum() for s in (0.0, 0.3, 1.0)]
    assert shares[0] < shares[1] < shares[2]


@pytest.mark.parametrize("gap", [0.0, 0.5, 100.0])
def test_decisions_are_branched_the_oftener_the_closer_the_calls(gap: float) -> None:
    """Staying out is ahead by a constant gap, until the last laps, where the rule for two compounds decides."""
    params = constant_policy(0.0, -gap, -gap - 1, -gap - 2)
    some, every = (
        branched(params, dataclasses.replace(EVERYTHING, most=most, least=least, scale=0.5, all_calls=0.0), races=400)
        for most, least in ((0.8, 0.1), (1.0, 1.0))
    )
    made, could = ((column(branches, "race_progress") < 0.8).sum() for branches in (some, every))
    expected = 0.1 + 0.7 * np.exp(-gap / 0.5)
    assert made / could == pytest.approx(expected, abs=5 * (expected * (1 - expected) / could) ** 0.5)


def test_no_race_has_more_decisions_than_asked_for() -> None:
    params = constant_policy(0.0, -1.0, -1.0, -1.0)
    branches = branched(params, dataclasses.replace(EVERYTHING, decisions=3))
    laps_left = np.round(column(branches, "laps_left") * 80).astype(int)
    assert set(laps_left) == {16, 15, 14}
    assert (laps_left == 16).sum() == 40
    assert len(branched(params, dataclasses.replace(EVERYTHING, most=0.0, least=0.0)).features) == 0


def stops_by_lap(params: Params, **experiments: Any) -> dict[int, np.ndarray]:
    """Stops made so far by laps done, of 200 races in which every decision is branched."""
    branches = branched(params, dataclasses.replace(EVERYTHING, all_calls=0.0, **experiments), races=200)
    laps = np.round(column(branches, "race_progress") * LAPS).astype(int)
    made = np.round(column(branches, "stops_made") * 4).astype(int)
    return {lap: made[laps == lap] for lap in range(LAPS - 1)}


STAY, BOX = constant_policy(0.0, -1.0, -1.0, -1.0), constant_policy(0.0, 1.0, 1.0, 1.0)


def test_experiments_on_the_way() -> None:
    assert stops_by_lap(STAY)[10].max() == 0
    assert stops_by_lap(BOX)[2].min() == 2
    assert stops_by_lap(STAY, pit_chance=1.0)[4].min() == 4, "boxes lap after lap, with what tyres there are"
    assert stops_by_lap(BOX, delay_chance=1.0)[13].max() == 0, "stays out where it would box"
    some = stops_by_lap(STAY, pit_chance=0.1)[10]
    assert some.mean() == pytest.approx(10 * 0.1, abs=0.35)
    late = stops_by_lap(BOX, delay_chance=0.75)[4]
    assert late.mean() == pytest.approx(4 * 0.25, abs=0.25)


def test_planned_races_stop_at_random_until_a_random_lap() -> None:
    """Twice a race while it lasts; until, drawn from 1 to 16, is beyond lap n with a chance of (16 - n)/16."""
    made = stops_by_lap(STAY, plan_share=1.0)
    for lap in (4, 8, 13):
        expected = sum(2 / LAPS * (LAPS - n) / LAPS for n in range(1, lap + 1))
        assert made[lap].mean() == pytest.approx(expected, abs=0.3), lap
    assert 0.25 < (made[13] == 0).mean() < 0.65
    half = stops_by_lap(STAY, plan_share=0.5)[13]
    assert 0.3 < half.mean() / made[13].mean() < 0.7


def test_experiments_leave_the_luck_of_the_races_alone() -> None:
    """The first decision of a race is met before anything was tried, and its branches are run without experiments."""
    _, params = random_policy(5, stops=-1.0)
    plain = branched(params)
    wild = branched(params, dataclasses.replace(EVERYTHING, plan_share=0.3, pit_chance=0.3, delay_chance=0.5))
    starts = [column(b, "race_progress") == 0 for b in (plain, wild)]
    assert starts[0].sum() == starts[1].sum() == 40
    np.testing.assert_array_equal(plain.features[starts[0]], wild.features[starts[1]])
    np.testing.assert_array_equal(plain.positions[starts[0]], wild.positions[starts[1]])
    assert not np.array_equal(plain.features, wild.features)


def same(one: Branches, two: Branches) -> bool:
    return all(np.array_equal(a, b, equal_nan=a.dtype != np.bool_) for a, b in zip(one, two, strict=True))


def uncertain(record: RaceRecord) -> RaceRecord:
    """The record with a loss in the pits that is known to 2 s."""
    pit = dataclasses.replace(record.pit, loss_green_s=Figure(20.0, 2.0, 9))
    return dataclasses.replace(record, pit=pit)


MIXED = Branching(decisions=4, most=0.6, least=0.2, scale=0.5, all_calls=0.5, plan_share=0.3, pit_chance=0.1, delay_chance=0.3)


@pytest.mark.parametrize("uncertainty", [0.0, 1.0])
def test_the_number_of_threads_changes_no_bit(uncertainty: float) -> None:
    entries = [(uncertain(RECORD), 3), (uncertain(synthetic_race(pace_step_s=0.02)), 11)]
    _, params = random_policy(5)
    runs = [
        BranchingRaces(entries, uncertainty=uncertainty, contests=5, threads=threads).branch(params, MIXED, 3, 7, 50)
        for threads in (1, 2, 3)
    ]
    assert same(runs[0], runs[1])
    assert same(runs[0], runs[2])
    assert len(runs[0].features) > 80


def test_draws_are_a_function_of_seed_and_iteration() -> None:
    _, params = random_policy(5)
    races = BranchingRaces([(uncertain(RECORD), CAR)], uncertainty=1.0, contests=3)
    first, again, later, other = (races.branch(params, MIXED, seed, k, 24) for seed, k in ((1, 0), (1, 0), (1, 1), (2, 0)))
    assert same(first, again)
    losses = [set(np.round(column(b, "pit_loss_s"), 5)) for b in (first, later, other)]
    assert [len(values) for values in losses] == [3, 3, 3]
    assert len(losses[0] | losses[1] | losses[2]) == 9
    assert same(BranchingRaces([(uncertain(RECORD), CAR)], uncertainty=1.0, contests=3).branch(params, MIXED, 1, 1, 24), later)
    wide = BranchingRaces([(uncertain(RECORD), CAR)], uncertainty=3.0, contests=16).branch(params, MIXED, 1, 0, 64)
    narrow = BranchingRaces([(uncertain(RECORD), CAR)], uncertainty=0.5, contests=16).branch(params, MIXED, 1, 0, 64)
    assert column(wide, "pit_loss_s").std() > 2 * column(narrow, "pit_loss_s").std()


def test_without_uncertainty_the_figures_are_the_records_own() -> None:
    entries = [(uncertain(RECORD), 3), (uncertain(RECORD), 11), (with_car(RECORD, 5, pace_s=-1.0), 5)]
    _, params = random_policy(5)
    races = BranchingRaces(entries, contests=2)
    known = {tuple(encoded_figures(record, car)) for record, car in entries}
    found: set[tuple[float, ...]] = set()
    for iteration in range(12):
        figures = races.branch(params, MIXED, 1, iteration, 8).features[:, -len(context_figures(RECORD, 0)) :]
        drawn = {tuple(row) for row in figures}
        assert 1 <= len(drawn) <= 2
        found |= drawn
    assert found == known, "every entry gets its turn"


def encoded_figures(record: RaceRecord, car: int) -> np.ndarray:
    environment = RaceEnvironment(record, car)
    features = environment.reset(0, np.zeros(1, np.int64)).features[0]
    return features[-len(context_figures(record, car)) :]


def test_every_race_of_every_iteration_is_another() -> None:
    races = BranchingRaces([(RECORD, CAR)], threads=2)
    first = dataclasses.replace(EVERYTHING, decisions=LAPS)
    rows = [races.branch(STAY, first, SEED, iteration, 30).features for iteration in range(3)]
    ends = [r[np.round(r[:, NAMES.index("race_progress")] * LAPS) == 8] for r in rows]
    together = np.concatenate(ends)
    assert len(np.unique(together, axis=0)) == len(together) > 60


def test_it_says_what_a_learner_needs_to_know() -> None:
    full, paper = BranchingRaces([(RECORD, CAR)]), BranchingRaces([(RECORD, CAR)], feature_set="paper")
    assert (full.feature_set, full.feature_names, full.n_features) == ("full", NAMES, len(NAMES))
    assert full.expected_scale_s == 10.0
    assert paper.expected_scale_s == 0.0
    encoder = Encoder("full", RECORD.scaling)
    raw = np.zeros((2, encoder.rows[:, 0].max() + 1), np.float32)
    stay = encoder.rows[[f.name for f in encoder.features].index("expected_stay_s"), 0]
    raw[1, stay] = 1.0
    first, second = encoder(raw)[:, NAMES.index("expected_stay_s")]
    assert (second - first) * full.expected_scale_s == pytest.approx(1.0)


@pytest.mark.slow
def test_the_learner_betters_itself_on_the_real_race() -> None:
    config = RsrlConfig(width=16, races=128, minibatch=128, decisions=8, expected_weight=0.0, learning_rate=5e-3)
    learner = make_learner(config, BranchingRaces([(RECORD, CAR)], threads=2), 0)
    races = np.arange(1000)

    def mean_position() -> float:
        return float(greedy_positions(RECORD, CAR, learner.agent().params, "full", SEED, races).mean())

    before = mean_position()
    for k in range(15):
        learner.advance(k / 15)
    assert mean_position() < before - 0.5
