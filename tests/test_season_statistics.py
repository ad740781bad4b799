"""What counts as a pass: on a race of three cars written down by hand, and alike in a trace and in its lap table."""

import dataclasses

import numpy as np
import pytest
from calibration_laps import facts_of, known_record, lap_table

from rsrl.evaluation.season_statistics import RaceArrays, passes, real_race_arrays, simulated_races
from rsrl.season import GREEN, RED, SC
from rsrl.simulator import trace_races

LAPS = 8


def race(*changes: tuple[int, tuple[int, int, int]]) -> RaceArrays:
    """Three cars in order until lap 1, 2 ... of a change, from which on they have the places given."""
    place = np.tile([1, 2, 3], (LAPS, 1))
    for lap, places in changes:
        place[lap - 1 :] = places
    none = np.zeros((LAPS, 3), bool)
    return RaceArrays(place, none.copy(), ~none, np.full(LAPS, GREEN), np.ones(3, bool))


def test_changes_of_order_under_green_are_passes() -> None:
    assert passes(race()) == 0
    assert passes(race((4, (2, 1, 3)))) == 1
    assert passes(race((4, (3, 1, 2)))) == 2  # two cars on one lap
    assert passes(race((4, (2, 1, 3)), (6, (1, 2, 3)))) == 2  # and back


@pytest.mark.parametrize("lap", [1, 2])
def test_lap_1_at_either_end_is_the_start(lap: int) -> None:
    assert passes(race((lap, (2, 1, 3)))) == 0


@pytest.mark.parametrize("code", [SC, RED])
@pytest.mark.parametrize("lap", [3, 4])
def test_laps_that_are_not_green_at_either_end_do_not_count(lap: int, code: int) -> None:
    seen = race((4, (2, 1, 3)))
    seen.status[lap - 1] = code
    assert passes(seen) == 0


@pytest.mark.parametrize("lap", [3, 4])
@pytest.mark.parametrize("car", [0, 1])
def test_in_laps_and_out_laps_of_either_car_do_not_count(car: int, lap: int) -> None:
    seen = race((4, (2, 1, 3)))
    seen.stopped[lap - 1, car] = True
    assert passes(seen) == 0


def test_the_last_lap_of_a_car_that_retires_does_not_count() -> None:
    seen = race((4, (2, 1, 3)))
    seen.running[4:, 0] = False
    assert passes(seen) == 1  # flagged a lap down, say: it did finish
    assert passes(dataclasses.replace(seen, finished=np.array([False, True, True]))) == 0


def test_a_trace_and_its_lap_table_have_the_same_passes() -> None:
    record = known_record()
    trace = trace_races(record, 1, 4)
    laps = lap_table(record, trace, 2023, range(1, 2))
    counted = passes(simulated_races(record, trace)[0])
    assert counted > 20
    assert passes(real_race_arrays(laps, facts_of(record, laps))) == counted
