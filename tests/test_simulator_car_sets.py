"""Sets of each car, and laps that a set has run before the race: wear, age, legality, rivals, and every way to plan on them."""

import itertools

import numpy as np
import pytest
from synthetic_race import quiet, synthetic_race

from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.evaluation import run_races
from rsrl.explanation import moment_from_state
from rsrl.rollouts import CostToGo
from rsrl.rollouts.expected_laps import add_stop
from rsrl.season import COMPOUNDS, GREEN, RaceRecord, assume
from rsrl.simulator import Plan, RaceBatch, check_plan, compile_figures, simulate, simulate_plans, trace_races
from rsrl.simulator import layout as at
from rsrl.state import Observer, expectation_table, expected_calls_of_rows
from rsrl.strategists import DpStrategist
from rsrl.strategists.lookahead.candidates import CandidateStops
from rsrl.strategists.lookahead.clean_air_values import clean_air_values
from rsrl.strategists.plan_search.clean_air import CleanAir
from rsrl.strategists.plan_search.planned import published_by_start
from rsrl.translators import SimulatedRace

STEEP = {"S": (-1.0, 0.5, 0.1, 0.2), "M": (0.0, 0.4, 0.05, 0.4), "H": (0.6, 0.3, 0.0, 0.9)}
ALONE = synthetic_race(cars=1, laps=12, plans=("S-H@6", "M-H@8"), tyres=STEEP, sets=(2, 1, 2), **quiet(loss_green_s=4.0))
USED = assume(ALONE, "sets.C00=S1u2S1u5M1H1H1u3")


def every_plan(record: RaceRecord, start: int, most_stops: int) -> list[Plan]:
    plans = []
    for stops in range(1, most_stops + 1):
        for rest in itertools.product(range(3), repeat=stops):
            for laps in itertools.combinations(range(1, record.laps), stops):
                try:
                    check_plan(plan := Plan((start, *rest), laps), record, 0)
                except RsrlError:
                    continue
                plans.append(plan)
    return plans


def lap_cost(compound: int, age: int) -> float:
    offset, linear, quadratic, _ = STEEP[COMPOUNDS[compound]]
    return offset + linear * age + quadratic * age**2


def test_new_sets_of_ones_own_change_nothing() -> None:
    record = synthetic_race()
    own = assume(record, "sets.all=S2M2H2")
    assert own.cars[0].sets == {"S": (0, 0), "M": (0, 0), "H": (0, 0)}
    one, other = (simulate(r, 200, 3) for r in (record, own))
    np.testing.assert_array_equal(one.positions, other.positions)
    np.testing.assert_array_equal(one.race_time_s, other.race_time_s)


def test_each_car_has_its_own_sets() -> None:
    record = assume(synthetic_race(), ["sets.C03=S1M1u2M1H4", "sets.C05=S0M1H1"])
    batch = RaceBatch(compile_figures(record), 50, outside=(3, 5))
    batch.start(1, np.arange(50, dtype=np.int64))
    left = batch.k[:, at.K_SOFT_SETS : at.K_SOFT_SETS + 3, :20]
    fitted = (batch.k[:, at.K_COMPOUND, :20][:, None] == np.arange(3)[None, :, None]).astype(int)
    at_start = left + fitted
    assert (at_start[:, :, 3] == (1, 2, 4)).all()
    assert (at_start[:, :, 5] == (0, 1, 1)).all()
    assert (np.delete(at_start, (3, 5), axis=2) == 2).all()
    assert set(batch.k[:, at.K_COMPOUND, 5]) == {1, 2}, "no plan is drawn that it lacks the sets for"
    assert set(batch.k[:, at.K_COMPOUND, 4]) == {0, 1, 2}


def test_a_plan_is_checked_against_the_cars_own_sets() -> None:
    record = assume(synthetic_race(), "sets.C03=S3M1H1")
    plan = Plan.parse("S-S@4-S@9-H@12")
    check_plan(plan, record, 3)
    simulate(record, 1, 1, plans={3: plan})
    for car in (None, 2):
        with pytest.raises(RsrlError, match=r"needs 3 sets of S, .* has 2"):
            check_plan(plan, record, car)
    with pytest.raises(RsrlError, match=r"needs 2 sets of H, C03 has 1 at bahrain-2099; if there were more, say --sets C03=S3M1H2$"):
        simulate(record, 1, 1, plans={3: Plan.parse("H-S@4-H@9")})


