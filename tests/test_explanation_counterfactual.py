"""Nearest leaves against brute force, couplings against the closed form, and every counterfactual shown against the policy itself."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from rsrl.agents import ModelMetadata, NetworkAgent
from rsrl.agents.networks import NETWORKS
from rsrl.errors import RsrlError
from rsrl.explanation import ExplainedPolicy, Moment, load_explained, reach
from rsrl.explanation.counterfactual import (
    Boxes,
    Change,
    RaceEditor,
    Space,
    change_rows,
    explain_counterfactual,
    nearest_points,
    space_of,
    walk_leaves,
)
from rsrl.explanation.counterfactual.query import PolicyQuery
from rsrl.explanation.counterfactual.space import Norm, cost_of
from rsrl.explanation.fidelity.counterfactual import measure_counterfactual
from rsrl.season import RaceRecord, find_car
from rsrl.simulator import RaceBatch, compile_figures
from rsrl.state import ACTION_NAMES, COLUMN, Observer, input_names
from rsrl.strategists import Tree, TreeRows, tree_columns
from rsrl.translators import simulated_state

NORMS: tuple[Norm, ...] = ("l0", "l1", "l2")
STEPS = np.arange(-1, 7, dtype=np.float32)


def small_space(*, ordered: tuple[tuple[int, int], ...] = (), factor: float = 0.3) -> Space:
    """Two numbers, an integer that only rises, a category of two, and two columns of the clock."""
    return Space(
        names=("a", "b", "n", "c=x", "c=y", "left", "age"),
        low=np.array([0, 0, 2, 0, 0, -np.inf, -np.inf], np.float32),
        high=np.array([np.inf, np.inf, np.inf, 1, 1, np.inf, np.inf], np.float32),
        factor=np.array([1.0, factor, 0.5, 1.0, 1.0, 0.2, 0.1]),
        logarithmic=np.zeros(7, np.bool_),
        integer=np.array([False, False, True, True, True, True, True]),
        categories=((3, 4),),
        clock=(5, 6),
        clock_values=np.stack([9.0 - np.arange(5), 1.0 + np.arange(5)], axis=1).astype(np.float32),
        ordered=ordered,
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
    """Least cost of leaf i over every value that could be the best: the start, the bounds, for coupled columns each other's and their mean.

    The mean, weighted by the squares of the factors, is where two coupled columns meet at the least cost under l2.
    """
    low, high = box.low[i], box.high[i]
    mean = np.average(START[:2], weights=space.factor[:2] ** 2)
    ends = [START[0], START[1], mean, *np.nextafter(low[:2], np.float32(np.inf)), *high[:2]]
    numbers = np.array([v for v in ends if np.isfinite(v) and v >= 0.0], np.float64)
    a, b, n, category, lap = (v.ravel() for v in np.meshgrid(numbers, numbers, np.arange(2, 13), np.arange(2), np.arange(5)))
    points = np.stack([a, b, n, 1 - category, category, *space.clock_values[lap].T], axis=1).astype(np.float32)
    good = ((points > low) & (points <= high)).all(axis=1)
    for p, q in space.ordered:
        good &= points[:, q] >= points[:, p]
    no = np.zeros(len(points), np.bool_)
    moved = np.stack([points[:, 0] != START[0], points[:, 1] != START[1], n != 2, category != 0, no, lap > 0, no], axis=1)
    distance = np.abs(points - START).astype(np.float64) * space.factor
    distance[:, 3], distance[:, 4], distance[:, 6] = category, 0.0, 0.0
    return float(np.where(good, cost_of(distance, moved, norm), np.inf).min())


@given(boxes(), st.sampled_from(NORMS))
def test_the_nearest_point_of_every_leaf_is_as_near_as_brute_force_finds(box: Boxes, norm: Norm) -> None:
    space = small_space()
    near = nearest_points(START, box, space, norm)
    for i in range(len(box.leaf)):
        assert near.cost[i] == pytest.approx(brute_force(box, i, space, norm), abs=1e-6)
        if near.feasible[i]:
            assert ((near.points[i] > box.low[i]) & (near.points[i] <= box.high[i])).all()
            assert near.points[i, 2] >= 2
            assert near.points[i, 2] == int(near.points[i, 2])
            assert near.points[i, 5] + near.points[i, 6] == 10  # the clock's columns move together


@given(boxes(), st.sampled_from(NORMS))
def test_coupled_leaves_cost_what_brute_force_finds_and_come_in_order(box: Boxes, norm: Norm) -> None:
    space = small_space(ordered=((1, 0),))  # a is never less than b, which the start breaks
    walked = list(walk_leaves(START, box, space, norm))
    assert [f.cost for f in walked] == sorted(f.cost for f in walked)
    costs = {f.leaf: f.cost for f in walked}
    for i in range(len(box.leaf)):
        assert costs.get(i, np.inf) == pytest.approx(brute_force(box, i, space, norm), abs=2e-4)
    assert all(f.point[0] >= f.point[1] for f in walked)


@given(boxes(), st.sampled_from(NORMS))
def test_the_program_agrees_with_the_closed_form_where_nothing_is_coupled(box: Boxes, norm: Norm) -> None:
    plain = list(walk_leaves(START, box, small_space(), norm))
    loose = list(walk_leaves(START, box, small_space(ordered=((3, 3),)), norm))
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
    assert len(space.clock_values) == 30  # the last is the last decision
    assert (at("gap_ahead_s"), at("gap_to_leader_s")) in space.ordered
    tyre = next(i for i, g in enumerate(space.categories) if at("tyre=soft") in g)
    assert tyre in space.fixed_categories


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


def test_an_edited_race_is_observed_as_its_state_is(bahrain: RaceRecord, lap_10: Moment, observer: Observer) -> None:
    edited, states = RaceEditor(bahrain, lap_10.car, lap_10.arrays, observer).states(change_rows(CHANGES))
    assert edited.feasible.all()
    assert np.array_equal(edited.raw[0], lap_10.raw[-1])
    assert np.array_equal(edited.legal[0], lap_10.legal)
    batch = RaceBatch(compile_figures(bahrain), len(CHANGES), outside=(lap_10.car,))
    batch.f[:], batch.k[:], batch.r[:] = states
    for i in range(len(CHANGES)):
        assert np.array_equal(observer.row(simulated_state(bahrain, batch, i, lap_10.car)), edited.raw[i])


def test_a_change_does_what_it_says(bahrain: RaceRecord, lap_10: Moment, observer: Observer) -> None:
    edited, states = RaceEditor(bahrain, lap_10.car, lap_10.arrays, observer).states(change_rows(CHANGES))

    def of(name: str) -> NDArray[np.float32]:
        return edited.raw[:, COLUMN[name]]

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
    assert not edited.legal[7, 3]
    for f, k, r in zip(*states, strict=True):  # still a race: places and times agree
        order = k[0, : r[4]]
        assert (np.diff(f[0, order]) >= 0).all()
        assert (k[1, order] == np.arange(len(order))).all()


def test_an_infeasible_change_is_reported_as_such(bahrain: RaceRecord, lap_10: Moment, observer: Observer) -> None:
    editor = RaceEditor(bahrain, lap_10.car, lap_10.arrays, observer)
    assert not editor.edit(change_rows([Change(laps_later=bahrain.laps), Change(gap_ahead_s=-1.0)])).feasible.any()


@pytest.fixture(scope="module")
def tree(policy: ExplainedPolicy, bahrain: RaceRecord) -> Tree:
    """A small tree made by hand: the hard from lap 21 on behind a gap, the soft where the car ahead is close, else stay out."""
    columns = tuple(c.name for c in tree_columns("full"))
    return Tree(
        feature=np.array(
            [columns.index("laps_left"), columns.index("gap_behind_s"), columns.index("gap_ahead_s"), -1, -1, -1, -1], np.int32
        ),
        threshold=np.array([36.0, 4.0, 1.0, 0, 0, 0, 0], np.float32),
        left=np.array([1, 3, 5, -1, -1, -1, -1], np.int32),
        right=np.array([2, 4, 6, -1, -1, -1, -1], np.int32),
        action=np.array([0, 3, 0, 0, 3, 1, 0], np.int8),
        samples=np.ones((7, 4), np.int64),
        columns=columns,
        model_hash=policy.hash,
    )


def test_the_nearest_leaf_is_told_as_the_tree_has_it(policy: ExplainedPolicy, lap_10: Moment, tree: Tree, observer: Observer) -> None:
    x = TreeRows(tree.columns).of_race(lap_10.raw)[-1]
    explained = explain_counterfactual(policy, lap_10, tree, target="pit hard", observer=observer)
    nearest = explained.details["nearest_leaf"]
    row = x.copy()
    for change in nearest["changes"]:
        row[tree.columns.index(change["feature"])] = change["to"]
    row[tree.columns.index("tyre_age_laps")] += x[tree.columns.index("laps_left")] - row[tree.columns.index("laps_left")]
    assert tree.actions(row[None])[0] == 3
    assert nearest["changes"][0] == {"feature": "laps_left", "from": 48.0, "to": 36.0, "distance": pytest.approx(12 / 80)}
    assert nearest["features_changed"] == len(nearest["changes"])


@pytest.mark.parametrize("norm", NORMS)
def test_what_is_shown_is_the_policys_own_call(
    policy: ExplainedPolicy, lap_10: Moment, tree: Tree, bahrain: RaceRecord, observer: Observer, norm: Norm
) -> None:
    explained = explain_counterfactual(policy, lap_10, tree, norm=norm, observer=observer)
    target = ACTION_NAMES.index(explained.decision.alternative)
    assert explained.details["found"]
    assert explained.details["level"] == "consistent"
    assert explained.details["causes_changed"] == len(explained.labels) <= 2
    parts = dict(zip(explained.columns["cause"], explained.columns["to"], strict=True))
    parts = {k: {"none": 0, "virtual": 1, "full": 2}[v] if isinstance(v, str) else v for k, v in parts.items()}
    edited = RaceEditor(bahrain, lap_10.car, lap_10.arrays, observer).edit(change_rows([Change(**parts)]))
    q = policy.q_of_rows(policy.encoder(bahrain)(edited.raw))
    assert policy.chosen(q, edited.legal)[0] == target
    assert explained.details["q_values"] == pytest.approx(dict(zip(ACTION_NAMES, q[0].tolist(), strict=True)), abs=1e-3)
    assert explained.summary().startswith(("The policy would box for", "The policy would have boxed for"))
    assert "found" in explained.to_json()
    assert explained.to_json() == explain_counterfactual(policy, lap_10, tree, norm=norm, observer=observer).to_json()


def test_laps_from_now_are_the_first_on_which_the_policy_makes_the_call(
    policy: ExplainedPolicy, bahrain: RaceRecord, observer: Observer
) -> None:
    lap_12 = reach(policy.strategist(bahrain), bahrain, find_car(bahrain, "HAM"), 12, seed=5, race=0)
    explained = explain_counterfactual(policy, lap_12, None, target="pit hard", observer=observer)
    assert explained.columns["cause"] == ["laps_later"]
    laps = int(explained.columns["to"][0])
    edited = RaceEditor(bahrain, lap_12.car, lap_12.arrays, observer).edit(change_rows([Change(laps_later=n) for n in range(1, laps + 1)]))
    calls = policy.chosen(policy.q_of_rows(policy.encoder(bahrain)(edited.raw)), edited.legal)
    assert calls[-1] == 3
    assert not (calls[:-1] == 3).any()


def test_rollouts_are_the_same_twice_and_state_their_error(policy: ExplainedPolicy, lap_10: Moment, observer: Observer) -> None:
    first, second = (
        explain_counterfactual(policy, lap_10, None, target="pit hard", level="simulated", observer=observer) for _ in range(2)
    )
    assert first.to_json() == second.to_json()
    share = first.details["share"]
    assert 0.0 <= share["value"] <= 1.0
    assert share["standard_error"] == pytest.approx(np.sqrt(share["value"] * (1 - share["value"]) / share["runs"]))


def test_a_call_that_the_policy_never_makes_is_not_found(policy: ExplainedPolicy, lap_10: Moment, tree: Tree, observer: Observer) -> None:
    params = policy.agent.params | {"q.bias": policy.agent.params["q.bias"] - np.array([0, 0, 1000, 0], np.float32)}
    never = replace(policy, agent=replace(policy.agent, params=params))
    explained = explain_counterfactual(never, lap_10, tree, target="pit medium", observer=observer)
    assert not explained.details["found"]
    assert not len(explained.values)
    assert explained.summary().startswith("No change of up to three causes was found")
    assert "no leaf that can be reached" in explained.summary()


def test_one_legal_call_is_explained_as_such(policy: ExplainedPolicy, lap_10: Moment) -> None:
    only = Moment(lap_10.record, lap_10.car, 57, lap_10.raw, np.array([True, False, False, False]), lap_10.calls, lap_10.arrays)
    assert "only legal call" in explain_counterfactual(policy, only, None).summary()


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"target": "no pit"}, "already made"),
        ({"target": "pit wet"}, "no call 'pit wet'"),
        ({"norm": "l3"}, "norms are"),
        ({"level": "sure"}, "levels"),
        ({"level": "last-lap"}, "needs a tree"),
    ],
)
def test_bad_questions_are_answered_in_a_line(policy: ExplainedPolicy, lap_10: Moment, asked: dict[str, str], message: str) -> None:
    with pytest.raises(RsrlError, match=message):
        explain_counterfactual(policy, lap_10, None, **asked)  # type: ignore[arg-type]


def test_a_tree_of_another_model_is_refused(policy: ExplainedPolicy, lap_10: Moment, tree: Tree) -> None:
    with pytest.raises(RsrlError, match="another model"):
        explain_counterfactual(policy, lap_10, replace(tree, model_hash="0" * 16))


def test_a_policy_that_remembers_is_asked_with_a_history(lap_10: Moment, bahrain: RaceRecord, observer: Observer) -> None:
    rng, names = np.random.default_rng(3), input_names("paper")
    shape = NETWORKS["lstm"](len(names), 16)
    params = {name: rng.normal(0.0, 0.4, weights.shape).astype(np.float32) for name, weights in shape.init(rng).items()}
    agent = NetworkAgent("drqn", "paper", names, masked=False, network=shape, params=params)
    remembering = ExplainedPolicy(agent, ModelMetadata(config={"gamma": 0.99}), "lstm", Path(), "0" * 16)
    query = PolicyQuery(remembering, lap_10, RaceEditor(bahrain, lap_10.car, lap_10.arrays, observer))
    answers = query.ask(change_rows([Change(), Change(laps_later=2), Change(gap_ahead_s=0.7)]))
    assert np.allclose(answers.q[0], remembering.q(lap_10), atol=1e-5)
    assert not np.allclose(answers.q[1], answers.q[0])


def test_fidelity_counts_what_was_found(policy: ExplainedPolicy, bahrain: RaceRecord, tree: Tree) -> None:
    figures = measure_counterfactual(policy, bahrain, tree=tree, races=3, seed=11, simulate=0, driven=8)
    best = figures["best_other"]
    assert best["decisions"] == 3
    assert best["found"]["n"] == 3
    assert figures["driven"]["decisions"] == sum(figures["driven"][name]["called"] for name in ACTION_NAMES)
    assert best["causes_changed"]["n"] == round(best["found"]["value"] * 3)
    with pytest.raises(RsrlError, match="at least two"):
        measure_counterfactual(policy, bahrain, tree=tree, races=1)
