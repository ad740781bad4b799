"""The surrogate tree: what it reads, that a known rule is found again, its figures, its words, and its files."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rsrl.agents import ModelMetadata, default_config
from rsrl.agents.interface import NetworkAgent
from rsrl.agents.networks import NETWORKS
from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.explanation import ExplainedPolicy, reach
from rsrl.explanation.fidelity.tree import measure_tree
from rsrl.explanation.tree import (
    FittedTree,
    TreeRecorder,
    explain_tree,
    find_tree,
    fit_tree,
    label_figures,
    merge_path,
    store_tree,
    tree_text,
)
from rsrl.explanation.tree.dataset import Samples
from rsrl.explanation.tree.draw import plot_tree
from rsrl.explanation.tree.fit import grow
from rsrl.explanation.tree.metrics import agreement, found_within_a_lap
from rsrl.explanation.tree.path import range_words, whole_words
from rsrl.report.tree_page import tree_page
from rsrl.season import RaceRecord
from rsrl.state import COLUMN, NO_CAR_GAP_S, RAW_SIZE, input_names
from rsrl.strategists import TreeRows, TreeStrategist, load_tree, make_strategist, tree_columns, tree_from_classifier, weights_hash
from rsrl.strategists.tree import save_tree
from rsrl.strategists.tree.tree import LEAF, Tree, float32_at_most

CAR = 6
LONGEST_STINT = 20


def made_policy(folder: Path, kind: str, fill: Callable[[dict[str, np.ndarray], tuple[str, ...]], None]) -> ExplainedPolicy:
    names = input_names(default_config(kind).feature_set)
    network = NETWORKS["lstm" if kind == "drqn" else "duelling"](len(names), 4)
    params = {name: np.asarray(value, np.float32) for name, value in network.init(np.random.default_rng(3)).items()}
    fill(params, names)
    agent = NetworkAgent(kind, default_config(kind).feature_set, names, True, network, params)
    return ExplainedPolicy(agent, ModelMetadata(), "toy", folder, weights_hash(agent))


@pytest.fixture(scope="module")
def by_age(tmp_path_factory: pytest.TempPathFactory) -> ExplainedPolicy:
    """A policy with a rule a tree can say: once the set has done more than 20 laps box for hard, where it is hard for soft."""

    def fill(params: dict[str, np.ndarray], names: tuple[str, ...]) -> None:
        late = (LONGEST_STINT + 0.5) / 40.0  # ages are scaled by 40 laps
        params["q.bias"][:] = (0.0, -late - 2.0, -9.0, -late)
        params["skip.weight"][names.index("tyre_age_laps"), 1:] = (1.0, 0.0, 1.0)
        params["skip.weight"][names.index("tyre=hard"), 1:] = (2.0, 0.0, -2.0)

    return made_policy(tmp_path_factory.mktemp("by_age"), "rsrl", fill)


@pytest.fixture(scope="module")
def fitted(by_age: ExplainedPolicy, bahrain: RaceRecord) -> FittedTree:
    return fit_tree(by_age, bahrain, CAR, iterations=2, races=32, leaves=8)


def random_tree(
    seed: int = 0, leaves: int = 20, columns: tuple[str, ...] = ("laps_left", "gap_ahead_s", "position")
) -> tuple[Tree, np.ndarray]:
    """A tree of random labels, and the rows it was fitted to; many of them lie on its thresholds."""
    from sklearn.tree import DecisionTreeClassifier

    rng = np.random.default_rng(seed)
    rows = rng.integers(0, 12, (400, len(columns))).astype(np.float32) / np.float32(3)
    labels = rng.integers(0, 4, 400).astype(np.int8)
    classifier = DecisionTreeClassifier(max_leaf_nodes=leaves, random_state=0).fit(rows, labels)
    tree = tree_from_classifier(classifier, columns).counted(rows, labels)
    np.testing.assert_array_equal(tree.actions(rows), classifier.predict(rows))
    return tree, rows


def test_a_tree_keeps_its_answers_when_merged_saved_and_read_again(tmp_path: Path) -> None:
    tree, rows = random_tree()
    tree = replace(tree, action=np.where(tree.action > 0, 3, 0).astype(np.int8))  # leaves side by side answer alike now and then
    merged = tree.merged()
    assert len(merged.leaves) < len(tree.leaves)
    save_tree(merged, tmp_path / "tree.json")
    again = load_tree(tmp_path / "tree.json")
    for other in (merged, again):
        np.testing.assert_array_equal(other.actions(rows), tree.actions(rows))
    assert again.samples.sum(axis=1)[0] == 400
    np.testing.assert_array_equal(again.threshold, merged.threshold)


def test_boxes_of_leaves_part_all_rows_and_paths_lead_to_them() -> None:
    tree, rows = random_tree(1)
    rows = np.concatenate([rows, tree.threshold[tree.feature != LEAF][:, None].repeat(3, axis=1)])  # on the thresholds
    lower, upper = tree.leaf_boxes()
    inside = ((lower[None] < rows[:, None]) & (rows[:, None] <= upper[None])).all(axis=2)
    assert (inside.sum(axis=1) == 1).all()
    np.testing.assert_array_equal(tree.leaves[inside.argmax(axis=1)], tree.leaf_nodes(rows))
    for row in rows[::37]:
        node = 0
        for condition in tree.path(row):
            assert (row[condition.column] <= np.float32(condition.threshold)) == condition.at_most
            node = tree.left[node] if condition.at_most else tree.right[node]
        assert node == tree.leaf(row)


@given(st.floats(-1e6, 1e6), st.integers(-3, 3))
def test_a_double_threshold_parts_singles_as_before(threshold: float, steps: int) -> None:
    value = np.float32(threshold)
    for _ in range(abs(steps)):
        value = np.nextafter(value, np.float32(math.copysign(np.inf, steps)))
    single = float32_at_most(np.array([threshold]))[0]
    assert (value <= single) == (float(value) <= threshold)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"format": 9}, "format 1"),
        ({"nodes": {"feature": [0]}}, "not a whole tree"),
        ({"columns": []}, "nodes are inconsistent"),
        ({"columns": 3}, "not a whole tree"),
    ],
)
def test_a_broken_file_is_named(tmp_path: Path, change: dict[str, object], said: str) -> None:
    tree, _ = random_tree()
    path = tmp_path / "tree.json"
    save_tree(tree, path)
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(RsrlError, match=said) as raised:
        load_tree(path)
    assert "tree.json" in str(raised.value)


def test_no_json_and_another_models_tree_are_named(tmp_path: Path) -> None:
    tree, _ = random_tree()
    path = tmp_path / "tree.json"
    save_tree(replace(tree, model_hash="aaaa"), path)
    with pytest.raises(RsrlError, match="another model, aaaa; the policy asked for is bbbb"):
        load_tree(path, "bbbb")
    path.write_text("{")
    with pytest.raises(RsrlError, match="not a tree file"):
        load_tree(path)


def raced(record: RaceRecord, races: int = 16) -> np.ndarray:
    """Raw rows [T, R, RAW_SIZE] of races in which a stop is called now and then."""
    environment = RaceEnvironment(record, CAR, batch=races)
    environment.reset(5, np.arange(races, dtype=np.int64))
    rows = []
    for lap in range(environment.laps):
        rows.append(environment.raw.copy())
        box = environment.legal[:, 3] & ((lap + np.arange(races)) % 19 == 18)
        environment.step(np.where(box, 3, 0).astype(np.int8))
    return np.stack(rows)


@pytest.mark.parametrize("features", ["full", "paper", "named"])
def test_columns_are_what_they_say(bahrain: RaceRecord, features: str) -> None:
    columns = tree_columns(features)
    made = TreeRows([c.name for c in columns])
    raw = raced(bahrain)
    made.begin(raw.shape[1])
    rows = np.concatenate([made(lap) for lap in raw])
    assert np.isfinite(rows).all()
    by_feature: dict[str, list[int]] = {}
    for i, column in enumerate(columns):
        if column.whole:
            np.testing.assert_array_equal(rows[:, i], np.rint(rows[:, i]), err_msg=column.name)
        if column.category:
            by_feature.setdefault(column.feature, []).append(i)
    assert {"tyre", "safety_car"} <= set(by_feature)
    for group in by_feature.values():
        assert (rows[:, group].sum(axis=1) == 1).all()
    names = {c.name for c in columns}
    assert {"laps_left", "tyre_age_laps", "mean_last_laps_ratio"} <= names
    assert not names & {"track", "race_progress", "pit_loss_s", "grid"}
    assert len(names) == len(columns)


def test_figures_of_the_race_are_read_by_a_tree_for_several(bahrain: RaceRecord) -> None:
    assert {"pit_loss_s", "grid"} <= {c.name for c in tree_columns("full", one_race=False)}


def test_what_the_laps_before_tell(bahrain: RaceRecord) -> None:
    raced_by_all = raced(bahrain)
    beside = (raced_by_all[[15, 18], :, COLUMN["gap_ahead_s"]] < NO_CAR_GAP_S).all(axis=0)
    longest = (raced_by_all[18, :, COLUMN["tyre_age_laps"]] > 8) & (raced_by_all[18, :, COLUMN["laps_left"]] == bahrain.laps - 18)
    raw = raced_by_all[:, np.flatnonzero(beside & longest)[:1]]
    rows = TreeRows(["mean_last_laps_ratio", "stint_slope_percent", "gap_ahead_trend_s", "expected_stop_gain_s"]).of_race(raw[:, 0])
    ratio, stops = raw[:, 0, COLUMN["last_lap_ratio"]], raw[:, 0, COLUMN["stops_made"]]
    gap = raw[:, 0, COLUMN["gap_ahead_s"]]
    lap = 18
    begun = int(np.flatnonzero(stops == stops[lap])[0])
    driven = np.arange(max(begun + 1, 1), lap + 1)  # the out-lap is left out; nothing is driven before row 1
    assert len(driven) > 5
    assert rows[lap, 0] == pytest.approx(ratio[lap - 4 : lap + 1].mean(), rel=1e-6)
    assert rows[lap, 1] == pytest.approx(100 * np.polyfit(driven, ratio[driven].astype(float), 1)[0], rel=1e-4, abs=1e-6)
    assert rows[lap, 2] == pytest.approx((gap[lap] - gap[lap - 3]) / 3, abs=1e-5)
    stop = [raw[lap, 0, COLUMN[f"expected_{c}_s"]] for c in ("soft", "medium", "hard")]
    assert rows[lap, 3] == raw[lap, 0, COLUMN["expected_stay_s"]] - min(stop)
    assert rows[0].tolist()[:3] == [1.0, 0.0, 0.0]


def test_a_peek_changes_nothing(bahrain: RaceRecord) -> None:
    raw = raced(bahrain)
    one, other = TreeRows(["mean_last_laps_ratio", "gap_behind_trend_s"]), TreeRows(["mean_last_laps_ratio", "gap_behind_trend_s"])
    one.begin(raw.shape[1])
    other.begin(raw.shape[1])
    for t in range(8):
        seen = one.peek(raw[t])
        np.testing.assert_array_equal(seen, other(raw[t]))
        np.testing.assert_array_equal(one(raw[t]), seen)


def test_a_rule_is_found_again_and_driven(fitted: FittedTree, by_age: ExplainedPolicy, bahrain: RaceRecord) -> None:
    """The policy's rule is one question; with the shield the tree then drives every race as the policy does."""
    tree = fitted.tree
    figures = measure_tree(by_age, bahrain, tree=tree, car=CAR, races=64, seed=555, others=("fixed",), depths=2)
    assert figures["labels"]["accuracy"] == figures["labels"]["macro_f1"] == figures["labels"]["kappa"] == 1.0
    assert figures["labels"]["majority"] < 1.0
    assert figures["stops"]["within_one_lap"]["value"] == figures["own_states"]["stops_shared_within_one_lap"]["value"] == 1.0
    assert figures["own_states"]["agreement"] == 1.0
    assert figures["behind_policy"] == {"value": 0.0, "ci95": [0.0, 0.0]}
    assert figures["position"]["tree"] == figures["position"]["policy"]
    assert figures["depth_curve"][-1]["accuracy"] == 1.0
    assert any(
        name == "tyre_age_laps" and LONGEST_STINT <= threshold < LONGEST_STINT + 1
        for name, threshold in zip((tree.columns[f] for f in tree.feature if f != LEAF), tree.threshold[tree.feature != LEAF], strict=True)
    )
    json.dumps(figures, allow_nan=False)


