"""Red flags, double stacking, stints' form, track evolution, the passed car's loss, in-lap and out-lap, and the limit on a set."""

import dataclasses

import numpy as np
import pytest
from synthetic_race import PIT, TRACK, quiet, synthetic_race, with_car

from rsrl.errors import RsrlError
from rsrl.season import GREEN, RED, SC
from rsrl.simulator import Plan, RaceBatch, Script, compile_figures, simulate, trace_races
from rsrl.simulator import layout as at
from rsrl.state import Observer, expected_stop_s

SIGMAS = 4.5
GREENS = (GREEN,) * 16


def red_on(lap: int, laps: int = 16) -> tuple[int, ...]:
    return tuple(RED if i == lap else GREEN for i in range(1, laps + 1))


def everyone(text: str, cars: int = 20) -> dict[int, Plan]:
    return dict.fromkeys(range(cars), Plan.parse(text))


def test_the_share_of_safety_cars_becomes_a_red_flag_of_one_lap() -> None:
    record = synthetic_race(laps=30, sc_laps=(0.0, 1.0), red_share=0.3, vsc_per_lap=0.0)
    status = trace_races(record, 1500, 4).track_status
    starts = (status[:, :-1] == GREEN) & (status[:, 1:] != GREEN)
    red = int((starts & (status[:, 1:] == RED)).sum())
    total = int(starts.sum())
    assert abs(red - 0.3 * total) < SIGMAS * np.sqrt(total * 0.21)
    assert (status[:, 1:][status[:, :-1] == RED] == GREEN).all()
    none = trace_races(
        dataclasses.replace(record, incidents=synthetic_race(laps=30, sc_laps=(0.0, 1.0), vsc_per_lap=0.0).incidents), 1500, 4
    )
    same_starts = (none.track_status[:, :-1] == GREEN) & (none.track_status[:, 1:] == SC)
    assert (same_starts[:, 0] == starts[:, 0]).all()  # its own draw: incidents come when they came


def test_a_red_flag_closes_the_field_up_and_costs_a_change_nothing() -> None:
    record = with_car(synthetic_race(**quiet()), 19, pace_s=9.0)  # laps down by then
    plans = {**everyone("M-H@12"), 3: Plan.parse("S-H@12")}
    trace = trace_races(record, 1, 1, script=Script(red_on(12), {}, plans))
    before, after = (np.sort(trace.race_time_s[0, lap]) for lap in (10, 11))
    assert before[-1] - before[0] > TRACK["base_lap_s"]
    np.testing.assert_allclose(np.diff(after), 0.8, atol=2e-3)  # sc_gap_s; nobody lost a second by changing tyres
    np.testing.assert_array_equal(trace.place[0, 10], trace.place[0, 11])
    assert trace.stopped[0, 11].all()
    assert (trace.tyre_age_laps[0, 12] == 1).all()
    results = simulate(record, 1, 1, script=Script(red_on(12), {}, plans))
    assert (results.stops == 1).all()


def test_the_restart_is_a_standing_start_in_the_order_of_the_queue() -> None:
    record = synthetic_race(pace_step_s=0.0, **quiet())
    trace = trace_races(record, 1, 1, script=Script(red_on(5), {}, everyone("M-H@5")))
    lap = np.sort(trace.race_time_s[0, 5]) - trace.race_time_s[0, 4].min()
    np.testing.assert_allclose(np.diff(lap), TRACK["start_per_place_s"], atol=2e-3)
    fuel = TRACK["fuel_start_kg"] * TRACK["fuel_s_per_kg"] * (16 - 6 + 0.5) / 16
    assert lap[0] == pytest.approx(TRACK["base_lap_s"] + fuel + TRACK["start_loss_s"] + 0.4 + 1.2, abs=2e-3)  # hard, cold


