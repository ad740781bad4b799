"""The plan search: every legal plan, the known optimum of a race without luck, and honest figures."""

import dataclasses
from itertools import combinations, product
from typing import Any

import numpy as np
import pytest

from rsrl.errors import RsrlError
from rsrl.season import Figure, RaceRecord
from rsrl.simulator import Plan, check_plan, compile_figures, simulate_plans
from rsrl.strategists import CleanAir, pit_windows, search_plans
from rsrl.strategists.plan_search.best_plan import start_budgets
from rsrl.strategists.plan_search.neighbours import SC_WINDOWS, VSC_WINDOWS, grid_of_plans, is_legal, neighbours
from rsrl.strategists.plan_search.pit_windows import cheap_offsets

CAR, BUDGET = 6, 4000


def shortened(record: RaceRecord, laps: int, rival_plan: str, max_laps_per_set: int = 0) -> RaceRecord:
    """The race over another distance, all rivals on one plan."""
    plans = (dataclasses.replace(record.rivals.plans[0], plan=rival_plan),)
    rivals = dataclasses.replace(record.rivals, plans=plans, jitter_sd_laps=Figure(0.0, 0.0, 1))
    return dataclasses.replace(record, laps=laps, rivals=rivals, max_laps_per_set=max_laps_per_set)


def without_luck(record: RaceRecord) -> RaceRecord:
    """A race of 24 laps with nothing random in it, cars that pass at will and quick stops, all equal."""
    zero, at_will = Figure(0.0, 0.0, 1), Figure(-100.0, 0.0, 1)
    zeros = (
        "lap_noise_sd_s", "start_sd_s", "start_per_place_s", "drs_gain_s", "dirty_air_loss_s", "following_gap_s", "pass_loss_s",
        "blue_flag_loss_s", "lapping_loss_s", "stint_sd_s", "passed_loss_s",
    )  # fmt: skip
    at_zero: dict[str, Any] = dict.fromkeys(zeros, zero)
    track = dataclasses.replace(record.track, pass_threshold_s=at_will, pass_per_gap=None, **at_zero)
    pit = dataclasses.replace(record.pit, loss_green_s=Figure(6.0, 0, 1), tail_scale_s=Figure(1e-6, 0, 1), stack_s=zero)
    incidents = dataclasses.replace(record.incidents, sc_lap1=zero, sc_per_lap=zero, vsc_per_lap=zero)
    cars = tuple(
        dataclasses.replace(car, pace_s=zero, form_sd_s=zero, retire_per_lap=zero, retire_lap1=zero, stop_loss_s=zero, start_gain_s=zero)
        for car in record.cars
    )
    short = shortened(record, 24, "S-H@9-H@17")
    rivals = dataclasses.replace(short.rivals, hazard={}, choice={})  # they keep to their plans
    return dataclasses.replace(short, track=track, pit=pit, incidents=incidents, cars=cars, rivals=rivals)


def one_place_a_step(record: RaceRecord, best_s: float, step_s: float) -> RaceRecord:
    """Rivals paced to finish just behind a race time of `best_s`, then `step_s` apart: slower plans lose place after place."""
    rival_s = CleanAir(record, 0).time_s(Plan.parse("S-H@9-H@17"))
    cars, place = list(record.cars), 0
    for i, car in enumerate(record.cars):
        if i != CAR:
            pace_s = (best_s + 0.02 + step_s * place - rival_s) / record.laps
            cars[i], place = dataclasses.replace(car, pace_s=Figure(pace_s, 0.0, 1)), place + 1
    return dataclasses.replace(record, cars=tuple(cars))


def all_plans(record: RaceRecord) -> list[Plan]:
    """Every legal plan of 1 to 3 stops, the slow way."""
    plans = []
    for stops in (1, 2, 3):
        for compounds in product(range(3), repeat=stops + 1):
            plans += [Plan(compounds, laps) for laps in combinations(range(1, record.laps), stops)]
    return [plan for plan in plans if is_legal(plan, record, CAR)]


