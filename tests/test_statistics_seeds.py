"""Intervals over training runs: worked by hand, against SciPy, and how often intervals hold the truth."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from rsrl.errors import RsrlError
from rsrl.statistics import (
    interquartile_mean,
    mean_interval,
    mean_of_runs,
    mean_over_seeds,
    probability_of_improvement,
    stratified_bootstrap,
)


def test_interquartile_mean_by_hand() -> None:
    # a quarter of eight is two: 3, 4, 5, 6 are left
    assert interquartile_mean([8, 1, 7, 2, 6, 3, 5, 4]) == 4.5
    # a quarter of five is one, rounded down: 0 and 1000 go
    assert interquartile_mean([1000, 2, 3, 4, 0]) == 3.0
    assert interquartile_mean([[1, 9], [5, 3]]) == 4.0
    np.testing.assert_array_equal(interquartile_mean([[1, 5, 100, 3], [2, 2, 2, 2]], axis=1), [4.0, 2.0])


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=40))
def test_interquartile_mean_is_scipy_s_trimmed_mean(values: list[float]) -> None:
    assert interquartile_mean(values) == pytest.approx(stats.trim_mean(values, 0.25), rel=1e-9, abs=1e-9)


def test_axes_taken_together() -> None:
    values = np.random.default_rng(0).normal(size=(3, 4, 5))
    expected = [stats.trim_mean(values[i].ravel(), 0.25) for i in range(3)]
    np.testing.assert_allclose(interquartile_mean(values, axis=(-2, -1)), expected)
    np.testing.assert_allclose(interquartile_mean(values, axis=0), stats.trim_mean(values, 0.25, axis=0))


def test_a_bootstrap_is_a_function_of_its_seed_and_holds_the_value() -> None:
    scores = np.random.default_rng(3).normal(size=(5, 3, 40))
    first, second = (stratified_bootstrap(scores, seed=1, resamples=300) for _ in range(2))
    assert first == second != stratified_bootstrap(scores, seed=2, resamples=300)
    assert first.value == pytest.approx(stats.trim_mean(scores.mean(axis=2).ravel(), 0.25))
    assert first.ci95[0] < first.value < first.ci95[1]
    constant = stratified_bootstrap(np.full((4, 2, 10), 3.0))
    assert (constant.value, *constant.ci95) == pytest.approx((3.0, 3.0, 3.0))


def test_races_are_resampled_for_all_runs_together() -> None:
    # Runs are alike, races are not: the interval is that of the races, however many runs there are.
    races = np.random.default_rng(0).normal(size=100)
    interval = stratified_bootstrap(np.tile(races, (20, 1, 1)), mean_of_runs, resamples=4000).ci95
    low, high = mean_interval(races)
    assert interval[1] - interval[0] == pytest.approx(high - low, rel=0.08)


def test_tasks_are_strata() -> None:
    # Tasks far apart, runs alike within each: resampling across tasks would give a wide interval.
    scores = np.repeat(np.array([[0.0, 100.0]]), 6, axis=0)
    assert stratified_bootstrap(scores, mean_of_runs).ci95 == (50.0, 50.0)


def test_probability_of_improvement_by_hand() -> None:
    x, y = [[[3, 1, 2, 5]]], [[[1, 1, 4, 2]]]
    assert probability_of_improvement(x, y).value == pytest.approx((1 + 0.5 + 0 + 1) / 4)
    assert probability_of_improvement(y, x).value == pytest.approx(1.5 / 4)
    # two runs against one, two tasks: (1, 1; 0, 1) and (1; 0)
    runs = np.array([[[2.0, 2.0], [1.0, 1.0]], [[0.0, 2.0], [0.0, 0.0]]])
    assert probability_of_improvement(runs, np.array([[[1.0, 1.0], [0.5, 0.5]]])).value == pytest.approx(0.625)
    sure = probability_of_improvement([[[2.0] * 9]], [[[1.0] * 9]])
    assert (sure.value, *sure.ci95) == pytest.approx((1.0, 1.0, 1.0))


def test_one_seed_gives_student_s_interval_of_the_races() -> None:
    values = np.random.default_rng(1).normal(size=50)
    estimate = mean_over_seeds(values[None])
    assert estimate.value == pytest.approx(values.mean())
    assert estimate.ci95 == pytest.approx(mean_interval(values))
    assert all(math.isnan(end) for end in mean_over_seeds([[1.0], [2.0]]).ci95)


def test_mean_squares_by_hand() -> None:
    # Seeds at +-3, races at +-1, no rest: MS_seeds = 2 x 18, MS_races = 2 x 2; variance of the mean = 40 / 4.
    estimate = mean_over_seeds([[4.0, 2.0], [-2.0, -4.0]])
    freedom = 40**2 / (36**2 + 4**2)
    half = stats.t.ppf(0.975, freedom) * math.sqrt(10)
    assert (estimate.value, *estimate.ci95) == pytest.approx((0.0, -half, half))
    assert mean_over_seeds(np.full((3, 4), 2.0)).ci95 == (2.0, 2.0)


@pytest.mark.parametrize(
    ("sds", "most"),
    # no component below zero: where neither seeds nor races matter the interval is too wide
    [((0.3, 1.0, 2.0), 0.98), ((1.0, 0.5, 1.0), 0.98), ((0.0, 1.0, 1.0), 0.99), ((0.0, 0.0, 1.0), 0.999)],
)
def test_intervals_over_seeds_and_races_hold_the_truth_as_often_as_they_say(sds: tuple[float, float, float], most: float) -> None:
    rng = np.random.default_rng(2)
    seed_sd, race_sd, rest_sd = sds
    covered = []
    for _ in range(600):
        table = seed_sd * rng.normal(size=(5, 1)) + race_sd * rng.normal(size=(1, 60)) + rest_sd * rng.normal(size=(5, 60))
        low, high = mean_over_seeds(table).ci95
        covered.append(low <= 0 <= high)
    assert 0.925 < np.mean(covered) < most


def test_bootstrap_intervals_hold_the_truth_about_as_often_as_they_say() -> None:
    rng = np.random.default_rng(4)
    covered = []
    for i in range(200):
        scores = 0.5 * rng.normal(size=(12, 4, 1)) + rng.normal(size=(12, 4, 30)) + 0.5 * rng.normal(size=(1, 4, 30))
        low, high = stratified_bootstrap(scores, mean_of_runs, seed=i, resamples=400).ci95
        covered.append(low <= 0 <= high)
    assert 0.89 < np.mean(covered) < 0.98


def test_probability_intervals_hold_the_truth_about_as_often_as_they_say() -> None:
    rng = np.random.default_rng(5)
    covered = []
    for i in range(200):
        x, y = rng.integers(1, 21, (2, 1, 1, 80))
        low, high = probability_of_improvement(x, y, seed=i, resamples=300).ci95
        covered.append(low <= 0.5 <= high)
    assert 0.90 < np.mean(covered) < 0.99


def test_what_cannot_be_compared_is_refused() -> None:
    with pytest.raises(RsrlError, match="can't be paired"):
        probability_of_improvement(np.zeros((1, 1, 3)), np.zeros((1, 1, 4)))
    with pytest.raises(RsrlError, match="not all finite"):
        stratified_bootstrap([[math.nan]])
    with pytest.raises(RsrlError, match="no table of seeds and races"):
        mean_over_seeds([1.0, 2.0])