def test_a_fit_is_a_function_of_its_seed(fitted: FittedTree, by_age: ExplainedPolicy, bahrain: RaceRecord) -> None:
    again = fit_tree(by_age, bahrain, CAR, iterations=2, races=32, leaves=8)
    assert again.curve == fitted.curve
    np.testing.assert_array_equal(again.tree.threshold, fitted.tree.threshold)
    assert [c["leaves"] <= 8 for c in fitted.curve] == [True, True]


def test_figures_of_labels_by_hand() -> None:
    policy, tree = np.array([0, 0, 0, 0, 3, 3, 1, 0], np.int8), np.array([0, 0, 0, 3, 3, 0, 1, 0], np.int8)
    figures = label_figures(policy, tree)
    assert figures.confusion[3].tolist() == [1, 0, 0, 1]
    assert figures.accuracy == 6 / 8
    assert figures.majority == 5 / 8
    assert figures.f1["pit medium"] is None
    assert figures.macro_f1 == pytest.approx((2 * 4 / 10 + 1 + 2 * 1 / 4) / 3)
    chance = (5 * 5 + 2 * 2 + 1) / 64
    assert figures.kappa == pytest.approx((6 / 8 - chance) / (1 - chance))


def test_never_stopping_is_no_better_than_chance() -> None:
    policy = np.array([0] * 93 + [3] * 7, np.int8)
    figures = label_figures(policy, np.zeros(100, np.int8))
    assert figures.accuracy == figures.majority
    assert figures.kappa == 0.0
    assert figures.macro_f1 < 0.5