def test_the_restart_spreads_the_field_as_a_start_does() -> None:
    record = synthetic_race(cars=1, **quiet(start_sd_s=2.0))
    trace = trace_races(record, 3000, 1, script=Script(red_on(5), {}, everyone("M-H@8", 1)))
    assert trace.lap_time_s[:, 5, 0].std() == pytest.approx(2.0, rel=SIGMAS / np.sqrt(6000))
    assert abs(np.corrcoef(trace.lap_time_s[:, 5, 0], trace.lap_time_s[:, 0, 0])[0, 1]) < SIGMAS / np.sqrt(3000)


@pytest.mark.parametrize(("drs_off_laps", "first"), [(1, 4), (2, 5)])
def test_drs_is_off_after_a_red_flag_for_the_laps_of_the_season_file(drs_off_laps: int, first: int) -> None:
    def race(gain: float) -> np.ndarray:
        figures = quiet(drs_gain_s=gain, pass_threshold_s=50.0, start_per_place_s=0.7)
        record = synthetic_race(pace_step_s=0.0, drs_off_laps=drs_off_laps, **figures)
        return trace_races(record, 1, 1, script=Script(red_on(2), {}, everyone("S-H@14"))).lap_time_s

    differs = (race(0.0) != race(0.4)).any(axis=(0, 2))
    assert int(np.argmax(differs)) + 1 == first  # red on lap 2, restart on lap 3, the first lap without DRS


def test_cars_with_plans_change_under_red_what_is_due_soon_and_the_called_car_what_it_is_told() -> None:
    figures = quiet(sc_lap1=1.0, red_share=1.0, sc_reaction=0.0)
    record = synthetic_race(plans=("M-S@9",), **figures)
    far = Plan((1, 0), (12,), 6, 6)
    batch = RaceBatch(compile_figures(record), 3, outside=(0, 1), plans={5: far})
    batch.start(1, np.arange(3, dtype=np.int64))
    batch.advance()
    assert (batch.r[:, at.R_STATUS] == RED).all()
    batch.actions[:, 1] = 3
    batch.advance()
    assert (batch.k[:, at.K_STOPPED, 1] == 1).all()
    assert (batch.k[:, at.K_USED, 1] >> 2 & 1 == 1).all()  # counts for the two-compound rule
    assert not batch.k[:, at.K_STOPPED, 0].any()
    assert not batch.k[:, at.K_STOPPED, 5].any()  # due on lap 12, its window is 6
    due = synthetic_race(plans=("M-S@9",), **quiet(sc_reaction=0.0))
    assert trace_races(due, 3, 1, script=Script(red_on(4))).stopped[:, 3].all()  # five laps ahead, the window is 6: for certain


def test_a_red_flag_reads_as_a_safety_car_under_which_a_stop_costs_nothing() -> None:
    record = synthetic_race()
    figures = compile_figures(record)
    assert expected_stop_s(figures, 3, RED) == 0.0
    assert Observer(record, 3).context.pit_cost_s.tolist()[2:] == [pytest.approx(expected_stop_s(figures, 3, SC)), 0.0]


def test_team_mates_on_the_same_lap_wait_for_each_other() -> None:
    figures = quiet(pass_threshold_s=50.0, dirty_air_loss_s=0.0, drs_gain_s=0.0, start_per_place_s=0.5)
    alone = synthetic_race(cars=4, pace_step_s=0.0, stack_s=3.0, **figures)
    both = trace_races(alone, 1, 1, plans={**everyone("M-H@8", 4), 2: Plan.parse("M-H@9"), 3: Plan.parse("M-H@10")})
    gap = both.race_time_s[0, 6, 1] - both.race_time_s[0, 6, 0]
    lost = both.lap_time_s[0, 7] - both.lap_time_s[0, 7, 3]
    assert lost[0] == pytest.approx(PIT["loss_green_s"], abs=2e-3)
    assert lost[1] == pytest.approx(PIT["loss_green_s"] + 3.0 - gap, abs=2e-3)  # teams are 0 and 1, 2 and 3
    assert lost[2] == pytest.approx(0.0, abs=2e-3)


