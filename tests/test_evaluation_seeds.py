"""Several seeds of a model against a strategist: figures worked by hand."""

import dataclasses

import numpy as np
import pytest
from test_evaluation_paired import log_of

from rsrl.errors import RsrlError
from rsrl.evaluation import over_seeds
from rsrl.results import known
from rsrl.statistics import mean_over_seeds


def test_seeds_together_by_hand() -> None:
    models = [log_of([1, 2, 3, 4], "a"), log_of([3, 2, 5, 6], "b")]
    other = log_of([2, 2, 9, 5], "fixed")
    result = over_seeds(models, [other])
    together = result.aggregate
    assert (together.seeds, together.mean_position) == (2, 3.25)
    assert together.iqm_position == 3.25
    (fixed,) = together.comparisons
    assert fixed.difference == pytest.approx(4.5 - 3.25)
    expected = mean_over_seeds(np.array([[1, 0, 6, 1], [-1, 0, 4, -1]]))
    assert fixed.difference_ci95 == expected.ci95
    # a: ahead, level, ahead, ahead; b: behind, level, ahead, behind
    assert fixed.p_better == pytest.approx((3.5 + 1.5) / 8)
    low, high = known(fixed.p_better_ci95) or (1.0, 0.0)
    assert low <= fixed.p_better <= high
    rows = {row.strategist: row for row in result.rows}
    assert [row.strategist for row in result.rows] == ["a", "b", "fixed"]
    assert (rows["a"].difference, rows["b"].difference) == (-0.75, 0.75)
    # its own races count as ties
    assert rows["a"].p_better == pytest.approx((2 + 0 + 0.5) / 8)
    assert (rows["fixed"].difference, rows["fixed"].p_better) == (fixed.difference, fixed.p_better)


def test_what_does_not_belong_together_is_refused() -> None:
    one = log_of([1, 2, 3], "a")
    with pytest.raises(RsrlError, match="not run on the same races"):
        over_seeds([one, log_of([1, 2], "b")])
    with pytest.raises(RsrlError, match="same name"):
        over_seeds([one, dataclasses.replace(one)])
    with pytest.raises(RsrlError, match="no models"):
        over_seeds([])