def test_stops_are_found_a_lap_early_on_the_lap_and_a_lap_late(by_age: ExplainedPolicy, bahrain: RaceRecord) -> None:
    driven = TreeRecorder(by_age, bahrain, CAR, ("tyre_age_laps",), 32, postpone=True).record(555, 0)
    assert driven.postponed is not None
    assert driven.postponed_rows is not None
    stay = np.zeros_like(driven.calls)
    made = (driven.calls > 0) & driven.running
    assert not found_within_a_lap(driven, stay, stay).any()
    calls = np.where(driven.running, driven.calls, 0).astype(np.int8)
    assert found_within_a_lap(driven, calls, stay).all()
    assert found_within_a_lap(driven, np.roll(calls, -1, axis=0), stay).all()
    assert not found_within_a_lap(driven, np.roll(calls, -2, axis=0), stay).any()
    wrong = np.where(driven.calls > 0, 2, 0).astype(np.int8)
    assert not found_within_a_lap(driven, wrong, wrong).any()
    late = found_within_a_lap(driven, stay, driven.calls)
    np.testing.assert_array_equal(late, driven.postponed.running[np.nonzero(made)])
    ages, after = driven.rows[..., 0][made], driven.postponed_rows[..., 0][made]
    there = driven.postponed.running[made]
    np.testing.assert_array_equal(after[there], ages[there] + 1)  # one lap older: the stop was put off
    assert there.any()
    assert agreement(driven, driven.labels) == 1.0


