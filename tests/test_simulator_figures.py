"""What goes into a race comes out of it: lap times by hand, frequencies of incidents, stops, passing; and common random numbers."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from synthetic_race import PIT, TRACK, TYRES, quiet, synthetic_race, with_car

from rsrl.errors import RsrlError
from rsrl.season import COMPOUNDS, GREEN, SC, VSC, RaceRecord
from rsrl.simulator import Plan, compile_figures, simulate, trace_races
from rsrl.state import expected_stop_s

SIGMAS = 4.5
ALWAYS_3_LAPS = (0.0, 0.0, 1.0)


def lap_times_by_hand(record: RaceRecord, plan: Plan, status: list[int]) -> NDArray[np.float64]:
    """Lap times of a car alone on the track without luck."""
    caution = {VSC: (1.35, 0.5, PIT["loss_vsc_s"]), SC: (1.5, 0.25, PIT["loss_sc_s"])}
    times, wear, cold, stops = [], 0.0, 0.0, dict(zip(plan.laps, plan.compounds[1:], strict=True))
    compound = plan.compounds[0]
    for lap in range(1, record.laps + 1):
        offset, linear, quadratic, _ = TYRES[COMPOUNDS[compound]]
        if status[lap - 1] == GREEN:
            fuel_kg = TRACK["fuel_start_kg"] * (record.laps - lap + 0.5) / record.laps
            time = TRACK["base_lap_s"] + fuel_kg * TRACK["fuel_s_per_kg"] + record.cars[0].pace_s.value + cold
            time += offset + linear * wear + quadratic * wear**2 + (TRACK["start_loss_s"] if lap == 1 else 0.0)
            ageing, loss = 1.0, PIT["loss_green_s"]
        else:
            factor, ageing, loss = caution[status[lap - 1]]
            time = TRACK["base_lap_s"] * factor
        wear, cold = wear + ageing, 0.0
        if lap in stops:
            time += loss + record.cars[0].stop_loss_s.value
            compound, wear = stops[lap], 0.0
            cold = TYRES[COMPOUNDS[compound]][3]
        times.append(time)
    return np.array(times)


@pytest.mark.parametrize("text", ["M-S@8", "S-H@3", "H-S@2-M@4-H@9"])
@pytest.mark.parametrize(
    ("incidents", "status"),
    [
        ({}, [GREEN] * 16),
        ({"sc_lap1": 1.0}, [GREEN, SC, SC, SC, *[GREEN] * 12]),
        ({"vsc_per_lap": 1.0}, ([GREEN, VSC, VSC, VSC] * 4)[:16]),
    ],
)
def test_lap_times_of_a_car_alone_are_those_worked_out_by_hand(text: str, incidents: dict[str, float], status: list[int]) -> None:
    figures = quiet(stop_loss_s=0.7, **incidents)
    record = synthetic_race(cars=1, sc_laps=ALWAYS_3_LAPS, vsc_laps=ALWAYS_3_LAPS, **figures)
    plan = Plan.parse(text)
    trace = trace_races(record, 1, 3, plans={0: plan})
    assert trace.track_status[0].tolist() == status
    by_hand = lap_times_by_hand(record, plan, status)
    np.testing.assert_allclose(trace.lap_time_s[0, :, 0], by_hand, atol=2e-4)
    np.testing.assert_allclose(trace.race_time_s[0, :, 0], np.cumsum(by_hand), atol=0.02)


def within(count: int, trials: int, share: float) -> bool:
    return bool(abs(count - trials * share) <= SIGMAS * np.sqrt(trials * share * (1 - share)) + 1e-9)


def test_safety_cars_come_as_often_and_last_as_long_as_the_figures_say() -> None:
    record = synthetic_race(laps=30)
    status = trace_races(record, 1500, 4).track_status
    green = status[:, :-1] == GREEN
    starts = {code: green & (status[:, 1:] == code) for code in (SC, VSC)}
    after_caution = np.zeros_like(green)
    after_caution[:, 1:] = status[:, :-2] != GREEN
    assert within(int(starts[SC][:, 0].sum()), 1500, 0.2)
    assert within(int(starts[SC][:, 1:].sum()), int(green[:, 1:].sum()), 0.04)
    assert within(int(starts[VSC].sum()), int(green.sum()), 0.03)
    assert within(int((starts[SC] & after_caution).sum()), int((green & after_caution).sum()), 0.04)
    for code, shares in ((SC, record.incidents.sc_laps), (VSC, record.incidents.vsc_laps)):
        early = np.argwhere(starts[code][:, :20])
        lengths = np.array([np.argmax(status[race, lap + 1 :] != code) for race, lap in early])
        for n, share in enumerate(shares, 1):
            assert within(int((lengths == n).sum()), len(lengths), share)


def test_cars_retire_with_their_hazard() -> None:
    record = with_car(synthetic_race(retire_per_lap=0.02, retire_lap1=0.06, cars=10), 3, retire_per_lap=0.1, retire_lap1=0.02)
    running = trace_races(record, 1500, 4).running
    for lap in range(16):
        assert within(int(running[:, lap, 3].sum()), 1500, 0.98 * 0.9**lap)
        others = np.delete(running[:, lap, :10], 3, axis=1)
        assert within(int(others.sum()), 1500 * 9, 0.94 * 0.98**lap)


def test_stops_cost_the_figure_and_a_heavy_tail() -> None:
    slow, quick = (synthetic_race(cars=1, **quiet(tail_scale_s=scale)) for scale in (0.4, 0.0))
    plans = {0: Plan.parse("M-S@8")}
    extra = trace_races(slow, 4000, 4, plans=plans).lap_time_s[:, 7, 0] - trace_races(quick, 4000, 4, plans=plans).lap_time_s[:, 7, 0]
    for u in (0.1, 0.25, 0.5, 0.75, 0.9):
        assert within(int((extra < 0.4 * (u / (1 - u)) ** (1 / 3)).sum()), 4000, u)
    assert extra.min() >= 0
    expected = expected_stop_s(compile_figures(slow), 0) - PIT["loss_green_s"]
    assert abs(extra.mean() - expected) < SIGMAS * extra.std() / np.sqrt(4000)


def test_noise_form_and_start_have_their_spread() -> None:
    record = synthetic_race(cars=1, **quiet(lap_noise_sd_s=0.4, noise_factor=1.5, form_sd_s=0.7, start_sd_s=2.0))
    calm = trace_races(synthetic_race(cars=1, **quiet()), 1, 1, plans={0: Plan.parse("M-S@8")}).lap_time_s[0, :, 0]
    extra = trace_races(record, 3000, 1, plans={0: Plan.parse("M-S@8")}).lap_time_s[:, :, 0] - calm
    tolerance = SIGMAS / np.sqrt(2 * 3000)
    assert np.diff(extra[:, 1:], axis=1).std() / np.sqrt(2) == pytest.approx(0.6, rel=tolerance)
    assert extra[:, 1:].mean(axis=1).std() == pytest.approx(np.sqrt(0.7**2 + 0.6**2 / 15), rel=tolerance)
    assert extra[:, 0].std() == pytest.approx(np.sqrt(0.7**2 + 0.6**2 + 2.0**2), rel=tolerance)
    assert np.abs(extra.mean(axis=0)).max() < SIGMAS * 2.3 / np.sqrt(3000)


def test_half_the_attempts_succeed_at_the_threshold() -> None:
    figures = quiet(start_per_place_s=1.0, drs_gain_s=0.0, dirty_air_loss_s=0.0, stop_loss_s=0.0)
    record = with_car(with_car(synthetic_race(cars=2, plans=("M-S@8",), **figures), 0, pace_s=0.0), 1, pace_s=-0.8)
    trace = trace_races(record, 2000, 1)
    assert (trace.place[:, 0, 1] == 2).all()  # 1 s behind on the grid, 0.2 s after lap 1
    passed = trace.place[:, 1, 1] == 1
    assert within(int(passed.sum()), 2000, 0.5)
    gap = trace.race_time_s[:, 1, 1] - trace.race_time_s[:, 1, 0]
    np.testing.assert_allclose(gap[~passed], TRACK["following_gap_s"], atol=1e-3)
    np.testing.assert_allclose(gap[passed], 0.2 - 0.8 + TRACK["pass_loss_s"], atol=1e-3)


def test_rivals_draw_plans_and_react_to_a_safety_car_as_often_as_teams_did() -> None:
    trace = trace_races(synthetic_race(**quiet()), 300, 2)
    start = trace.compound[:, 0]
    assert within(int((start == 2).sum()), 300 * 20, 3 / 15)  # weights of the plans are 1 to 5: H-M@10 has 3
    assert within(int((start == 0).sum()), 300 * 20, 5 / 15)
    record = synthetic_race(plans=("M-S@9",), sc_laps=(0.0, 0.0, 0.0, 1.0), **quiet(sc_lap1=1.0))  # behind it on laps 2 to 5
    trace = trace_races(record, 300, 2)
    early = trace.stopped[:, 2:5].any(axis=1)
    assert within(int(early.sum()), 300 * 20, 0.7)
    assert (trace.stopped[:, 8] == ~early).all()
    own = trace_races(record, 20, 2, plans={4: Plan((1, 0), (9,), 6, 0), 5: Plan((1, 0), (9,))})
    assert own.stopped[:, 2, 4].all()  # one's own plan reacts for certain, as soon as the tyres have two laps,
    assert own.stopped[:, 8, 5].all()  # or never


def test_another_strategy_of_one_car_leaves_everyone_elses_luck_alone() -> None:
    free: dict[str, Any] = {  # no car ever meets another, and no queue behind a safety car
        "drs_gain_s": 0.0, "dirty_air_loss_s": 0.0, "following_gap_s": 0.0, "pass_threshold_s": -1000.0, "pass_loss_s": 0.0,
        "blue_flag_loss_s": 0.0, "lapping_loss_s": 0.0, "sc_lap1": 0.0, "sc_per_lap": 0.0,
    }  # fmt: skip
    record = synthetic_race(retire_per_lap=0.02, **free)
    one, other = (trace_races(record, 60, 8, plans={5: Plan.parse(text)}) for text in ("S-H@5", "M-S@3-H@9-M@12"))
    rest = np.arange(20) != 5
    on = one.running[:, :, rest]
    np.testing.assert_array_equal(one.track_status, other.track_status)
    np.testing.assert_array_equal(one.running, other.running)
    np.testing.assert_array_equal(one.stopped[:, :, rest][on], other.stopped[:, :, rest][on])
    np.testing.assert_array_equal(one.lap_time_s[:, :, rest][on], other.lap_time_s[:, :, rest][on])
    assert (one.lap_time_s[:, :, 5] != other.lap_time_s[:, :, 5]).any()


def test_another_strategy_leaves_incidents_alone_in_full_races(bahrain: RaceRecord) -> None:
    one, other = (simulate(bahrain, 500, 8, plans={5: Plan.parse(text)}) for text in ("S-H@14-H@36", "M-H@20"))
    np.testing.assert_array_equal(one.slow_laps, other.slow_laps)
    np.testing.assert_array_equal(one.retired, other.retired)
    assert one.slow_laps.any(axis=0).all()
    assert (one.positions != other.positions).any()


def test_no_races_and_wet_races_are_refused() -> None:
    record = synthetic_race()
    with pytest.raises(RsrlError, match="races is 0"):
        simulate(record, 0, 1)
    with pytest.raises(RsrlError, match="was a wet race"):
        simulate(dataclasses.replace(record, wet=True), 1, 1)
