"""Every feature against its definition, and the state's own checks."""

import dataclasses

import numpy as np
import pytest
from slow_features import SlowFeatures
from synthetic_race import PIT, synthetic_race, with_car

from rsrl.errors import RsrlError
from rsrl.state import COLUMN, FEATURE_SETS, FEATURES, Action, Observer, UnifiedRaceState, UnifiedRaceStrategy, feature_set
from rsrl.translators import SimulatedRace

CARS = 19


def played(car: int, races: int, seed: int) -> list[UnifiedRaceState]:
    """States of races in which the car stops at random, about every fifth lap."""
    record = synthetic_race(cars=CARS, retire_per_lap=0.02, pace_step_s=0.15)
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


def test_every_feature_is_what_it_says() -> None:
    record = synthetic_race(cars=CARS, retire_per_lap=0.02, pace_step_s=0.15)
    rows = []
    for car in (0, 7, CARS - 1):
        observer = Observer(record, car)
        slow = SlowFeatures(record, car, [float(c) for c in observer.pit_cost_s])
        for state in played(car, 12, seed=car):
            row, expected = observer.row(state), slow(state)
            assert set(expected) == set(COLUMN)
            for name, value in expected.items():
                assert row[COLUMN[name]] == pytest.approx(float(value), abs=2e-3), (name, state)
            rows.append(row)
    spread = np.ptp(np.array(rows), axis=0)
    assert [f.name for f, s in zip(FEATURES, spread, strict=True) if s == 0] == ["track"]  # the others were all put to the test


def test_cost_of_a_stop_is_the_mean_over_luck() -> None:
    observer = Observer(with_car(synthetic_race(), 3, stop_loss_s=0.5), 3)
    u = (np.arange(200_000) + 0.5) / 200_000
    tail = np.minimum(PIT["tail_scale_s"] * (u / (1 - u)) ** (1 / PIT["tail_shape"]), PIT["tail_max_s"]).mean()
    for status, name in enumerate(("loss_green_s", "loss_vsc_s", "loss_sc_s")):
        assert observer.pit_cost_s[status] == pytest.approx(PIT[name] + 0.5 + tail, abs=0.01)


def test_the_papers_set_is_its_table_in_its_order() -> None:
    assert [f.name for f in feature_set("paper")] == [
        "track", "safety_car", "position", "race_progress", "tyre", "tyre_degradation_s", "soft_available", "medium_available",
        "hard_available", "gap_ahead_s", "gap_behind_s", "gap_to_leader_s", "last_lap_ratio", "valid_finish",
    ]  # fmt: skip
    with pytest.raises(RsrlError, match="unknown feature set 'some'; there are paper, full"):
        feature_set("some")
    assert set(FEATURE_SETS) == {"paper", "full"}


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
