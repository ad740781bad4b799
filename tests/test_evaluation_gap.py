"""The share of the gap from fixed strategies to hindsight: its value, and an interval that covers as often as it says."""

import math

import numpy as np
import pytest
from test_evaluation_paired import log_of

from rsrl.evaluation import gap_closed, leaderboard
from rsrl.statistics import Estimate


def test_share_of_the_gap_by_hand() -> None:
    logs = [log_of([8, 10, 6, 4], "fixed"), log_of([4, 8, 2, 2], "hindsight"), log_of([7, 10, 4, 4], "x"), log_of([9, 10, 6, 4], "worse")]
    closed = gap_closed({log.strategist: log for log in logs})
    assert closed["fixed"] == Estimate(0, (0, 0))
    assert closed["hindsight"] == Estimate(1, (1, 1))
    share, (low, high) = closed["x"].value, closed["x"].ci95
    assert share == pytest.approx(0.75 / 3)  # gains 1 0 2 0, gaps 4 2 4 2
    residuals = np.array([1 - 1, 0 - 0.5, 2 - 1, 0 - 0.5]) / 3
    assert (low + high) / 2 == pytest.approx(share)
    assert high - share == pytest.approx(3.18245 * residuals.std(ddof=1) / 2, abs=1e-5)
    assert closed["worse"].value < 0


def test_interval_covers_the_true_share() -> None:
    """Races in which what a strategist gains goes with what there is to gain: 40 % of it on average."""
    rng, covered = np.random.default_rng(2), []
    for _ in range(1000):
        fixed = rng.integers(8, 20, 300)
        gap = rng.binomial(6, 0.3, 300)
        middle = fixed - rng.binomial(gap, 0.4)
        logs = [log_of(p.tolist(), name) for p, name in ((fixed, "fixed"), (fixed - gap, "hindsight"), (middle, "x"))]
        low, high = gap_closed({log.strategist: log for log in logs})["x"].ci95
        covered.append(low <= 0.4 <= high)
    assert 0.93 < np.mean(covered) < 0.97


def test_rows_have_it_where_both_ends_are_there() -> None:
    model, fixed, hindsight = log_of([3, 4], "model"), log_of([5, 6], "fixed"), log_of([1, 4], "hindsight")
    rows = {row.strategist: row for row in leaderboard(model, [fixed, hindsight])}
    assert rows["model"].gap_closed == pytest.approx(2 / 3)
    assert (rows["fixed"].gap_closed, rows["hindsight"].gap_closed) == (0, 1)
    assert all(row.gap_closed is None and row.gap_closed_ci95 is None for row in leaderboard(model, [fixed]))
    assert math.isnan(gap_closed({"fixed": fixed, "hindsight": fixed})["fixed"].value), "no gap"