def test_a_recurrent_policy_follows_the_races_that_the_tree_drives(tmp_path: Path, bahrain: RaceRecord) -> None:
    def fill(params: dict[str, np.ndarray], names: tuple[str, ...]) -> None:
        rng = np.random.default_rng(5)
        for value in params.values():
            value += rng.normal(0, 0.4, value.shape).astype(np.float32)

    policy = made_policy(tmp_path, "drqn", fill)
    tree = replace(random_tree()[0], columns=("laps_left", "gap_ahead_s", "position"))
    driven = TreeRecorder(policy, bahrain, CAR, tree.columns, 4).record(9, 0, tree)
    environment, strategist = RaceEnvironment(bahrain, CAR, batch=4), TreeStrategist(tree)
    numbers = np.arange(4, dtype=np.int64)
    environment.reset(9, numbers)
    strategist.begin(environment, 9, numbers)
    rows = []
    for lap in range(12):
        rows.append(environment.raw.copy())
        calls = strategist.decide(environment)
        np.testing.assert_array_equal(calls, driven.calls[lap])
        environment.step(calls)
    sequence = np.stack([policy.encoder(bahrain)(r) for r in rows], axis=1)
    np.testing.assert_allclose(policy.q_of_sequences(sequence), driven.q[11], rtol=1e-4, atol=1e-5)
    alone = policy.q_of_rows(sequence[:, -1])
    assert np.abs(alone - driven.q[11]).max() > 1e-3  # its memory matters


