"""Every feature against its definition, and the state's own checks."""

import dataclasses

import numpy as np
import pytest
from slow_features import SlowFeatures
from synthetic_race import PIT, synthetic_race, with_car

from rsrl.errors import RsrlError
from rsrl.season import RaceRecord, assume
from rsrl.simulator import compile_figures
from rsrl.state import (
    COLUMN,
    FEATURE_SETS,
    FEATURES,
    FIGURES,
    Action,
    Observer,
    UnifiedRaceState,
    UnifiedRaceStrategy,
    context_figures,
    feature_set,
)
from rsrl.translators import SimulatedRace

CARS = 19


RECORD = synthetic_race(cars=CARS, retire_per_lap=0.02, pace_step_s=0.15, stint_sd_s=0.2)


def played(car: int, races: int, seed: int, record: RaceRecord = RECORD) -> list[UnifiedRaceState]:
    """States of races in which the car stops at random, about every fifth lap."""
    rng = np.random.default_rng(seed)
    states = []
    for number in range(races):
        race = SimulatedRace(record, car, seed, number)
        while (state := race.state()) is not None:
            states.append(state)
            new = int(rng.integers(3))
            box = rng.random() < 0.2 and state.sets_left[new] > 0
            race.apply(UnifiedRaceStrategy(Action(1 + new) if box else Action.NO_PIT))
    return states


CONSTANT = {"track", *(f.name for f in FIGURES)} - {"grid", "pace_s", "pace_place"}
"""Features that are the same on every lap of every car of one race."""


def test_every_feature_is_what_it_says() -> None:
    record, rows = RECORD, []
    for car in (0, 7, CARS - 1):
        observer = Observer(record, car)
        slow = SlowFeatures(record, car, [float(c) for c in observer.context.pit_cost_s])
        for state in played(car, 12, seed=car):
            row, expected = observer.row(state), slow(state)
            assert set(expected) == set(COLUMN)
            for name, value in expected.items():
                assert row[COLUMN[name]] == pytest.approx(float(value), abs=2e-3), (name, state)
            rows.append(row)
    spread = np.ptp(np.array(rows), axis=0)
    assert {f.name for f, s in zip(FEATURES, spread, strict=True) if s == 0} == CONSTANT  # the others were all put to the test


def test_features_of_a_car_with_its_own_used_sets_are_what_they_say() -> None:
    car = 7
    record = assume(RECORD, ["sets.C07=S1S1u4M1u2H1u3H1u5", "sets.C06=S1u3M1u3H1u3"])
    observer = Observer(record, car)
    slow = SlowFeatures(record, car, [float(c) for c in observer.context.pit_cost_s])
    ages = set()
    for state in played(car, 12, seed=car, record=record):
        row, expected = observer.row(state), slow(state)
        for name, value in expected.items():
            assert row[COLUMN[name]] == pytest.approx(float(value), abs=2e-3), (name, state)
        own = next(c for c in state.cars if c.driver == "C07")
        if own.just_stopped:
            ages.add((own.compound, own.tyre_age_laps))
    assert ages == {("S", 0), ("S", 4), ("M", 2), ("H", 3), ("H", 5)}


def test_cost_of_a_stop_is_the_mean_over_luck() -> None:
    observer = Observer(with_car(synthetic_race(), 3, stop_loss_s=0.5), 3)
    u = (np.arange(200_000) + 0.5) / 200_000
    tail = np.minimum(PIT["tail_scale_s"] * (u / (1 - u)) ** (1 / PIT["tail_shape"]), PIT["tail_max_s"]).mean()
    for status, name in enumerate(("loss_green_s", "loss_vsc_s", "loss_sc_s")):
        assert observer.context.pit_cost_s[status] == pytest.approx(PIT[name] + 0.5 + tail, abs=0.01)


def test_the_papers_set_is_its_table_in_its_order() -> None:
    assert [f.name for f in feature_set("paper")] == [
        "track", "safety_car", "position", "race_progress", "tyre", "tyre_degradation_s", "soft_available", "medium_available",
        "hard_available", "gap_ahead_s", "gap_behind_s", "gap_to_leader_s", "last_lap_ratio", "valid_finish",
    ]  # fmt: skip
    with pytest.raises(RsrlError, match="unknown feature set 'some'; there are paper, full"):
        feature_set("some")


def test_a_track_is_known_by_its_figures_or_by_its_name() -> None:
    names = {name: {f.name for f in feature_set(name)} for name in FEATURE_SETS}
    figures = {f.name for f in FIGURES}
    assert set(names) == {"paper", "full", "named"}
    assert names["full"] == {f.name for f in FEATURES} - {"track"}
    assert names["named"] == {f.name for f in FEATURES} - figures
    assert names["paper"] < names["named"]
    assert all(f.fixed is not None for name in ("full", "named") for f in feature_set(name) if f.kind != "category")