def test_rivals_keep_to_their_sets() -> None:
    record = assume(synthetic_race(plans=("S-H@6", "S-M@5-S@11", "M-H@8")), "sets.C05=S1M1H1")
    trace = trace_races(record, 300, 4, rivals="plans")
    for car, most in ((5, 1), (6, 2)):
        fresh = np.concatenate([np.ones((300, 1), bool), trace.stopped[:, :-1, car]], axis=1) & trace.running[:, :, car]
        assert ((trace.compound[:, :, car] == 0) & fresh).sum(axis=1).max() == most
    lacking = assume(synthetic_race(plans=("S-H@6", "M-S@8-S@12")), "sets.C05=S1M1H0")
    with pytest.raises(RsrlError, match="rivals with plans: car 6 on the grid has the sets for none"):
        simulate(lacking, 1, 1, rivals="plans")
    simulate(lacking, 1, 1, rivals="plans", plans={5: Plan.parse("S-M@8")})
    called = RaceBatch(compile_figures(lacking), 30, outside=(5,))
    called.start(1, np.arange(30, dtype=np.int64))
    assert set(called.k[:, at.K_COMPOUND, 5]) == {0, 1}, "it starts as teams did"
    nothing = assume(synthetic_race(plans=("S-H@6", "M-H@8")), "sets.C05=S1M0H1")
    with pytest.raises(RsrlError, match="C05 has no set of a tyre that any team started on"):
        compile_figures(assume(nothing, "sets.S=0"))


def test_the_freshest_set_is_fitted_first_and_its_age_goes_on() -> None:
    trace = trace_races(USED, 1, 1, plans={0: Plan.parse("S-H@3-S@5-H@9")})
    assert trace.tyre_age_laps[0, :, 0].tolist() == [3, 4, 5, 1, 2, 6, 7, 8, 9, 4, 5, 6]
    plan = Plan.parse("S-H@3-S@5-H@9")
    used, new = (trace_races(r, 1, 1, plans={0: plan}).lap_time_s[0, :, 0] for r in (USED, ALONE))
    ages, compounds = trace.tyre_age_laps[0, :, 0] - 1, trace.compound[0, :, 0]
    worn = [lap_cost(c, a) for c, a in zip(compounds, ages, strict=True)]
    fresh = [lap_cost(c, a) for c, a in zip(compounds, [0, 1, 2, 0, 1, 0, 1, 2, 3, 0, 1, 2], strict=True)]
    np.testing.assert_allclose(used - new, np.array(worn) - np.array(fresh), atol=2e-4)


def test_a_used_set_is_not_changed_at_once_under_a_safety_car() -> None:
    """The rule is about laps since the stop, not about the age of the set."""
    record = synthetic_race(cars=1, plans=("S-H@8",), sc_laps=(0.0, 0.0, 0.0, 1.0), **quiet(sc_lap1=1.0))
    plan = Plan((0, 2, 1), (1, 6), sc_window_laps=5)
    for own in (record, assume(record, "sets.C00=S1M1H1u9")):
        trace = trace_races(own, 1, 1, plans={0: plan})
        assert trace.track_status[0, 1:5].tolist() == [2] * 4
        assert (np.flatnonzero(trace.stopped[0, :, 0]) + 1).tolist() == [1, 4], "two laps on the set, then at once"


def test_clean_air_times_are_those_of_the_race() -> None:
    plans = [plan for plan in every_plan(USED, 0, 3) if max(plan.laps) < 11][::7]
    _, times_s = simulate_plans(compile_figures(USED), 0, plans, 1, np.zeros(1, np.int64))
    clean_air = CleanAir(USED, 0)
    own = np.array([clean_air.time_s(plan) for plan in plans])
    np.testing.assert_allclose(times_s[:, 0] - times_s[0, 0], own - own[0], atol=0.02)
    best = min((float(f.time_s.min()), f.compounds) for f in clean_air.families((0, 1, 2)))
    assert best[0] == pytest.approx(min(clean_air.time_s(p) for start in range(3) for p in every_plan(USED, start, 3)))


def test_dp_drives_the_quickest_of_all_plans() -> None:
    log = run_races(DpStrategist(USED, 0, 0), USED, 0, 3, 8)
    assert {0, 1} == set(log.start.tolist())
    for i in range(8):
        plans = every_plan(USED, int(log.start[i]), 3)
        _, times_s = simulate_plans(compile_figures(USED), 0, plans, 3, log.races[i : i + 1])
        compounds, laps = log.stints(i)
        assert times_s[plans.index(Plan(compounds, laps)), 0] - times_s.min() < 0.01