def two_part_samples() -> Samples:
    rng = np.random.default_rng(2)
    rows = rng.uniform(0, 1, (3000, 3)).astype(np.float32)
    stop = (rows[:, 0] > 0.7) | (rows[:, 2] > 0.9)
    labels = np.where(stop, np.where(rows[:, 1] > 0.4, 3, 1), 0).astype(np.int8)
    return Samples(rows, labels, np.ones(3000, np.int64), np.ones(3000, np.float32))


@pytest.mark.parametrize("two_part", [False, True])
def test_both_ways_of_growing_find_when_and_what(two_part: bool) -> None:
    samples = two_part_samples()
    tree = grow(samples, samples.weights(1.0, False), ("laps_left", "gap_ahead_s", "position"), 6, 0, two_part=two_part)
    assert len(tree.leaves) <= 6
    assert (tree.actions(samples.rows) == samples.labels).mean() > 0.998
    assert tree.samples[0].tolist() == np.bincount(samples.labels, minlength=4).tolist()
    if two_part:
        limited = grow(samples, samples.weights(1.0, False), ("laps_left", "gap_ahead_s", "position"), 3, 0, two_part=True)
        assert len(limited.leaves) <= 3


def test_weights_count_stops_and_stakes() -> None:
    samples = Samples(np.zeros((2, 1), np.float32), np.array([0, 3], np.int8), np.array([8, 1]), np.array([0.5, 2.0], np.float32))
    assert samples.weights(1.5, False).tolist() == [8.0, 1.5]
    assert samples.weights(1.5, True).tolist() == [4.0, 3.0]


@given(st.integers(0, 3), st.integers(0, 399))
def test_a_merged_path_is_the_leafs_box(seed: int, which: int) -> None:
    tree, rows = random_tree(seed)
    row = rows[which]
    intervals = merge_path(tree, row)
    lower, upper = tree.leaf_boxes()
    at = int(np.searchsorted(tree.leaves, tree.leaf(row)))
    assert len({i.name for i in intervals}) == len(intervals)
    for interval in intervals:
        column = tree.columns.index(interval.name)
        assert (interval.lower, interval.upper) == (lower[at, column], upper[at, column])
        assert interval.lower < interval.value <= interval.upper
    assert sum(len(i.steps) for i in intervals) == len(tree.path(row))


