"""Causes of counterfactuals: laps as the policy calls them, time lost, another past; and which of them are tried when."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rsrl.agents import ModelMetadata, NetworkAgent
from rsrl.agents.networks import NETWORKS
from rsrl.explanation import EpisodeRecorder, ExplainedPolicy, Moment, load_explained, reach
from rsrl.explanation.counterfactual import Change, RaceEditor, change_rows, explain_counterfactual
from rsrl.explanation.counterfactual.change import CAUSE, PAST, PAST_CAUSES, EditedRaces
from rsrl.explanation.counterfactual.grid import EXCLUDED_PAIRS, Grid
from rsrl.explanation.counterfactual.query import Answers, PolicyQuery
from rsrl.season import SC, RaceRecord, find_car
from rsrl.simulator import layout as at
from rsrl.state import ACTION_NAMES, COLUMN, RAW_SIZE, Observer, input_names


@pytest.fixture(scope="module")
def policy() -> ExplainedPolicy:
    return load_explained("bahrain-2023")


@pytest.fixture(scope="module")
def lap_10(policy: ExplainedPolicy, bahrain: RaceRecord) -> Moment:
    return reach(policy.strategist(bahrain), bahrain, find_car(bahrain, "HAM"), 10, seed=5, race=0)


@pytest.fixture(scope="module")
def observer(bahrain: RaceRecord) -> Observer:
    return Observer(bahrain, find_car(bahrain, "HAM"))


@pytest.fixture
def editor(bahrain: RaceRecord, lap_10: Moment, observer: Observer) -> RaceEditor:
    return RaceEditor(bahrain, lap_10.car, lap_10.arrays, observer)


def test_laps_called_without_a_stop_are_laps_of_staying_out(editor: RaceEditor) -> None:
    called, later = editor.edit(change_rows([Change(laps_called=6)])), editor.edit(change_rows([Change(laps_later=6)]))
    assert np.array_equal(called.raw, later.raw)
    assert np.array_equal(called.legal, later.legal)


def test_a_stop_on_the_way_is_one(editor: RaceEditor, bahrain: RaceRecord) -> None:
    calls = np.zeros((3, bahrain.laps), np.int8)
    calls[1:, 2] = 3
    rows = change_rows([Change(laps_called=3), Change(laps_called=3), Change(laps_called=7)])
    (stayed, boxed, since), _, feasible = editor.edit(rows, calls)
    assert feasible.all()

    def of(row: np.ndarray, name: str) -> float:
        return float(row[COLUMN[name]])

    assert (of(boxed, "tyre"), of(boxed, "tyre_age_laps"), of(since, "tyre_age_laps")) == (2, 0, 4)
    assert of(boxed, "stops_made") == of(stayed, "stops_made") + 1
    assert of(boxed, "hard_sets") == of(stayed, "hard_sets") - 1
    assert of(boxed, "gap_to_leader_s") == pytest.approx(of(stayed, "gap_to_leader_s") + of(stayed, "pit_cost_s"), abs=1e-3)
    assert of(boxed, "position") > of(stayed, "position")
    assert of(boxed, "laps_left") == of(stayed, "laps_left")
    assert of(boxed, "last_lap_ratio") > of(stayed, "last_lap_ratio")


def test_a_safety_car_that_is_out_goes_in(bahrain: RaceRecord, lap_10: Moment, observer: Observer) -> None:
    f, k, r = lap_10.arrays[0], lap_10.arrays[1], lap_10.arrays[2].copy()
    r[at.R_STATUS], r[at.R_SINCE], r[at.R_LEFT] = SC, 0, 30
    raw = RaceEditor(bahrain, lap_10.car, (f, k, r), observer).edit(change_rows([Change(laps_later=n) for n in range(1, 5)])).raw
    assert raw[:, COLUMN["safety_car"]].tolist() == [2, 2, 0, 0]


@given(lost=st.floats(0.1, 60.0))
def test_time_lost_is_lost_to_all(lost: float, bahrain: RaceRecord, lap_10: Moment, observer: Observer) -> None:
    before = lap_10.raw[-1]
    edited, (f, k, r) = RaceEditor(bahrain, lap_10.car, lap_10.arrays, observer).states(change_rows([Change(time_lost_s=lost)]))
    raw = edited.raw[0]
    assert edited.feasible[0]
    assert raw[COLUMN["gap_to_leader_s"]] == pytest.approx(before[COLUMN["gap_to_leader_s"]] + lost, abs=1e-3)
    assert raw[COLUMN["closing_ahead_s"]] == pytest.approx(before[COLUMN["closing_ahead_s"]], abs=1e-3)
    times = lap_10.arrays[0][at.F_TIME] - lap_10.arrays[0][at.F_TIME, lap_10.car]
    running = lap_10.arrays[1][at.K_PLACE] < lap_10.arrays[2][at.R_RUNNING]
    fell_behind = (running & (times > 0) & (times < lost)).sum()
    assert raw[COLUMN["position"]] == before[COLUMN["position"]] + fell_behind
    assert (np.diff(f[0, at.F_TIME, k[0, at.K_ORDER, : r[0, at.R_RUNNING]]]) >= 0).all()


def test_the_compounds_used_are_what_the_rule_reads(editor: RaceEditor, lap_10: Moment) -> None:
    two = bool(lap_10.raw[-1, COLUMN["valid_finish"]])
    other, same = Change(compounds_used=1.0 if two else 2.0), Change(compounds_used=2.0 if two else 1.0)
    edited = editor.edit(change_rows([other, same]))
    assert edited.raw[0, COLUMN["valid_finish"]] == (not two)
    assert edited.feasible.tolist() == [True, False]


def test_no_set_is_older_than_race_and_qualifying_nor_than_sets_last(editor: RaceEditor, lap_10: Moment) -> None:
    assert lap_10.raw[-1, COLUMN["tyre_age_laps"]] == 9
    changes = [Change(laps_older=5), Change(laps_older=6), Change(laps_later=31), Change(laps_later=32)]
    feasible = editor.edit(change_rows([*changes, Change(laps_later=27, laps_older=5)])).feasible
    assert feasible.tolist() == [True, False, True, False, False]


def test_two_ways_to_the_same_lap_are_infeasible(editor: RaceEditor) -> None:
    assert not editor.edit(change_rows([Change(laps_later=3, laps_called=3), Change(time_lost_s=0.0)])).feasible.any()


@pytest.mark.parametrize("past", [Change(), Change(hard_sets=0.0)])
def test_laps_called_are_called_by_the_policy_lap_by_lap(
    policy: ExplainedPolicy, bahrain: RaceRecord, lap_10: Moment, editor: RaceEditor, past: Change
) -> None:
    row = change_rows([past])
    row[0, CAUSE["laps_called"]] = 1
    calls = PolicyQuery(policy, lap_10, editor).calls_of(row)
    assert calls is not None
    encode, driven = policy.encoder(bahrain), np.zeros((1, bahrain.laps), np.int8)
    for lap in range(int(lap_10.raw[-1, COLUMN["laps_left"]])):
        row[0, CAUSE["laps_called"]] = lap or np.nan
        edited = editor.edit(row, driven)
        driven[0, lap] = policy.chosen(policy.q_of_rows(encode(edited.raw)), edited.legal)[0]
    assert np.array_equal(calls, driven)
    assert driven.any()


def test_the_only_legal_call_is_no_choice() -> None:
    legal = np.array([[False, False, True, False], [False, True, True, False], [True, True, False, True]])
    races = EditedRaces(np.zeros((3, RAW_SIZE), np.float32), legal, np.ones(3, np.bool_))
    q = np.array([[0, 0, 1, 0], [0, 0, 1, 0], [0, 0, 1, 0]], np.float32)
    answers = Answers(q, np.full(3, 2, np.int8), races)
    assert answers.confirm(2).tolist() == [False, True, False]
    assert answers.shortfall(1).tolist() == [np.inf, 1.0, 0.0]
    assert answers.shortfall(2).tolist() == [0.0, 0.0, np.inf]


@pytest.mark.parametrize("target", [0, 1, 2])
def test_candidates_have_as_many_causes_as_asked_for(lap_10: Moment, bahrain: RaceRecord, target: int) -> None:
    calls = np.zeros(bahrain.laps, np.int8)
    calls[8] = 3
    grid = Grid(lap_10.raw[-1], target, calls)
    for past in (False, True):
        for causes, rows in ((1, grid.singles(past=past)), (2, grid.pairs(past=past))):
            assert ((~np.isnan(rows)).sum(axis=1) == causes).all()
            assert ((~np.isnan(rows[:, PAST])).any(axis=1) == past).all()
            assert len(np.unique(rows, axis=0, equal_nan=True)) == len(rows)
    pairs = grid.pairs(past=True)
    third = grid.with_another_cause(pairs[[0, -1]])
    assert ((~np.isnan(third)).sum(axis=1) == 3).all()
    for one, other in EXCLUDED_PAIRS:
        assert not (~np.isnan(third[:, [one, other]])).all(axis=1).any()
    assert (target > 0) == (~np.isnan(pairs[:, CAUSE["laps_later"]])).any()  # staying out is not waited for


def test_a_call_without_a_set_for_it_needs_one(lap_10: Moment, bahrain: RaceRecord) -> None:
    raw = lap_10.raw[-1].copy()
    raw[[COLUMN["medium_sets"], COLUMN["medium_available"]]] = 0
    grid = Grid(raw, 2, np.zeros(bahrain.laps, np.int8))
    assert not len(grid.singles(past=False))
    assert not len(grid.pairs(past=False))
    assert (grid.singles(past=True)[:, CAUSE["medium_sets"]] == 1).all()


@pytest.mark.parametrize("liked", [0.0, 0.9])
def test_a_counterfactual_of_another_past_is_worded_as_one(
    policy: ExplainedPolicy, lap_10: Moment, bahrain: RaceRecord, observer: Observer, liked: float
) -> None:
    short = policy.q(lap_10).max() - policy.q(lap_10)[2]
    params = policy.agent.params | {"q.bias": policy.agent.params["q.bias"] + np.array([0, 0, liked * short, 0], np.float32)}
    policy = replace(policy, agent=replace(policy.agent, params=params))
    explained = explain_counterfactual(policy, lap_10, None, target="pit medium", observer=observer)
    parts = dict(zip(explained.columns.get("cause", ()), explained.columns.get("to", ()), strict=True))
    assert bool(parts) == explained.details["found"]
    assert liked == 0.0 or parts  # nearly called as it is
    if not parts:
        return
    parts = {k: {"none": 0, "virtual": 1, "full": 2}[v] if isinstance(v, str) else v for k, v in parts.items()}
    calls = np.zeros((1, bahrain.laps), np.int8)
    if "laps_called" in parts:
        for stop in explained.details["stops_on_the_way"]:
            calls[0, stop["laps_from_now"]] = ACTION_NAMES.index(stop["call"])
    edited = RaceEditor(bahrain, lap_10.car, lap_10.arrays, observer).edit(change_rows([Change(**parts)]), calls)
    q = policy.q_of_rows(policy.encoder(bahrain)(edited.raw))
    assert ACTION_NAMES[policy.chosen(q, edited.legal)[0]] == "pit medium"
    assert explained.details["reachable"] == (not set(parts) & set(PAST_CAUSES))
    assert ("policy would have " in explained.summary()) == (not explained.details["reachable"])
    assert ("no choice but a stop" in explained.summary()) == (not edited.legal[0, 0]) == explained.details["forced"]


def test_a_recurrent_policy_answers_a_batch_as_one_by_one(lap_10: Moment, editor: RaceEditor) -> None:
    rng, names = np.random.default_rng(3), input_names("paper")
    shape = NETWORKS["lstm"](len(names), 16)
    params = {name: rng.normal(0.0, 0.4, weights.shape).astype(np.float32) for name, weights in shape.init(rng).items()}
    agent = NetworkAgent("drqn", "paper", names, masked=False, network=shape, params=params)
    remembering = ExplainedPolicy(agent, ModelMetadata(config={"gamma": 0.99}), "lstm", Path(), "0" * 16)
    query = PolicyQuery(remembering, lap_10, editor)
    rows = change_rows(
        [Change(laps_later=2), Change(gap_ahead_s=0.7), Change(laps_called=5), Change(laps_later=2, laps_older=4), Change(compounds_used=2)]
    )
    together = query.ask(rows).q
    assert np.allclose(together, np.concatenate([query.ask(row[None]).q for row in rows]), atol=1e-5)
    assert not np.allclose(together[0], together[3])


def test_calls_are_counted_as_they_are_made(policy: ExplainedPolicy, bahrain: RaceRecord) -> None:
    car = find_car(bahrain, "HAM")
    met = EpisodeRecorder(bahrain, car, 4, policy).record(1003)
    calls_made, legal_calls = np.bincount(met.calls[met.choices], minlength=4), met.legal[met.choices].sum(axis=0)
    decisions = called = 0
    moment = None
    for race in range(4):
        moment = reach(policy.strategist(bahrain), bahrain, car, 20, seed=1003, race=race)
        called += int((moment.calls > 0).sum())
        decisions += len(moment.calls)
        assert met.covers(moment.raw[-1])
    assert calls_made[1:].sum() >= called
    assert met.choices.sum() > decisions
    assert (legal_calls >= calls_made).all()
    assert moment is not None
    assert not met.covers(moment.raw[-1] + 1000.0)