def test_the_expected_time_counts_the_laps_of_the_set_to_come() -> None:
    """One lap from a stop, two from the flag: what a call for soft costs is worked out by hand."""
    record = assume(ALONE, "sets.C00=S1S1u4M1H1u3")
    out = np.zeros((2, 4), np.float32)
    lap, status, compound = (np.array([v, v], np.int32) for v in (10, GREEN, 2))
    left = np.array([[2, 1, 0], [1, 1, 0]], np.int32)
    table = expectation_table(compile_figures(record), 0)
    expected_calls_of_rows(table, lap, status, left, compound, np.full(2, 3.0, np.float32), np.array([4, 5], np.int32), out)
    cold = STEEP["S"][3]
    for row, age in enumerate((0, 4)):
        by_hand = lap_cost(2, 3) + 4.0 + cold + lap_cost(0, age)
        assert out[row, 1] == pytest.approx(by_hand, abs=1e-3)
    assert out[1, 1] - out[0, 1] == pytest.approx(lap_cost(0, 4) - lap_cost(0, 0), abs=1e-3)


def foresight(record: RaceRecord) -> tuple[CostToGo, CandidateStops]:
    figures = compile_figures(record)
    values = clean_air_values(figures, 0)
    return values, CandidateStops(figures, values, 0)


def test_the_planner_counts_the_laps_of_the_set_to_come() -> None:
    values, stops = foresight(assume(ALONE, "sets.C00=S1S1u4M1H1u3"))
    plain, _ = foresight(ALONE)
    np.testing.assert_array_equal(values.new[11, 1, 0, 0], plain.new[11, 1, 0, 0])
    assert values.new[11, 1, 0, 1] - values.new[11, 1, 0, 0] == pytest.approx(lap_cost(0, 4) - lap_cost(0, 0), abs=1e-3)
    assert values.new[11, 1, 2, 0] == pytest.approx(values.value[11, 1, 2, 3].mean() + STEEP["H"][3], abs=1e-3)
    costs = []
    for left in (2, 1):
        every = stops.every_stop(
            lap=11, status=GREEN, compound=1, age=6, used=3, stops_made=1, sets=np.array([left, 0, 0], np.int32),
            legal=np.ones(4, np.bool_), stint_offset_s=0.0,
        )  # fmt: skip
        costs.append(float(every.cost_s[every.lap == 11][0] - every.cost_s[every.lap == at.NO_STOP][0]))
    assert costs[1] - costs[0] == pytest.approx(lap_cost(0, 4) - lap_cost(0, 0), abs=1e-3)


def test_published_plans_beyond_the_cars_sets_are_left_out() -> None:
    record = assume(synthetic_race(plans=("S-H@6", "S-M@5-S@11", "M-H@8")), "sets.C05=S1M1H1")
    assert [[str(p) for p in plans] for plans in published_by_start(record, 5)[:2]] == [["S-H@6"], ["M-H@8"]]
    assert [str(p) for p in published_by_start(record, 6)[0]] == ["S-H@6", "S-M@5-S@11"]


def test_calls_for_a_compound_that_a_car_lacks_are_not_legal() -> None:
    record = assume(synthetic_race(), "sets.C05=S0M1H1")
    environment = RaceEnvironment(record, 5, batch=20)
    environment.reset(1, np.arange(20, dtype=np.int64))
    assert not environment.legal[:, 1].any()
    other = RaceEnvironment(record, 6, batch=20)
    other.reset(1, np.arange(20, dtype=np.int64))
    assert other.legal[:, 1].all()


def test_a_moment_from_a_state_knows_the_laps_before_the_race() -> None:
    record = assume(synthetic_race(), "sets.C05=S1u3M1u2H1u4")
    race = SimulatedRace(record, 5, 3)
    for lap in range(6):
        state = race.state()
        assert state is not None
        moment, batch = moment_from_state(record, 5, state), race.batch
        own = (at.K_COMPOUND, at.K_AGE, at.K_BEFORE, at.K_SOFT_SETS, at.K_SOFT_SETS + 1, at.K_SOFT_SETS + 2)
        np.testing.assert_array_equal(moment.arrays[1][own, 5], batch.k[0, own, 5])
        batch.actions[0, 5] = 3 if lap == 3 and batch.k[0, at.K_SOFT_SETS + 2, 5] > 0 else 0
        batch.advance()


def test_a_stop_at_expected_pace_fits_the_freshest_set() -> None:
    record = assume(synthetic_race(plans=("M-H@8",)), "sets.C05=S1u3M1u2H1u4H1u6")
    batch = RaceBatch(compile_figures(record), 1, outside=(5,))
    batch.start(3, np.zeros(1, np.int64))
    f, k, r, context = batch.f[0], batch.k[0], batch.r[0], Observer(record, 5).context
    for age, left in ((4, 1), (6, 0)):
        add_stop(batch.figures, context, f, k, r, 5, np.int32(2), np.int32(GREEN))
        assert (k[at.K_AGE, 5], k[at.K_BEFORE, 5], f[at.F_WEAR, 5], k[at.K_SOFT_SETS + 2, 5]) == (age, age, age, left)
