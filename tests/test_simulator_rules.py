"""Rules that hold in every simulated race, whatever its figures: property tests on small made-up races."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_race import figure, quiet, synthetic_race, with_car

from rsrl.season import GREEN, SC, VSC, RaceRecord
from rsrl.simulator import Plan, RaceBatch, Trace, compile_figures, simulate, trace_races
from rsrl.simulator import layout as at

RACES = 6
SMALL = settings(max_examples=25)


@st.composite
def records(draw: st.DrawFn) -> RaceRecord:
    """Races of many kinds: short and long, sparse and full fields, calm and wild, with and without a limit on a set."""
    number = lambda low, high: draw(st.floats(low, high))  # noqa: E731
    limit = draw(st.sampled_from([0, 0, 10, 13]))
    slope = draw(st.sampled_from([None, 0.5, 2.0]))
    record = synthetic_race(
        laps=draw(st.integers(12, 18)),
        cars=draw(st.integers(2, 24)),
        max_laps_per_set=limit,
        sets=(2, 2, 3),
        plans=("S-H@8", "M-H@9", "H-M@8", "S-M@5-S@9") if limit else ("S-H@6", "M-H@8", "H-M@10", "S-M@5-S@9"),
        pace_step_s=number(0.0, 0.8),
        lap_noise_sd_s=number(0.0, 1.5),
        pass_threshold_s=number(-1.0, 3.0),
        sc_lap1=number(0.0, 1.0),
        sc_per_lap=number(0.0, 0.2),
        vsc_per_lap=number(0.0, 0.2),
        retire_per_lap=number(0.0, 0.08),
        jitter_sd_laps=number(0.0, 3.0),
        sc_reaction=number(0.0, 1.0),
        drs_gain_s=number(0.0, 1.0),
    )
    return dataclasses.replace(record, track=dataclasses.replace(record.track, pass_per_gap=None if slope is None else figure(slope)))


def before(values: np.ndarray, first: Any) -> np.ndarray:
    """The value one lap earlier, [races, laps, cars]."""
    return np.concatenate([np.broadcast_to(first, values[:, :1].shape), values[:, :-1]], axis=1)


@SMALL
@given(records(), st.integers(0, 2**40))
def test_every_race_keeps_the_rules(record: RaceRecord, seed: int) -> None:
    cars = len(record.cars)
    trace = trace_races(record, RACES, seed)
    results = simulate(record, RACES, seed)
    check_order(trace, cars)
    check_no_passing_under_caution(trace, cars)
    check_tyres(record, trace, cars)
    check_classification(record, trace, results.positions, cars)
    assert (np.sort(results.positions, axis=1) == np.arange(1, cars + 1)).all()
    np.testing.assert_array_equal(results.slow_laps[:, 0], (trace.track_status == SC).sum(axis=1))
    np.testing.assert_array_equal(results.slow_laps[:, 1], (trace.track_status == VSC).sum(axis=1))


def check_order(trace: Trace, cars: int) -> None:
    """Places are 1..n by race time, running cars first; who is out stays out."""
    running = trace.running
    assert not (running & ~before(running, True)).any()
    assert (np.sort(trace.place, axis=2) == np.arange(1, cars + 1)).all()
    count = running.sum(axis=2)
    assert (trace.place[running] <= np.broadcast_to(count[..., None], running.shape)[running]).all()
    for race in range(RACES):
        for lap in range(running.shape[1]):
            on = np.flatnonzero(running[race, lap])
            by_place = on[np.argsort(trace.place[race, lap, on])]
            assert (np.diff(trace.race_time_s[race, lap, by_place]) >= 0).all()


def check_no_passing_under_caution(trace: Trace, cars: int) -> None:
    """Under either safety car, cars that neither box nor retire keep their order."""
    for race, lap in zip(*np.nonzero(trace.track_status != GREEN), strict=True):
        stay = np.flatnonzero(trace.running[race, lap] & ~trace.stopped[race, lap])
        earlier = trace.place[race, lap - 1, stay]
        assert (np.diff(trace.place[race, lap, stay[np.argsort(earlier)]]) > 0).all()


def check_tyres(record: RaceRecord, trace: Trace, cars: int) -> None:
    """Ages count up from the stop, compounds change only there, sets suffice, no stop comes on the last lap, no set runs too long."""
    on, fresh = trace.running, before(trace.stopped, True)
    age, compound = trace.tyre_age_laps, trace.compound
    np.testing.assert_array_equal(age[on], np.where(fresh, 1, before(age, 0) + 1)[on])
    changed = compound != before(compound, compound[:, :1])
    assert not (changed & ~fresh & on).any()
    assert not trace.stopped[:, -1].any()
    assert not (trace.stopped & ~trace.running).any()
    for code, sets in enumerate(record.sets):
        assert ((fresh & on & (compound == code)).sum(axis=1) <= sets).all()
    if record.max_laps_per_set:
        assert (age[on] <= record.max_laps_per_set).all()


def check_classification(record: RaceRecord, trace: Trace, positions: np.ndarray, cars: int) -> None:
    """Finishers in order, then those with one compound only, then retirements, the later ahead of the earlier."""
    for race in range(RACES):
        laps_done = trace.running[race].sum(axis=0)
        finished = laps_done == record.laps
        used = [len(set(trace.compound[race, : max(n, 1), car])) for car, n in enumerate(laps_done)]
        key = [(0, used[c] < 2, trace.place[race, -1, c]) if finished[c] else (1, False, -laps_done[c]) for c in range(cars)]
        order = np.argsort(positions[race])
        ordered = [key[c] for c in order]
        assert ordered == sorted(ordered)
        assert set(positions[race]) == set(range(1, cars + 1))


def test_a_rival_keeps_two_compounds_where_a_set_may_not_run_longer() -> None:
    """Luck moves the stop beyond the limit: it is then taken at the limit, for the planned compound and not for a spare."""
    record = synthetic_race(sets=(2, 2, 3), plans=("H-M@10",), max_laps_per_set=10, jitter_sd_laps=4.0, retire_per_lap=0.0, retire_lap1=0.0)
    trace = trace_races(record, 50, 1)
    late = trace.stopped[:, 9]
    assert late.sum() > 100
    assert all(len(set(trace.compound[race, :, car])) == 2 for race in range(50) for car in range(20))


def test_one_compound_is_classified_behind_every_legal_finisher() -> None:
    record = synthetic_race(sc_lap1=0.0, sc_per_lap=0.0, retire_per_lap=0.02)
    batch = RaceBatch(compile_figures(record), 60, outside=(0, 1))
    batch.start(3, np.arange(60, dtype=np.int64))
    for _ in range(record.laps):
        batch.advance()
    positions = batch.positions()
    running = batch.r[:, at.R_RUNNING]
    finished = batch.k[:, at.K_PLACE, :2] < running[:, None]
    assert finished.any(axis=0).all()
    for race in range(60):
        rule_breakers = int(finished[race].sum())
        for car in (0, 1):
            if finished[race, car]:
                assert running[race] - rule_breakers < positions[race, car] <= running[race]


def test_lapped_cars_get_their_lap_back_before_the_restart() -> None:
    laps = {"sc_lap1": 0.0, "sc_per_lap": 0.05}
    record = with_car(synthetic_race(laps=40, plans=("S-H@20",), sc_laps=(0.0, 0.0, 1.0), **quiet(**laps)), 19, pace_s=9.0)
    trace = trace_races(record, 40, 2)
    gap = trace.race_time_s[:, :, 19] - trace.race_time_s.min(axis=2)
    base = record.track.base_lap_s.value
    status = trace.track_status
    last = (status[:, :-1] == SC) & (status[:, 1:] == GREEN)  # the last lap of a safety car
    stopped = trace.stopped[:, :-1, 19]
    lapped_before = np.concatenate([np.zeros((40, 1)), gap[:, :-2]], axis=1) > base
    assert (last & lapped_before).sum() > 5
    assert (gap[:, :-1][last & ~stopped] < base).all()
    laps_lost = gap[:, :-1][~last & (status[:, :-1] == GREEN)] > base
    assert laps_lost.any()


def first_difference(a: RaceRecord, b: RaceRecord) -> int:
    """First lap, from 1, on which any lap time of one race differs."""
    differs = (trace_races(a, 1, 1).lap_time_s != trace_races(b, 1, 1).lap_time_s).any(axis=(0, 2))
    return int(np.argmax(differs)) + 1 if differs.any() else 0


START: dict[str, Any] = {}
SAFETY_CAR: dict[str, Any] = {"sc_lap1": 1.0, "sc_laps": (0.0, 0.0, 1.0)}  # on laps 2 to 4
VIRTUAL: dict[str, Any] = {"vsc_per_lap": 1.0, "vsc_laps": (0.0, 0.0, 1.0)}  # on laps 2 to 4


@pytest.mark.parametrize(
    ("drs_off_laps", "incidents", "first"),
    [
        (1, START, 2),
        (2, START, 3),
        (1, SAFETY_CAR, 6),  # lap 5 is the first racing lap after it
        (2, SAFETY_CAR, 7),
        (1, VIRTUAL, 5),  # back at once
        (2, VIRTUAL, 5),
    ],
)
def test_drs_is_off_after_start_and_safety_car_for_the_laps_of_the_season_file(
    drs_off_laps: int, incidents: dict[str, Any], first: int
) -> None:
    def race(drs_gain_s: float) -> RaceRecord:
        figures = quiet(drs_gain_s=drs_gain_s, pass_threshold_s=50.0, start_per_place_s=0.7) | incidents
        return synthetic_race(plans=("S-H@14",), pace_step_s=0.0, drs_off_laps=drs_off_laps, **figures)

    assert first_difference(race(0.0), race(0.4)) == first


def test_no_stop_takes_effect_on_the_last_lap() -> None:
    record = synthetic_race(laps=12, sets=(20, 2, 2), **quiet())
    batch = RaceBatch(compile_figures(record), 1, outside=(0,))
    batch.start(1, np.zeros(1, np.int64))
    batch.actions[0, 0] = 1
    for _ in range(12):
        batch.advance()
    assert batch.k[0, at.K_STOPS, 0] == 11
    assert batch.k[0, at.K_AGE, 0] == 1
    assert batch.f[0, at.F_LAP, 0] < record.track.base_lap_s.value + 5


def test_a_field_of_one_drives_alone() -> None:
    trace = trace_races(synthetic_race(cars=1, **quiet()), 1, 1, plans={0: Plan.parse("M-S@8")})
    assert (trace.place[0, :, 0] == 1).all()
    assert trace.running[0, :, 0].all()
    assert not trace.running[0, :, 1:].any()
