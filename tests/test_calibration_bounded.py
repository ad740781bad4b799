"""Believable ranges belong to the fit: what is fitted lies inside them, however little or odd the data."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rsrl.calibration.bounded import believable, truncated
from rsrl.calibration.pooling.pit import RATIO_RANGE, _combine, fit_tail
from rsrl.season import Figure
from rsrl.season.bounds import BOUNDS


def test_a_posterior_well_inside_is_left_as_it_is() -> None:
    figure = Figure(22.0, 0.5, 7, "note")
    assert believable(figure, "loss_green_s") is figure
    assert believable(Figure(0.0, 0.0, 0), "curvature_s_per_lap2") == Figure(0.0, 0.0, 0)


def test_a_posterior_across_an_edge_has_the_mean_of_what_is_inside() -> None:
    rng = np.random.default_rng(1)
    draws = rng.normal(0.05, 0.1, 400_000)
    inside = draws[(draws > 0.0) & (draws < 3.0)]
    found = truncated(Figure(0.05, 0.1, 3, "note"), 0.0, 3.0)
    assert found.value == pytest.approx(inside.mean(), abs=0.001)
    assert found.se == pytest.approx(inside.std(), abs=0.001)
    assert (found.n, found.note) == (3, "note")


@given(name=st.sampled_from(sorted(BOUNDS)), value=st.floats(-1e4, 1e4), se=st.just(0.0) | st.floats(1e-6, 1e3))
def test_any_figure_ends_inside_its_range(name: str, value: float, se: float) -> None:
    low, high = BOUNDS[name]
    found = believable(Figure(value, se, 1), name)
    assert low <= found.value <= high
    assert 0 <= found.se <= max(se, high - low)


def test_stops_under_safety_cars_that_cost_less_than_nothing_do_not_rule_the_figure() -> None:
    """The five such events of 2021, of which four had the field close up behind the cars that stopped."""
    value, se, n = _combine([-0.54, -0.61, -0.73, 0.89, -1.85], (15 / 28, 0.1), 0.6)
    assert n == 5
    assert 0.4 < value < 15 / 28
    assert 0.05 < se <= 0.1
    agreeing, _, _ = _combine([-1.0, -1.0, -1.0], (15 / 28, 0.1), 0.6)
    assert RATIO_RANGE[0] < agreeing < RATIO_RANGE[1]
    assert agreeing > 0.3
    assert _combine([], (0.5, 0.1), 0.6) == (0.5, 0.1, 0)


def test_slow_stops_are_those_of_the_prior_without_any_and_stay_near_it_with_few() -> None:
    scale, shape = fit_tail(np.array([]), np.array([]))
    assert [scale.value, shape.value] == pytest.approx([1.1, 2.3], rel=0.01)
    assert [scale.se, shape.se] == pytest.approx([0.4, 0.5], rel=0.05)
    few, _ = fit_tail(np.array([0.0, 0.4, 0.5]), np.full(3, 3.0))
    assert 0.5 < few.value < 1.1