def test_the_first_cars_slow_stop_delays_the_second_and_a_large_gap_does_not() -> None:
    luck = quiet(pass_threshold_s=50.0, dirty_air_loss_s=0.0, drs_gain_s=0.0, start_per_place_s=2.0, tail_scale_s=2.0)
    record = synthetic_race(cars=2, pace_step_s=0.0, stack_s=3.0, **luck)
    split = dataclasses.replace(record, cars=(record.cars[0], dataclasses.replace(record.cars[1], team="another")))
    plans = everyone("M-H@8", 2)
    together, apart = (trace_races(r, 200, 1, plans=plans).lap_time_s[:, 7] for r in (record, split))
    excess = (
        apart[:, 0]
        - trace_races(synthetic_race(cars=2, pace_step_s=0.0, **{**luck, "tail_scale_s": 0.0}), 1, 1, plans=plans).lap_time_s[0, 7, 0]
    )
    np.testing.assert_allclose(together[:, 0], apart[:, 0], atol=2e-3)
    np.testing.assert_allclose(together[:, 1] - apart[:, 1], np.maximum(3.0 + excess - 2.0, 0.0), atol=4e-3)
    assert excess.max() > 4.0
    wide = with_car(record, 1, start_gain_s=5.0)
    assert (trace_races(wide, 50, 1, plans=plans).lap_time_s[:, 7, 1].min()) < together[:, 1].min()


def test_a_teams_tail_is_its_own() -> None:
    record = with_car(synthetic_race(cars=2, **quiet(tail_scale_s=0.4)), 1, stop_tail_factor=2.5)
    calm = with_car(synthetic_race(cars=2, **quiet()), 1, stop_tail_factor=2.5)
    figures = compile_figures(record)
    assert expected_stop_s(figures, 1) - 20.0 == pytest.approx(2.5 * (expected_stop_s(figures, 0) - 20.0), rel=1e-5)
    plans = {0: Plan.parse("M-H@8"), 1: Plan.parse("M-H@9")}
    excess = trace_races(record, 500, 1, plans=plans).lap_time_s[:, 8, 1] - trace_races(calm, 1, 1, plans=plans).lap_time_s[0, 8, 1]
    assert np.median(excess) == pytest.approx(2.5 * 0.4, rel=0.15)


def test_every_stint_draws_its_form_and_strategies_share_it() -> None:
    record = synthetic_race(cars=1, **quiet(stint_sd_s=0.6))
    calm = synthetic_race(cars=1, **quiet())
    early, late = ({0: Plan.parse(text)} for text in ("M-S@4-H@9", "M-S@6-H@12"))
    shift = trace_races(record, 2000, 1, plans=early).lap_time_s[:, :, 0] - trace_races(calm, 1, 1, plans=early).lap_time_s[:, :, 0]
    stints = shift[:, [1, 5, 10]]
    for part, laps in ((0, slice(0, 4)), (1, slice(4, 9)), (2, slice(9, 16))):
        np.testing.assert_allclose(shift[:, laps] - stints[:, part : part + 1], 0, atol=2e-3)
        assert stints[:, part].std() == pytest.approx(0.6, rel=SIGMAS / np.sqrt(4000))
    assert np.abs(np.corrcoef(stints.T)[np.triu_indices(3, 1)]).max() < SIGMAS / np.sqrt(2000)
    other = trace_races(record, 2000, 1, plans=late).lap_time_s[:, :, 0] - trace_races(calm, 1, 1, plans=late).lap_time_s[:, :, 0]
    np.testing.assert_allclose(other[:, [1, 7, 13]], stints, atol=2e-3)


def test_the_track_gains_from_start_to_flag() -> None:
    plans = {0: Plan.parse("M-H@8")}
    with_it, without = (trace_races(synthetic_race(cars=1, **quiet(evolution_s=e)), 1, 1, plans=plans) for e in (3.2, 0.0))
    gained = with_it.lap_time_s[0, :, 0] - without.lap_time_s[0, :, 0]
    np.testing.assert_allclose(gained, 3.2 * (1 - np.arange(1, 17) / 16), atol=2e-4)


