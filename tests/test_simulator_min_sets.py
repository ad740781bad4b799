"""Races in which every car must use three sets, as at Monaco in 2025: legal calls, classification, reward, rivals, `dp`, the planner."""

import dataclasses

import numpy as np
import pytest
from every_call import least_time_s
from reactive_race import reactive
from slow_features import SlowFeatures
from synthetic_race import quiet, synthetic_race

from rsrl.environment import RaceEnvironment
from rsrl.evaluation import run_races
from rsrl.season import GREEN, RaceRecord
from rsrl.simulator import RaceBatch, compile_figures, simulate
from rsrl.simulator import layout as at
from rsrl.state import expectation_table
from rsrl.strategists import DpStrategist, HeuristicStrategist, ImitationStrategist, PlannerStrategist, Strategist
from rsrl.strategists.lookahead.candidates import CandidateStops
from rsrl.strategists.lookahead.clean_air_values import clean_air_values

CAR = 5
PLANS = ("S-H@5-M@10", "M-H@6-S@11", "H-M@5-M@9")


def three_sets(record: RaceRecord) -> RaceRecord:
    return dataclasses.replace(record, min_sets=3)


RECORD = three_sets(synthetic_race(plans=PLANS, retire_per_lap=0.0, retire_lap1=0.0))


def driven(calls: dict[int, int], record: RaceRecord = RECORD, races: int = 12) -> tuple[RaceEnvironment, np.ndarray]:
    """Races called by lap (0 else), and the rewards [laps, races]."""
    environment = RaceEnvironment(record, CAR, batch=races)
    environment.reset(3, np.arange(races, dtype=np.int64))
    rewards = [environment.step(np.full(races, calls.get(lap, 0), np.int8)).reward.copy() for lap in range(1, record.laps + 1)]
    return environment, np.array(rewards)


def test_whoever_owes_as_many_stops_as_laps_are_left_for_them_must_stop() -> None:
    environment = RaceEnvironment(RECORD, CAR, batch=40)
    environment.reset(3, np.arange(40, dtype=np.int64))
    start = environment.races.k[:, at.K_COMPOUND, CAR].copy()
    for lap in range(1, RECORD.laps + 1):
        must = lap in (RECORD.laps - 2, RECORD.laps - 1)
        np.testing.assert_array_equal(environment.legal[:, 0], not must)
        if lap == RECORD.laps - 2:  # the second compound can still wait
            np.testing.assert_array_equal(environment.legal[:, 1:], True)
            environment.step((1 + start).astype(np.int8))
        elif lap == RECORD.laps - 1:
            np.testing.assert_array_equal(environment.legal[:, 1:], np.arange(3) != start[:, None])
            environment.step((1 + (start + 1) % 3).astype(np.int8))
        else:
            environment.step(np.zeros(40, np.int8))
    assert environment.outcome().valid.all()
    assert (environment.outcome().stops == 2).all()


def test_one_stop_made_leaves_one_to_make() -> None:
    environment = RaceEnvironment(RECORD, CAR, batch=8)
    environment.reset(3, np.arange(8, dtype=np.int64))
    start = environment.races.k[:, at.K_COMPOUND, CAR].copy()
    for lap in range(1, RECORD.laps):
        np.testing.assert_array_equal(environment.legal[:, 0], lap < RECORD.laps - 1)
        if lap == RECORD.laps - 1:  # two compounds have been used: any set will do
            sets = environment.races.k[:, at.K_SOFT_SETS : at.K_SOFT_SETS + 3, CAR]
            np.testing.assert_array_equal(environment.legal[:, 1:], sets > 0)
        environment.step((1 + (start + 1) % 3 if lap == 4 else 0 * start).astype(np.int8))


def test_two_sets_are_a_breach_and_a_third_is_no_extra_stop() -> None:
    short, rewards = driven({6: 3})
    start = short.races.k[:, at.K_USED, CAR]
    assert not short.outcome().valid.any()
    assert (short.outcome().position == 20).all(), "behind every car that used three sets"
    assert (rewards[-1] == -1000).all()
    assert ((start & (start - 1)) != 0).any(), "though it used two compounds"
    full, rewards = driven({6: 3, 10: 2})
    assert full.outcome().valid.all()
    assert (rewards[9] == 1).all()
    _, rewards = driven({4: 3, 8: 2, 12: 1})
    assert (rewards[11] == -10).all()


def test_the_same_calls_are_within_the_rules_where_two_sets_do() -> None:
    environment, _ = driven({6: 3}, dataclasses.replace(RECORD, min_sets=2))
    used = environment.races.k[:, at.K_USED, CAR]
    np.testing.assert_array_equal(environment.outcome().valid, (used & (used - 1)) != 0)