def test_families_hold_every_legal_plan_once_with_its_time(bahrain: RaceRecord) -> None:
    record = shortened(bahrain, 14, "S-H@7")
    clean_air = CleanAir(record, CAR)
    listed = {
        Plan(family.compounds, tuple(laps.tolist())): time_s
        for family in clean_air.families((0, 1, 2))
        for laps, time_s in zip(family.laps, family.time_s, strict=True)
    }
    expected = all_plans(record)
    assert set(listed) == set(expected)
    assert sum(len(family.laps) for family in clean_air.families((0, 1, 2))) == len(expected)
    for plan in expected[::50]:
        assert clean_air.time_s(plan) == pytest.approx(listed[plan])


def test_families_keep_to_the_laps_a_set_may_run(bahrain: RaceRecord) -> None:
    record = shortened(bahrain, 20, "S-H@7-H@14", 8)
    families = CleanAir(record, CAR).families((0,))
    assert min(len(family.compounds) for family in families) == 3, "two sets do not last 20 laps"
    for family in families:
        check_plan(Plan(family.compounds, tuple(family.laps[0].tolist())), record)
        check_plan(Plan(family.compounds, tuple(family.laps[-1].tolist())), record)


def test_families_use_the_sets_that_the_rules_ask_for(bahrain: RaceRecord) -> None:
    record = dataclasses.replace(shortened(bahrain, 20, "S-H@7-H@14"), min_sets=3)
    families = CleanAir(record, CAR).families((0, 1, 2), 2)
    assert {len(family.compounds) for family in families} == {3}


def test_clean_air_time_is_the_simulator_s_on_an_empty_track(bahrain: RaceRecord) -> None:
    record = without_luck(bahrain)
    record = dataclasses.replace(record, cars=record.cars[:1])
    plans = [Plan.parse(text) for text in ("S-H@9", "S-H@9-H@17", "M-S@5-S@12-H@20", "H-M@12")]
    _, times = simulate_plans(compile_figures(record), 0, plans, 3, np.arange(2, dtype=np.int64))
    expected = np.array([CleanAir(record, 0).time_s(plan) for plan in plans])
    np.testing.assert_allclose(times[:, 0] - times[0, 0], expected - expected[0], atol=0.02)


@pytest.mark.parametrize("start", [None, 0, 1])
def test_search_finds_the_known_optimum(bahrain: RaceRecord, start: int | None) -> None:
    record = without_luck(bahrain)
    clean_air = CleanAir(record, CAR)
    times = {plan: clean_air.time_s(plan) for plan in all_plans(record) if start is None or plan.compounds[0] == start}
    best_s = min(times.values())
    record = one_place_a_step(record, best_s, 0.3)
    optimal = {plan for plan, time_s in times.items() if time_s < best_s + 0.02}  # ahead of every rival
    search = search_plans(record, CAR, start, budget=BUDGET)
    assert search.best in optimal
    assert search.legal_plans == len(times)
    places = {entry.plan: entry.mean_position for entry in search.ranked}
    for plan, place in places.items():
        assert place == 1 + np.ceil((times[plan] - best_s - 0.02) / 0.3), "a place for every step behind"


def test_search_repeats_bit_for_bit_and_ranks_what_it_says(bahrain: RaceRecord) -> None:
    calls: list[tuple[int, int]] = []
    search = search_plans(bahrain, CAR, 0, seed=5, budget=BUDGET, sc_rule=True, progress=lambda done, total: calls.append((done, total)))
    assert calls == sorted(calls)
    assert calls[-1][0] <= calls[-1][1] == BUDGET
    means = [entry.mean_position for entry in search.ranked]
    assert means == sorted(means)
    assert search.ranked[0].behind_best == 0
    assert search.ranked[0].behind_best_ci95 == (0, 0)
    assert sum(entry.p_best for entry in search.ranked) == pytest.approx(1)
    assert sum(entry.p_best for entry in search.by_compounds) == pytest.approx(1)
    assert len({entry.plan.compounds for entry in search.by_compounds}) == len(search.by_compounds) > 3
    for entry in search.ranked:
        check_plan(entry.plan, bahrain)
        assert entry.plan.compounds[0] == 0
        assert entry.position_ci95[0] < entry.mean_position < entry.position_ci95[1]
    assert search.best.sc_window_laps > 0
    again = search_plans(dataclasses.replace(bahrain), CAR, 0, seed=5, budget=BUDGET, sc_rule=True)
    assert again.ranked == search.ranked