@pytest.mark.parametrize(
    ("lower", "upper", "words"),
    [(-math.inf, 3.5, "at most 3 laps"), (11.5, math.inf, "at least 12 laps"), (0.5, 1.5, "1 lap"), (2.5, 7.0, "3 to 7 laps")],
)
def test_whole_numbers_are_said_whole(lower: float, upper: float, words: str) -> None:
    assert whole_words(lower, upper, "laps") == words


def test_rounding_leaves_words_true() -> None:
    assert range_words(0.3504, math.inf, 0.3506, "s") == ("above 0.350 s", "0.351 s")
    assert range_words(-math.inf, 4.12, 1.0, "s") == ("at most 4.1 s", "1.0 s")


def test_categories_merge_into_what_is_left() -> None:
    n = 5
    tree = Tree(
        np.array([0, 1, LEAF, LEAF, LEAF], np.int32), np.full(n, 0.5, np.float32), np.array([1, 2, LEAF, LEAF, LEAF], np.int32),
        np.array([4, 3, LEAF, LEAF, LEAF], np.int32), np.zeros(n, np.int8), np.zeros((n, 4), np.int64), ("tyre=soft", "tyre=medium"),
    )  # fmt: skip
    assert [i.words for i in merge_path(tree, np.array([0, 0], np.float32))] == ["hard"]
    assert [i.words for i in merge_path(tree, np.array([0, 1], np.float32))] == ["medium"]
    assert [i.sentence for i in merge_path(tree, np.array([1, 0], np.float32))] == ["compound fitted: soft"]


def test_a_decision_is_read_from_the_tree(fitted: FittedTree, by_age: ExplainedPolicy, bahrain: RaceRecord) -> None:
    moment = reach(by_age.strategist(bahrain), bahrain, CAR, LONGEST_STINT + 2, race=1)
    assert int(moment.raw[-1, COLUMN["tyre_age_laps"]]) == LONGEST_STINT + 1
    told = explain_tree(by_age, moment, fitted.tree)
    leaf = fitted.tree.samples[fitted.tree.leaf(TreeRows(fitted.tree.columns).of_race(moment.raw)[-1])]
    assert told.decision.call == told.details["tree_call"] == "pit hard"
    assert told.details["agrees"]
    assert told.baseline + told.values.sum() == pytest.approx(leaf[3] / leaf.sum())
    assert "laps on the set fitted" in told.summary()
    assert "The tree of policy toy makes the same call: box for hard." in told.summary()
    json.loads(told.to_json())
    before = explain_tree(by_age, reach(by_age.strategist(bahrain), bahrain, CAR, 5), fitted.tree)
    assert before.details["tree_call"] == "no pit"


def test_it_says_where_the_policy_calls_otherwise(fitted: FittedTree, by_age: ExplainedPolicy, bahrain: RaceRecord) -> None:
    always_stay = replace(fitted.tree, action=np.zeros_like(fitted.tree.action))
    moment = reach(by_age.strategist(bahrain), bahrain, CAR, LONGEST_STINT + 2, race=1)
    told = explain_tree(by_age, moment, always_stay)
    assert not told.details["agrees"]
    assert "but the policy calls box for hard" in told.summary()
    forced = explain_tree(by_age, replace(moment, legal=np.array([True, False, False, False])), fitted.tree)
    assert forced.sentences == ("There is no decision: stay out is the only legal call.",)


def test_trees_of_another_model_or_race_are_refused(fitted: FittedTree, by_age: ExplainedPolicy, bahrain: RaceRecord) -> None:
    moment = reach(by_age.strategist(bahrain), bahrain, CAR, 3)
    with pytest.raises(RsrlError, match=f"another model, f00; toy is {by_age.hash}"):
        explain_tree(by_age, moment, replace(fitted.tree, model_hash="f00"))
    with pytest.raises(RsrlError, match="the tree is for spain-2023"):
        explain_tree(by_age, moment, replace(fitted.tree, race="spain-2023"))


