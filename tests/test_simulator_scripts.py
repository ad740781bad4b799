"""A replayed race does what its script says and nothing else; averages by lap are those of the traced races."""

import dataclasses

import numpy as np
import pytest
from synthetic_race import quiet, synthetic_race

from rsrl.errors import RsrlError
from rsrl.season import GREEN, RED, SC, VSC
from rsrl.simulator import Plan, Script, lap_means, simulate, trace_races

RECORD = synthetic_race(max_laps_per_set=9, plans=("S-H@8",))
STATUS = (GREEN, GREEN, SC, SC, GREEN, RED, GREEN, GREEN, VSC, GREEN, GREEN, GREEN, RED, SC, GREEN, GREEN)
# more softs than a car has, one compound only, a set beyond the limit, eight stops: history, so nobody minds
PLANS = {
    0: Plan.parse("S-S@1-S@2-S@3-S@4-S@9-S@10-S@11-S@15"),
    1: Plan.parse("M"),
    2: Plan.parse("H-M@6"),
    **{car: Plan.parse("M-H@13") for car in range(3, 20)},
}
RETIRE = {4: 1, 7: 6, 9: 16, 11: 14}
SCRIPT = Script(STATUS, RETIRE, PLANS)


def test_a_replay_has_the_stops_statuses_and_retirements_of_its_script() -> None:
    trace = trace_races(RECORD, 30, 1, script=SCRIPT)
    assert (trace.track_status == np.array(STATUS)).all()
    for car in range(20):
        out = RETIRE.get(car, 99)
        assert (trace.running[:, :, car] == (np.arange(1, 17) < out)).all()
        stops = [lap for lap in PLANS[car].laps if lap < out]
        assert (trace.stopped[:, :, car] == np.isin(np.arange(1, 17), stops)).all()
        stints = np.searchsorted(PLANS[car].laps, np.arange(1, min(out, 17)))
        fitted = np.array(PLANS[car].compounds)[stints]
        assert (trace.compound[:, : len(fitted), car] == fitted).all()


def test_a_replay_is_classified_as_it_came_in() -> None:
    results = simulate(RECORD, 30, 1, script=SCRIPT)
    trace = trace_races(RECORD, 30, 1, script=SCRIPT)
    finished = trace.running[:, -1]
    np.testing.assert_array_equal(results.positions[finished], trace.place[:, -1][finished])
    assert (results.positions[:, 1] < 16).all()  # on one compound to the flag
    np.testing.assert_array_equal(results.stops[:, 0], 8)
    np.testing.assert_array_equal(results.retired.sum(axis=1), len(RETIRE))
    np.testing.assert_array_equal(results.slow_laps, [[3, 1]] * 30)


def test_a_disqualified_car_races_as_it_did_and_is_classified_last() -> None:
    taken = dataclasses.replace(SCRIPT, disqualified={0, 12})
    before, after = (simulate(RECORD, 30, 1, script=script) for script in (SCRIPT, taken))
    np.testing.assert_array_equal(before.race_time_s, after.race_time_s)
    first, second = before.positions[:, 0], before.positions[:, 12]
    np.testing.assert_array_equal(np.sort(after.positions[:, [0, 12]]), np.array([[19, 20]] * 30))
    np.testing.assert_array_equal(after.positions[:, 0] < after.positions[:, 12], first < second)
    others = [car for car in range(20) if car not in (0, 12)]
    moved = before.positions[:, others] - (before.positions[:, others] > first[:, None]) - (before.positions[:, others] > second[:, None])
    np.testing.assert_array_equal(after.positions[:, others], moved)


def test_a_race_may_begin_behind_a_safety_car_or_be_stopped_on_its_first_lap() -> None:
    for first in (SC, VSC, RED):
        script = Script((first, *[GREEN] * 15), {}, dict.fromkeys(range(20), Plan.parse("S-H@1")))
        trace = trace_races(synthetic_race(), 10, 1, script=script)
        assert (trace.track_status[:, 0] == first).all()
        assert (trace.compound[:, 1] == 2).all()
        assert (np.diff(np.sort(trace.race_time_s[:, 0], axis=1), axis=1) > 0).all()