def test_a_search_that_can_find_nothing_is_refused(bahrain: RaceRecord) -> None:
    with pytest.raises(RsrlError, match="a plan search on 10 races finds nothing"):
        search_plans(bahrain, CAR, budget=10)
    with pytest.raises(RsrlError, match="no legal plan of 1 to 3 stops starts on soft"):
        search_plans(shortened(bahrain, 57, "S-H@12-H@24-S@36-M@48", 12), CAR, 0, budget=BUDGET)


def test_grid_keeps_the_quickest_and_stays_within_reach(bahrain: RaceRecord) -> None:
    families = CleanAir(bahrain, CAR).families((0,))
    plans = grid_of_plans(families, 5.0, 100)
    assert 50 < len(plans) <= 100
    clean_air = CleanAir(bahrain, CAR)
    times = [clean_air.time_s(plan) for plan in plans]
    assert times[0] == pytest.approx(min(family.time_s.min() for family in families))
    assert times == sorted(times)
    assert times[-1] <= times[0] + 5.0


def test_neighbours_are_legal_and_one_move_away(bahrain: RaceRecord) -> None:
    plan = dataclasses.replace(Plan.parse("S-H@14-H@36"), sc_window_laps=SC_WINDOWS[1], vsc_window_laps=VSC_WINDOWS[-1])
    found = {(p.laps, p.sc_window_laps, p.vsc_window_laps) for p in neighbours(plan, bahrain, CAR, 2, True)} - {((14, 36), 3, 20)}
    assert {laps for laps, _, _ in found} == {(12, 36), (16, 36), (14, 34), (14, 38), (12, 34), (16, 38), (14, 36)}
    assert {(sc, vsc) for laps, sc, vsc in found if laps == (14, 36)} == {(0, 20), (6, 20), (3, 16)}
    assert {p.laps for p in neighbours(Plan.parse("S-H@1"), bahrain, CAR, 1, False)} == {(2,)}


def test_pit_window_is_where_the_smoothed_cost_is_low() -> None:
    offsets = np.array([0, -10, -8, -6, -4, -2, 2, 4, 6, 8, 10])
    assert cheap_offsets(offsets, 7 + 0.005 * offsets**2.0) == (-3, 3)
    assert cheap_offsets(offsets, 7 + 0.0001 * offsets**2.0) == (-10, 10)
    assert cheap_offsets(offsets, 7 - 0.02 * offsets) == (-2, 10)
    assert cheap_offsets(np.array([0, 2]), np.array([7.0, 7.0])) == (0, 0)


def test_pit_windows_hold_the_planned_laps(bahrain: RaceRecord) -> None:
    plans = [Plan.parse("S-H@14-H@36"), Plan.parse("S-H@2")]
    windows = pit_windows(bahrain, CAR, plans, races=60)
    assert [len(w) for w in windows] == [2, 1]
    for plan, stops in zip(plans, windows, strict=True):
        assert all(max(1, lap - 10) <= first <= lap <= last <= lap + 10 for lap, (first, last) in zip(plan.laps, stops, strict=True))


def test_pit_windows_are_those_of_the_places_lost(bahrain: RaceRecord) -> None:
    """Without luck the places that a moved stop loses are known, so the window is too."""
    record = without_luck(bahrain)
    clean_air, plan = CleanAir(record, CAR), Plan.parse("S-H@8-H@16")
    best_s = clean_air.time_s(plan)
    record = one_place_a_step(record, best_s, 1.0)
    ((first, last), _) = pit_windows(record, CAR, [plan], races=10)[0]
    offsets = np.array([0, -6, -4, -2, 2, 4, 6])  # two laps apart, as many as leave a lap between the stops
    times = [clean_air.time_s(Plan(plan.compounds, (8 + int(o), 16))) for o in offsets]
    places = 1 + np.ceil((np.array(times) - best_s - 0.02) / 1.0)
    assert (first - 8, last - 8) == cheap_offsets(offsets, places)
    assert last - first < 8, "narrower than what was tried"


def test_budget_goes_to_the_tyres_teams_start_on(bahrain: RaceRecord) -> None:
    budgets = start_budgets(bahrain, 10_000)
    assert budgets[0] == 10_000
    assert sorted(budgets) == [0, 1, 2]
    assert all(300 < budgets[start] < 10_000 for start in (1, 2))