def test_a_stored_tree_is_found_and_a_missing_one_says_how_to_fit_it(
    fitted: FittedTree, by_age: ExplainedPolicy, bahrain: RaceRecord, tmp_path: Path
) -> None:
    policy = replace(by_age, folder=tmp_path)
    with pytest.raises(RsrlError, match=r"rsrl explain toy --race bahrain-2023 --driver \w+ --fit-tree"):
        find_tree(policy, bahrain, CAR)
    path = store_tree(fitted.tree, policy, bahrain, CAR)
    assert path.parent == tmp_path
    assert path.name.startswith("tree-bahrain-2023")
    found = find_tree(policy, bahrain, CAR)
    np.testing.assert_array_equal(found.samples, fitted.tree.samples)
    assert found.about["choice"]["iteration"] == fitted.chosen
    with pytest.raises(RsrlError, match="another model"):
        find_tree(replace(policy, hash="0" * 16), bahrain, CAR)


def test_the_shield_keeps_calls_legal(bahrain: RaceRecord) -> None:
    tree, _ = random_tree()
    environment, strategist = RaceEnvironment(bahrain, CAR, batch=32), TreeStrategist(tree)
    numbers = np.arange(32, dtype=np.int64)
    environment.reset(1, numbers)
    strategist.begin(environment, 1, numbers)
    bent = 0
    while not environment.done.all():
        own = tree.actions(TreeRows(tree.columns).of_race(environment.raw[:1]))
        calls = strategist.decide(environment)
        assert (environment.legal[np.arange(32), calls] | environment.done).all()
        bent += int(own[0] != calls[0])
        environment.step(calls)
    assert bent > 0
    assert not environment.outcome().failed.any()


def test_text_plot_and_page_show_every_leaf(fitted: FittedTree, by_age: ExplainedPolicy, bahrain: RaceRecord) -> None:
    import matplotlib

    matplotlib.use("Agg")
    tree = fitted.tree
    assert tree_text(tree).count("->") == len(tree.leaves)
    row = np.zeros(len(tree.columns), np.float32)
    page = tree_page(tree, row)
    assert page.count('class="leaf') == len(tree.leaves)
    assert page.count('leaf path"') == 1
    assert "http" not in page
    assert "<script" not in page
    axes = plot_tree(tree, max_depth=3)
    assert any("laps on the set" in text.get_text().replace("\n", " ") for text in axes.texts)
    matplotlib.pyplot.close("all")


def test_an_unknown_column_is_named() -> None:
    with pytest.raises(RsrlError, match="reads 'horoscope'"):
        TreeRows(["horoscope"])
    assert len(COLUMN) == RAW_SIZE


def test_every_text_stands_by_itself() -> None:
    texts = {c.name: c.text for c in tree_columns("full", one_race=False)}
    assert not [text for text in texts.values() if "the same" in text]
    assert len(set(texts.values())) == len(texts)
    assert texts["expected_hard_s"] == "boxing for hard: expected loss to the flag, safety cars allowed for"
    assert texts["projected_hard_places"] == "projected places that boxing for hard costs"


def test_the_shipped_tree_stands_for_the_shipped_policy(bahrain: RaceRecord) -> None:
    """After the policy has been trained anew its tree must be fitted anew."""
    strategist = make_strategist("tree", bahrain, bahrain.car_index("HAM"))
    assert isinstance(strategist, TreeStrategist)
    assert len(strategist.tree.leaves) <= 48
    with pytest.raises(RsrlError, match="no tree of all for VER at bahrain-2023"):
        make_strategist("tree", bahrain, bahrain.car_index("VER"))