HAND = {
    "race_laps": 16, "pit_loss_s": 20.5, "pit_loss_vsc_s": 13.5, "pit_loss_sc_s": 10.5, "wear_soft_s": 0.1, "wear_medium_s": 0.06,
    "wear_hard_s": 0.03, "offset_soft_s": -0.6, "offset_hard_s": 0.4, "pass_threshold_s": 0.8, "sc_chance": 0.04, "vsc_chance": 0.03,
    "set_limit_laps": 0, "rival_stops": 19 / 15, "grid": 7, "pace_s": -0.28, "pace_place": 7, "field_spread_s": 0.08 * 33.25**0.5,
}  # fmt: skip
TYRES_ON = {"S": (-0.4, 0.2, 0.0, 0.0), "M": (0.3, 0.06, 0.0, 0.0), "H": (0.4, 0.03, 0.0, 0.0)}


@pytest.mark.parametrize(
    ("record", "changed"),
    [
        (synthetic_race(), {}),
        (synthetic_race(laps=20), {"race_laps": 20}),
        (synthetic_race(loss_vsc_s=15.0), {"pit_loss_vsc_s": 15.5}),
        (synthetic_race(tyres=TYRES_ON), {"wear_soft_s": 0.2, "offset_soft_s": -0.7, "offset_hard_s": 0.1}),
        (synthetic_race(pass_threshold_s=1.5, sc_per_lap=0.01), {"pass_threshold_s": 1.5, "sc_chance": 0.01}),
        (synthetic_race(vsc_per_lap=0.02, sc_lap1=0.5), {"vsc_chance": 0.02}),
        (synthetic_race(plans=("M-H@8-S@12",), max_laps_per_set=8), {"rival_stops": 2, "set_limit_laps": 8}),
        (synthetic_race(pace_step_s=0.0), {"pace_s": 0, "pace_place": 1, "field_spread_s": 0}),
        (with_car(synthetic_race(), 6, stop_loss_s=1.0), {"pit_loss_s": 21.5, "pit_loss_vsc_s": 14.5, "pit_loss_sc_s": 11.5}),
        (with_car(synthetic_race(), 0, stop_loss_s=1.0, retire_per_lap=0.5), {}),
    ],
)
def test_figures_of_a_race_and_car_by_hand(record: RaceRecord, changed: dict[str, float]) -> None:
    tail_s = float(compile_figures(record).tail.mean())
    expected = HAND | changed
    for name in ("pit_loss_s", "pit_loss_vsc_s", "pit_loss_sc_s"):
        expected[name] += tail_s - 0.5
    assert dict(zip((f.name for f in FIGURES), context_figures(record, 6), strict=True)) == pytest.approx(expected, abs=1e-4)


def test_figures_stand_in_every_row() -> None:
    record = synthetic_race()
    state = first_state()
    row = Observer(record, 4).row(state)
    np.testing.assert_array_equal(row[[COLUMN[f.name] for f in FIGURES]], context_figures(record, 4))


def test_a_state_with_a_car_that_did_not_start_is_refused() -> None:
    state = first_state()
    strangers = (dataclasses.replace(state.cars[0], driver="ZZZ"), dataclasses.replace(state.cars[1], driver="XYZ"), *state.cars[2:])
    with pytest.raises(RsrlError, match="state: XYZ did not start at bahrain-2099"):
        Observer(synthetic_race(), 4).row(dataclasses.replace(state, cars=strangers))


def test_a_state_may_lack_cars_that_are_out() -> None:
    """A source that drops retired cars gives the same row as one that keeps them, whatever their order."""
    record = synthetic_race()
    observer = Observer(record, 4)
    state = first_state()
    out = tuple(dataclasses.replace(c, running=c.driver != "C19") for c in state.cars)
    kept = observer.row(dataclasses.replace(state, cars=out))
    np.testing.assert_array_equal(kept, observer.row(dataclasses.replace(state, cars=out[:-1])))
    np.testing.assert_array_equal(kept, observer.row(dataclasses.replace(state, cars=out[::-1])))
    assert kept[COLUMN["cars_running"]] == 19


def first_state() -> UnifiedRaceState:
    state = SimulatedRace(synthetic_race(), 4, 1).state()
    assert state is not None
    return state


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"laps_completed": 16}, "lap 16 of 16 leaves nothing to decide"),
        ({"laps_completed": -1}, "lap -1 of 16"),
        ({"track_status": 4}, "track_status is 4"),
        ({"driver": "HAM"}, "HAM is not among the running cars"),
    ],
)
def test_a_state_that_cannot_be_is_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(RsrlError, match=message):
        dataclasses.replace(first_state(), **change)  # type: ignore[arg-type]


def test_unknown_compounds_and_retired_callers_are_refused() -> None:
    state = first_state()
    wet = dataclasses.replace(state.cars[0], compound="W")
    with pytest.raises(RsrlError, match="unknown compound 'W'"):
        dataclasses.replace(state, cars=(wet, *state.cars[1:]))
    with pytest.raises(RsrlError, match="C04 is not among the running cars"):
        dataclasses.replace(state, cars=tuple(dataclasses.replace(c, running=c.driver != "C04") for c in state.cars))


def test_actions_say_what_they_mean() -> None:
    assert [a.compound for a in Action] == [None, "S", "M", "H"]
    assert [str(a) for a in Action] == ["stay out", "box for soft", "box for medium", "box for hard"]
