"""Intervals of means, proportions and ratios, and the bootstraps over races: against SciPy, by hand, and by coverage."""

import math

import numpy as np
import pytest
from scipy import stats

from rsrl.errors import RsrlError
from rsrl.statistics import (
    Z,
    bootstrap_over_races,
    half_width,
    mean_estimate,
    mean_interval,
    normal_interval,
    paired_difference,
    probability_of_best,
    proportion_interval,
    ratio_of_means,
    standard_error,
    student_interval,
)

VALUES = np.random.default_rng(0).normal(3.0, 2.0, 30)


def test_a_mean_s_interval_is_student_s() -> None:
    expected = stats.t.interval(0.95, 29, VALUES.mean(), stats.sem(VALUES))
    assert mean_interval(VALUES) == pytest.approx(expected)
    assert mean_estimate(VALUES).ci95 == pytest.approx(expected)
    assert mean_estimate(VALUES).value == pytest.approx(VALUES.mean())
    assert student_interval(VALUES.mean(), stats.sem(VALUES), 29) == pytest.approx(expected)


def test_standard_errors_and_half_widths_are_taken_along_an_axis() -> None:
    table = VALUES.reshape(5, 6)
    np.testing.assert_allclose(standard_error(table), stats.sem(table))
    np.testing.assert_allclose(standard_error(table, axis=1), stats.sem(table, axis=1))
    np.testing.assert_allclose(half_width(table, axis=1), stats.t.ppf(0.975, 5) * stats.sem(table, axis=1))


def test_too_few_values_give_nan() -> None:
    assert all(math.isnan(end) for end in mean_interval([1.0]))
    assert math.isnan(mean_estimate([]).value)
    assert np.isnan(standard_error([[1.0, 2.0]])).tolist() == [True, True]
    assert np.isnan(half_width([1.0]))
    assert all(math.isnan(end) for end in proportion_interval(0.0, 0))
    assert mean_interval([2.0, 2.0, 2.0]) == (2.0, 2.0)


def test_a_normal_interval_reaches_1_96_standard_errors() -> None:
    assert pytest.approx(1.959964, abs=1e-6) == Z
    assert normal_interval(1.0, 0.5) == pytest.approx((1.0 - 0.979982, 1.0 + 0.979982))


def test_intervals_of_several_comparisons_are_bonferroni_s() -> None:
    low, high = student_interval(0.0, 1.0, 20, comparisons=4)
    assert (low, high) == pytest.approx((stats.t.ppf(0.00625, 20), stats.t.ppf(0.99375, 20)))


def test_a_paired_difference_is_that_of_scipy_s_paired_test() -> None:
    others = VALUES + np.random.default_rng(1).normal(0.5, 1.0, 30)
    interval = stats.ttest_rel(VALUES, others).confidence_interval(0.95)
    estimate = paired_difference(VALUES, others)
    assert estimate.value == pytest.approx((VALUES - others).mean())
    assert estimate.ci95 == pytest.approx((interval.low, interval.high))


@pytest.mark.parametrize(("hits", "n"), [(0, 12), (3, 10), (57, 60), (8, 8)])
def test_a_proportion_s_interval_is_wilson_s(hits: int, n: int) -> None:
    interval = stats.binomtest(hits, n).proportion_ci(0.95, method="wilson")
    assert proportion_interval(hits / n, n) == pytest.approx((interval.low, interval.high), abs=1e-12)


def test_ratio_of_means_by_hand() -> None:
    # ratio 2; residuals 1, -1, 0 over a mean of 2: standard error (1 / 2) / sqrt(3)
    estimate = ratio_of_means([3.0, 3.0, 6.0], [1.0, 2.0, 3.0])
    half = stats.t.ppf(0.975, 2) * 0.5 / math.sqrt(3)
    assert (estimate.value, *estimate.ci95) == pytest.approx((2.0, 2.0 - half, 2.0 + half))
    assert math.isnan(ratio_of_means([1.0, 2.0], [1.0, -1.0]).value)
    one = ratio_of_means([4.0], [2.0])
    assert one.value == 2.0
    assert all(math.isnan(end) for end in one.ci95)


def test_a_ratio_s_interval_holds_the_truth_where_members_of_a_cluster_are_alike() -> None:
    # Laps of a race share its luck: as if independent, intervals would hold the truth in half of all cases.
    rng = np.random.default_rng(2)
    covered = []
    for _ in range(600):
        laps = rng.integers(30, 60, 40)
        sums = laps * (1.0 + rng.normal(size=40)) + np.sqrt(laps) * rng.normal(size=40)
        low, high = ratio_of_means(sums, laps).ci95
        covered.append(low <= 1.0 <= high)
    assert 0.92 < np.mean(covered) < 0.975


def test_a_bootstrap_over_races_agrees_with_student_s_interval() -> None:
    values = np.random.default_rng(3).normal(size=300)
    low, high = bootstrap_over_races(values, resamples=4000)
    assert (low, high) == pytest.approx(mean_interval(values), abs=0.01)
    again = bootstrap_over_races(values, resamples=4000)
    assert (low, high) == again != bootstrap_over_races(values, seed=1, resamples=4000)


def test_a_bootstrap_over_races_keeps_a_race_together_and_leaves_out_nan() -> None:
    # Both columns are one race's: their difference is 2 in every resample.
    values = np.random.default_rng(4).normal(size=40)
    pairs = np.column_stack([values + 2.0, values])
    low, high = bootstrap_over_races(pairs, lambda rows: rows.mean(axis=0), resamples=500)
    assert (low - low[1], high - high[1]) == (pytest.approx([2.0, 0.0]), pytest.approx([2.0, 0.0]))
    some = bootstrap_over_races([1.0, math.nan], lambda rows: rows[0], resamples=500)
    assert [float(end) for end in some] == [1.0, 1.0]
    with pytest.raises(RsrlError, match="no races"):
        bootstrap_over_races([])


def test_bootstraps_over_races_hold_the_truth_about_as_often_as_they_say() -> None:
    rng = np.random.default_rng(5)
    covered = []
    for i in range(300):
        low, high = bootstrap_over_races(rng.normal(size=60), seed=i, resamples=300)
        covered.append(low <= 0 <= high)
    assert 0.90 < np.mean(covered) < 0.98


def test_probability_of_best_counts_ties_by_shares() -> None:
    rng = np.random.default_rng(0)
    level = rng.integers(1, 21, 500)
    chances = probability_of_best(np.array([level, level, np.minimum(level + 3, 20)]))
    np.testing.assert_allclose(chances, [0.5, 0.5, 0.0], atol=1e-9)


def test_probability_of_best_is_that_of_a_normal_mean_for_many_races() -> None:
    """Two plans whose difference over the races has a known mean and standard error."""
    races = 1000
    noise = np.random.default_rng(1).integers(-4, 5, races)
    noise[races // 2 :] = -noise[: races // 2]  # its mean is zero
    for behind in (0, 50, 150, 400):  # in so many races, one place
        difference = noise + (np.arange(races) < behind)
        z = difference.mean() / (difference.std() / races**0.5)
        p_best = probability_of_best(np.array([np.full(races, 10), 10 + difference]))
        assert p_best[0] == pytest.approx(0.5 * (1 + math.erf(z / 2**0.5)), abs=0.035), "three standard errors of 2,000 resamples"
    assert p_best[0] > 0.99