def test_a_plan_asked_for_goes_before_the_script_and_keeps_the_rules() -> None:
    trace = trace_races(RECORD, 5, 1, script=SCRIPT, plans={2: Plan.parse("S-H@7")})
    assert trace.stopped[:, 6, 2].all()
    assert trace.stopped[:, :, 2].sum() == 5
    with pytest.raises(RsrlError, match="needs two compounds"):
        simulate(RECORD, 5, 1, script=SCRIPT, plans={2: Plan.parse("S")})


@pytest.mark.parametrize(
    ("script", "message"),
    [
        (Script((0,) * 15), "track status of 15 laps; the race has 16"),
        (Script((0,) * 15 + (4,)), "track status 4"),
        (Script((0,) * 16, {20: 3}), "car 20; cars are 0 to 19"),
        (Script((0,) * 16, disqualified={21}), "car 21; cars are 0 to 19"),
        (Script((0,) * 16, {}, {-1: PLANS[1]}), "car -1"),
        (Script((0,) * 16, {3: 0}), "C03 retires on lap 0"),
        (Script((0,) * 16, {}, {3: Plan.parse("S-H@16")}), "C03, plan S-H@16: stops must come in order, on laps 1 to 15"),
        (Script((0,) * 16, {}, {3: Plan((0,) * 10, tuple(range(1, 10)))}), "9 stops; at most 8"),
    ],
)
def test_a_script_that_does_not_fit_is_refused(script: Script, message: str) -> None:
    for run in (simulate, trace_races, lap_means):
        with pytest.raises(RsrlError, match=message) as caught:
            run(RECORD, 1, 1, script=script)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("script", [None, SCRIPT])
@pytest.mark.parametrize("threads", [1, 2, 3])
def test_averages_by_lap_are_those_of_the_traced_races(script: Script | None, threads: int) -> None:
    record = synthetic_race(red_share=0.5, in_lap_share=0.3)
    races = 90
    means = lap_means(record, races, 3, script=script, threads=threads)
    trace = trace_races(record, races, 3, script=script)
    count = trace.running.sum(axis=0)
    with np.errstate(invalid="ignore"):
        lap_time_s = np.where(trace.running, trace.lap_time_s, 0).sum(axis=0, dtype=float) / count
        position = np.where(trace.running, trace.place, 0).sum(axis=0) / count
    np.testing.assert_allclose(means.lap_time_s, lap_time_s, rtol=1e-12)
    np.testing.assert_allclose(means.position, position)
    np.testing.assert_array_equal(means.running, count / races)
    first = np.where(trace.stopped.any(axis=1), trace.stopped.argmax(axis=1) + 1, 0)
    np.testing.assert_array_equal(means.first_stop, [(first == lap).sum(axis=0) for lap in range(17)])
    for name, code in (("red_laps", RED), ("sc_laps", SC), ("vsc_laps", VSC)):
        assert getattr(means, name) == pytest.approx((trace.track_status == code).sum() / races)
    results = simulate(record, races, 3, script=script)
    for name in ("positions", "stops", "retired", "race_time_s", "slow_laps"):
        np.testing.assert_array_equal(getattr(means.results, name), getattr(results, name))


def test_threads_never_change_the_averages() -> None:
    one, three = (lap_means(RECORD, 200, 3, threads=n) for n in (1, 3))
    assert one.lap_time_s.tobytes() == three.lap_time_s.tobytes()
    assert one.first_stop.tobytes() == three.first_stop.tobytes()


def test_the_replay_of_a_quiet_race_is_that_race() -> None:
    record = synthetic_race(**quiet())
    plans = {car: Plan.parse("S-H@6" if car % 2 else "M-H@8") for car in range(20)}
    own = simulate(record, 5, 1, plans=plans)
    replay = simulate(record, 5, 1, script=Script((0,) * 16, {}, plans))
    np.testing.assert_array_equal(own.race_time_s, replay.race_time_s)