def test_the_passed_car_loses_its_share_on_that_lap() -> None:
    figures = quiet(start_per_place_s=1.0, drs_gain_s=0.0, dirty_air_loss_s=0.0, passed_loss_s=0.35)
    record = with_car(with_car(synthetic_race(cars=2, plans=("M-S@8",), **figures), 0, pace_s=0.0), 1, pace_s=-0.8)
    trace = trace_races(record, 2000, 1)
    passed = trace.place[:, 1, 1] == 1
    assert 800 < passed.sum() < 1200
    alone = trace.lap_time_s[~passed, 1, 0]
    assert np.ptp(alone) == 0
    np.testing.assert_allclose(trace.lap_time_s[passed, 1, 0] - alone[0], 0.35, atol=1e-4)
    gap = trace.race_time_s[:, 1, 0] - trace.race_time_s[:, 1, 1]
    np.testing.assert_allclose(gap[passed], 0.6 - TRACK["pass_loss_s"] + 0.35, atol=2e-3)


def test_the_loss_shows_on_in_lap_and_out_lap_and_sums_to_the_same_race() -> None:
    split, whole = (synthetic_race(in_lap_share=share) for share in (0.3, 1.0))
    a, b = trace_races(split, 40, 1), trace_races(whole, 40, 1)
    np.testing.assert_array_equal(a.race_time_s, b.race_time_s)
    np.testing.assert_array_equal(a.place, b.place)
    finished = a.running[:, -1]
    np.testing.assert_allclose(a.lap_time_s.sum(axis=1)[finished], b.lap_time_s.sum(axis=1)[finished], atol=5e-3)
    calm = synthetic_race(cars=1, in_lap_share=0.3, **quiet())
    lap = trace_races(calm, 1, 1, plans={0: Plan.parse("M-H@8")}).lap_time_s[0, :, 0]
    full = trace_races(synthetic_race(cars=1, **quiet()), 1, 1, plans={0: Plan.parse("M-H@8")}).lap_time_s[0, :, 0]
    np.testing.assert_allclose((lap - full)[6:10], [0.0, -14.0, 14.0, 0.0], atol=2e-4)


def test_a_called_car_is_boxed_where_its_set_may_run_no_longer() -> None:
    record = synthetic_race(max_laps_per_set=6, sets=(2, 2, 2), plans=("S-H@5-M@10",), **quiet())
    batch = RaceBatch(compile_figures(record), 2, outside=(0,))
    batch.start(1, np.arange(2, dtype=np.int64))
    fitted = [0, 0, 0]
    for lap in range(1, 17):
        batch.advance()
        if (batch.k[0, at.K_STOPPED, 0]) == 1:
            fitted = [lap, *fitted]
            assert batch.k[0, at.K_COMPOUND, 0] == 2  # the hardest spare, and not the soft it started on
    assert fitted[:2] == [12, 6]
    assert (batch.positions()[:, 0] <= 20).all()
    used = batch.k[0, at.K_USED, 0]
    assert used & (used - 1)
    on_hards = synthetic_race(max_laps_per_set=6, sets=(2, 2, 4), plans=("H-S@5-M@10",), **quiet())
    batch = RaceBatch(compile_figures(on_hards), 1, outside=(0,))
    batch.start(1, np.zeros(1, np.int64))
    for _ in range(6):
        batch.advance()
    assert batch.k[0, at.K_COMPOUND, 0] == 1  # the two-compound rule still needs another


def test_a_wet_race_runs_as_if_dry_only_where_asked() -> None:
    wet = dataclasses.replace(synthetic_race(), wet=True)
    with pytest.raises(RsrlError, match="was a wet race"):
        simulate(wet, 5, 1)
    dry = simulate(synthetic_race(), 5, 1)
    np.testing.assert_array_equal(simulate(wet, 5, 1, as_dry=True).positions, dry.positions)
    assert trace_races(wet, 5, 1, as_dry=True).running.any()
