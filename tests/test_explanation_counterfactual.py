"""Nearest leaves against brute force, couplings against the closed form, and every counterfactual shown against the policy itself."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from rsrl.explanation import ExplainedPolicy, Moment, load_explained, reach
from rsrl.explanation.counterfactual import (
    Alterer,
    Boxes,
    Change,
    Space,
    change_rows,
    nearest_points,
    space_of,
    walk_leaves,
)
from rsrl.explanation.counterfactual.nearest import Norm, cost_of
from rsrl.season import RaceRecord, find_car
from rsrl.simulator import RaceBatch, compile_figures
from rsrl.state import COLUMN, Observer
from rsrl.strategists import tree_columns
from rsrl.translators import simulated_state

NORMS: tuple[Norm, ...] = ("l0", "l1", "l2")
STEPS = np.arange(-1, 7, dtype=np.float32)


def small_space(*, orders: tuple[tuple[int, int], ...] = (), factor: float = 0.3) -> Space:
    """Two numbers, a whole one that only rises, a category of two, and two columns of the clock."""
    return Space(
        names=("a", "b", "n", "c=x", "c=y", "left", "age"),
        low=np.array([0, 0, 2, 0, 0, -np.inf, -np.inf], np.float32),
        high=np.array([np.inf, np.inf, np.inf, 1, 1, np.inf, np.inf], np.float32),
        factor=np.array([1.0, factor, 0.5, 1.0, 1.0, 0.2, 0.1]),
        logarithmic=np.zeros(7, np.bool_),
        whole=np.array([False, False, True, True, True, True, True]),
        groups=((3, 4),),
        clock=(5, 6),
        laps=np.stack([9.0 - np.arange(5), 1.0 + np.arange(5)], axis=1).astype(np.float32),
        orders=orders,
    )


START = np.array([2.0, 3.0, 2.0, 1.0, 0.0, 9.0, 1.0], np.float32)


@st.composite
def boxes(draw: st.DrawFn) -> Boxes:
    """A few leaves with whole or open bounds."""
    n = draw(st.integers(1, 5))
    low, high = np.full((n, 7), -np.inf, np.float32), np.full((n, 7), np.inf, np.float32)
    for i in range(n):
        for c in range(7):
            where = draw(st.sampled_from(("free", "free", "above", "below", "between")))
            threshold = 0.5 if c in (3, 4) else draw(st.integers(0, 9)) + 0.5 * draw(st.integers(0, 1))
            if where in ("above", "between"):
                low[i, c] = threshold
            if where in ("below", "between") and c not in (3, 4):
                high[i, c] = threshold + (2.0 if where == "between" else 0.0)
            if where == "below" and c in (3, 4):
                high[i, c] = threshold
    return Boxes(low, high, np.arange(n))


def brute_force(box: Boxes, i: int, space: Space, norm: Norm) -> float:
    """Least cost of leaf i over every value that could be the best: the start, the bounds, and for coupled columns each other's."""
    best = np.inf
    options: list[list[float]] = []
    for _c in range(2):
        low, high = box.low[i], box.high[i]
        ends = [np.nextafter(low[d], np.float32(np.inf)) for d in (0, 1)] + [high[0], high[1]]
        options.append([float(v) for v in (START[0], START[1], *ends) if np.isfinite(v) and v >= 0.0])
    for a, b, n, category, lap in product(options[0], options[1], range(2, 12), range(2), range(5)):
        point = np.array([a, b, n, 1 - category, category, *space.laps[lap]], np.float32)
        if not ((point > box.low[i]) & (point <= box.high[i])).all() or any(point[q] < point[p] for p, q in space.orders):
            continue
        moved = np.array([point[0] != START[0], point[1] != START[1], n != 2, category != 0, False, lap > 0, False])
        distance = np.abs(point - START).astype(np.float64) * space.factor
        distance[3], distance[4], distance[6] = float(category), 0.0, 0.0
        best = min(best, float(cost_of(distance, moved, norm)))
    return best


@given(boxes(), st.sampled_from(NORMS))
def test_the_nearest_point_of_every_leaf_is_as_near_as_brute_force_finds(box: Boxes, norm: Norm) -> None:
    space = small_space()
    near = nearest_points(START, box, space, norm)
    for i in range(len(box.leaf)):
        assert near.cost[i] == pytest.approx(brute_force(box, i, space, norm), abs=1e-6)
        if near.possible[i]:
            assert ((near.points[i] > box.low[i]) & (near.points[i] <= box.high[i])).all()
            assert near.points[i, 2] >= 2
            assert near.points[i, 2] == int(near.points[i, 2])
            assert near.points[i, 5] + near.points[i, 6] == 10  # the clock's columns move together


@given(boxes(), st.sampled_from(NORMS))
def test_coupled_leaves_cost_what_brute_force_finds_and_come_in_order(box: Boxes, norm: Norm) -> None:
    space = small_space(orders=((1, 0),))  # a is never less than b, which the start breaks
    walked = list(walk_leaves(START, box, space, norm))
    assert [f.cost for f in walked] == sorted(f.cost for f in walked)
    costs = {f.leaf: f.cost for f in walked}
    for i in range(len(box.leaf)):
        assert costs.get(i, np.inf) == pytest.approx(brute_force(box, i, space, norm), abs=2e-4)
    assert all(f.point[0] >= f.point[1] for f in walked)