@pytest.mark.parametrize("shift", [-20.0, 0.0, 4.0])
@pytest.mark.parametrize("min_sets", [3, 4])
def test_reactive_rivals_use_the_sets_whatever_the_model_says(shift: float, min_sets: int) -> None:
    plans = PLANS if min_sets == 3 else ("S-H@4-M@8-M@12", "M-H@4-S@8-S@12")
    record = dataclasses.replace(reactive(synthetic_race(plans=plans), stops_0=shift, stops_1=shift), min_sets=min_sets)
    batch = RaceBatch(compile_figures(record), 40)
    batch.start(2, np.arange(40, dtype=np.int64))
    for _ in range(record.laps):
        batch.advance()
    used, finished = batch.k[:, at.K_USED], batch.k[:, at.K_PLACE] < batch.r[:, at.R_RUNNING, None]
    assert finished.sum() > 500
    assert (batch.k[:, at.K_STOPS][finished] >= min_sets - 1).all()
    assert ((used & (used - 1)) != 0)[finished].all()
    if shift == -20.0:
        assert (batch.k[:, at.K_STOPS][finished] == min_sets - 1).mean() > 0.9


def test_rivals_on_plans_use_them_too() -> None:
    results = simulate(RECORD, 50, 4, rivals="plans")
    assert (results.stops >= 2).all()


def test_dp_knows_the_best_of_all_plans_on_three_sets() -> None:
    laps, stop_s = 7, 3.0
    steep = {"S": (-1.0, 1.5, 0.3, 0.2), "M": (0.0, 1.0, 0.1, 0.4), "H": (1.0, 0.1, 0.0, 0.9)}
    sets = (2, 1, 2)
    record = three_sets(synthetic_race(laps=laps, sets=sets, plans=("S-H@3-M@5",), tyres=steep, **quiet(loss_green_s=stop_s)))
    cost, cold = SlowFeatures(record, 0, [stop_s] * 3).lap_cost, [t.cold_loss_s.value for t in record.tyres.values()]
    figures = compile_figures(record)
    table, loose = (expectation_table(compile_figures(r), 0) for r in (record, dataclasses.replace(record, min_sets=2)))

    def three_used(left: list[int]) -> bool:
        return sum(left) <= sum(sets) - 3 and sum(n < s for n, s in zip(left, sets, strict=True)) > 1

    dearer = 0
    for start in range(3):
        best = least_time_s(cost, cold, stop_s, sets, start, laps, three_used)
        first = [n - (c == start) for c, n in enumerate(sets)]
        combo = (first[0] * (sets[1] + 1) + first[1]) * (sets[2] + 1) + first[2]
        assert table.value[0, GREEN, combo, start, 0] == pytest.approx(best, abs=2e-3)
        dearer += table.value[0, GREEN, combo, start, 0] > loose.value[0, GREEN, combo, start, 0] + 0.1
    assert dearer, "for some start one stop would be best"
    assert figures.whole[at.I_STOPS_ASKED] == 2


@pytest.mark.parametrize("kind", [DpStrategist, HeuristicStrategist, ImitationStrategist, PlannerStrategist])
def test_strategists_use_three_sets(kind: type[Strategist]) -> None:
    flat = dict.fromkeys("SMH", (0.0, 0.01, 0.0, 0.1))  # tyres that last: nobody would stop twice of his own accord
    record = reactive(three_sets(synthetic_race(plans=PLANS, tyres=flat, retire_per_lap=0.0, retire_lap1=0.0)))
    log = run_races(kind(record, CAR, 0), record, CAR, 3, 12)  # type: ignore[call-arg]
    assert not log.invalid.any()
    assert (log.stops >= 2).all()
    loose = dataclasses.replace(record, min_sets=2)
    assert (run_races(kind(loose, CAR, 0), loose, CAR, 3, 12).stops < 2).any() or kind is ImitationStrategist  # type: ignore[call-arg]


def test_the_planner_does_not_think_of_the_flag_before_the_third_set() -> None:
    figures = compile_figures(RECORD)
    stops = CandidateStops(figures, clean_air_values(figures, CAR), CAR)
    for made in (1, 2):
        every = stops.every_stop(
            lap=8, status=GREEN, compound=2, age=3, used=5, stops_made=made, sets=np.array([1, 2, 1], np.int32), legal=np.ones(4, np.bool_),
            stint_offset_s=0.0,
        )  # fmt: skip
        assert (at.NO_STOP in every.lap) == (made == 2)
