"""Who passes whom on a racing lap, with the threshold that rises with the gap: worked out by hand on three cars without luck."""

import dataclasses

import numpy as np
import pytest
from synthetic_race import figure, quiet, synthetic_race, with_car

from rsrl.season import RaceRecord
from rsrl.simulator import trace_races

FOLLOW_S, LOSS_S, PASSED_S = 0.6, 0.2, 1.5


def queue(paces: tuple[float, ...], starts: tuple[float, ...], per_gap: float | None, threshold: float = 0.5) -> RaceRecord:
    """Cars of given paces that end lap 1 at the times `starts`."""
    figures = quiet(
        start_per_place_s=0.0, drs_gain_s=0.0, dirty_air_loss_s=0.0, pass_scale_s=0.01, pass_threshold_s=threshold,
        following_gap_s=FOLLOW_S, pass_loss_s=LOSS_S, passed_loss_s=PASSED_S,
    )  # fmt: skip
    record = synthetic_race(cars=len(paces), plans=("M-H@14",), **figures)
    for car, (pace, start) in enumerate(zip(paces, starts, strict=True)):
        record = with_car(record, car, pace_s=pace, start_gain_s=start - pace)
    slope = None if per_gap is None else figure(per_gap)
    return dataclasses.replace(record, track=dataclasses.replace(record.track, pass_per_gap=slope))


def after_lap_2(record: RaceRecord) -> tuple[list[int], np.ndarray]:
    """Order of the cars, and their times against the first."""
    trace = trace_races(record, 1, 3)
    times = trace.race_time_s[0, 1, : len(record.cars)]
    order = np.argsort(times)
    return order.tolist(), times[order] - times.min()


def test_a_passed_car_is_passed_by_the_next_only_with_a_pass_of_its_own() -> None:
    paces, starts = (1.0, 0.0, 0.8), (0.0, 0.6, 1.2)  # the third has 0.2 s on the first, less than it takes
    order, gaps = after_lap_2(queue(paces, starts, per_gap=0.5))
    assert order == [1, 0, 2]
    np.testing.assert_allclose(gaps, [0.0, 1.0 + PASSED_S - 0.6 - LOSS_S, 1.0 + PASSED_S - 0.6 - LOSS_S + FOLLOW_S], atol=1e-3)
    assert after_lap_2(queue(paces, starts, per_gap=None))[0] == [1, 2, 0]  # files without the slope


def test_nobody_passes_two_cars_on_one_lap() -> None:
    order, gaps = after_lap_2(queue((0.0, 0.0, -3.0), (0.0, 0.6, 1.2), per_gap=0.5))
    assert order == [0, 2, 1]
    assert gaps[1] == pytest.approx(FOLLOW_S, abs=1e-3)


@pytest.mark.parametrize(("gap", "per_gap", "passes"), [(0.6, 1.0, True), (1.0, 1.0, False), (1.0, 0.1, True)])
def test_the_threshold_rises_with_the_gap(gap: float, per_gap: float, passes: bool) -> None:
    order, gaps = after_lap_2(queue((0.9, 0.0), (0.0, gap), per_gap, threshold=0.75))
    assert order == ([1, 0] if passes else [0, 1])
    if not passes:
        assert gaps[1] == pytest.approx(FOLLOW_S, abs=1e-3)