@given(boxes(), st.sampled_from(NORMS))
def test_the_program_answers_as_the_closed_form_where_nothing_is_coupled(box: Boxes, norm: Norm) -> None:
    plain = list(walk_leaves(START, box, small_space(), norm))
    loose = list(walk_leaves(START, box, small_space(orders=((3, 3),)), norm))
    near = nearest_points(START, box, small_space(), norm)
    assert [f.leaf for f in plain] == near.order().tolist()
    assert [f.cost for f in plain] == [f.cost for f in loose]


def test_what_a_row_may_do_follows_from_its_features(bahrain: RaceRecord) -> None:
    names = [c.name for c in tree_columns("full")]
    x = np.zeros(len(names), np.float32)
    for name, value in {"laps_left": 30.0, "tyre_age_laps": 7.0, "stops_made": 1.0, "tyre=soft": 1.0, "safety_car=none": 1.0}.items():
        x[names.index(name)] = value
    space = space_of(names, x, bahrain, "full")
    at = names.index
    assert space.low[at("stops_made")] == space.high[at("stops_made")] == 1.0
    assert space.high[at("laps_left")] == 30.0
    assert space.low[at("tyre_age_laps")] == 7.0
    assert space.logarithmic[at("gap_ahead_s")]
    assert not space.logarithmic[at("laps_left")]
    assert {space.names[c] for c in space.clock} == {"laps_left", "tyre_age_laps"}
    assert len(space.laps) == 30  # the last is the last decision
    assert (at("gap_ahead_s"), at("gap_to_leader_s")) in space.orders
    tyre = next(i for i, g in enumerate(space.groups) if at("tyre=soft") in g)
    assert tyre in space.fixed_groups


@pytest.fixture(scope="module")
def policy() -> ExplainedPolicy:
    return load_explained("bahrain-2023")


@pytest.fixture(scope="module")
def lap_10(policy: ExplainedPolicy, bahrain: RaceRecord) -> Moment:
    return reach(policy.strategist(bahrain), bahrain, find_car(bahrain, "HAM"), 10, seed=5, race=0)


@pytest.fixture(scope="module")
def observer(bahrain: RaceRecord) -> Observer:
    return Observer(bahrain, find_car(bahrain, "HAM"))


CHANGES = [
    Change(),
    Change(laps_later=3),
    Change(gap_ahead_s=0.7, gap_behind_s=9.0),
    Change(gap_ahead_s=30.0),
    Change(laps_later=2, gap_behind_s=4.1, track_status=2),
    Change(laps_older=4, boxed_behind=1),
    Change(boxed_ahead=1),
    Change(hard_sets=0, track_status=1),
]


def test_a_changed_race_reads_as_its_state_does(bahrain: RaceRecord, lap_10: Moment, observer: Observer) -> None:
    altered, states = Alterer(bahrain, lap_10.car, lap_10.arrays, observer).states(change_rows(CHANGES))
    assert altered.possible.all()
    assert np.array_equal(altered.raw[0], lap_10.raw[-1])
    assert np.array_equal(altered.legal[0], lap_10.legal)
    batch = RaceBatch(compile_figures(bahrain), len(CHANGES), outside=(lap_10.car,))
    batch.f[:], batch.k[:], batch.r[:] = states
    for i in range(len(CHANGES)):
        assert np.array_equal(observer.row(simulated_state(bahrain, batch, i, lap_10.car)), altered.raw[i])


def test_a_change_does_what_it_says(bahrain: RaceRecord, lap_10: Moment, observer: Observer) -> None:
    altered, states = Alterer(bahrain, lap_10.car, lap_10.arrays, observer).states(change_rows(CHANGES))

    def of(name: str) -> NDArray[np.float32]:
        return altered.raw[:, COLUMN[name]]

    assert of("laps_left")[1] == of("laps_left")[0] - 3
    assert of("tyre_age_laps")[1] == of("tyre_age_laps")[0] + 3
    assert of("gap_ahead_s")[2] == pytest.approx(0.7, abs=1e-4)
    assert of("gap_behind_s")[2] == pytest.approx(9.0, abs=1e-4)
    assert of("gap_ahead_s")[3] == pytest.approx(30.0, abs=1e-4)
    assert of("gap_behind_s")[4] == pytest.approx(4.1, abs=1e-4)
    assert of("safety_car")[4] == 2
    assert of("closing_ahead_s")[2] == pytest.approx(of("closing_ahead_s")[0], abs=1e-3)
    assert of("tyre_age_laps")[5] == of("tyre_age_laps")[0] + 4
    assert of("boxed_ahead")[6] == 0
    assert of("position")[6] == of("position")[0] - 1
    assert of("hard_sets")[7] == 0
    assert not altered.legal[7, 3]
    for f, k, r in zip(*states, strict=True):  # still a race: places and times agree
        order = k[0, : r[4]]
        assert (np.diff(f[0, order]) >= 0).all()
        assert (k[1, order] == np.arange(len(order))).all()


def test_an_impossible_change_is_said_to_be(bahrain: RaceRecord, lap_10: Moment, observer: Observer) -> None:
    alterer = Alterer(bahrain, lap_10.car, lap_10.arrays, observer)
    assert not alterer(change_rows([Change(laps_later=bahrain.laps), Change(gap_ahead_s=-1.0)])).possible.any()
