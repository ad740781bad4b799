"""Attribution: Shapley's rule on games with known answers, against shap and brute force, and on policies."""

import dataclasses
import json
import math
import warnings
from itertools import combinations
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rsrl.agents import ModelMetadata, NetworkAgent
from rsrl.agents.networks import NETWORKS, Lstm
from rsrl.errors import RsrlError
from rsrl.explanation import ExplainedPolicy, Moment, explain_attribution, load_explained, reach
from rsrl.explanation.attribution import (
    ReferenceRaces,
    ValueFunction,
    drive_references,
    exact_values,
    feature_players,
    group_players,
    interaction_indices,
    make_background,
    read_row,
    shapley_values,
)
from rsrl.explanation.attribution.shapley import MAX_EXACT_PLAYERS
from rsrl.explanation.attribution.timeshap import cell_level, event_level, feature_level, prune
from rsrl.explanation.attribution.values import coalitions
from rsrl.explanation.fidelity import measure_attribution
from rsrl.explanation.fidelity.attribution import SampledDecisions, calibration
from rsrl.season import RaceRecord
from rsrl.state import ACTION_NAMES, COLUMN, FEATURE_SETS, feature_set, input_names

LAP = 10
SEED = 4_711


def toy(value: Any, n: int) -> Any:
    """A game with one reference in which a coalition, bool [n], is worth `value` of it, to each of the four calls."""

    def values(masks: Any) -> Any:
        return np.array([[float(value(mask))] * 4 for mask in masks])

    game = SimpleNamespace(players=np.arange(n), values=values, all_values=lambda: values(coalitions(n)))
    return SimpleNamespace(games=(game,), count=n)


def solved(v: Any, budget: int | None = None, seed: int = 0, **options: Any) -> Any:
    return shapley_values(v, budget, np.random.default_rng(seed), 400, **options)


def random_game(n: int, seed: int) -> Any:
    worth = np.random.default_rng(seed).normal(size=2**n)
    return toy(lambda mask: worth[int(mask @ (1 << np.arange(n)))], n)


def random_policy(kind: str, network: str, seed: int, name: str = "paper") -> ExplainedPolicy:
    """Random weights, heads included, so that everything it is shown counts."""
    rng = np.random.default_rng(seed)
    shape = NETWORKS[network](len(input_names(name)), 24)
    params = {k: rng.normal(0, 0.4, w.shape).astype(np.float32) for k, w in shape.init(rng).items()}
    agent = NetworkAgent(kind, name, input_names(name), kind == "rsrl", shape, params)
    return ExplainedPolicy(agent, ModelMetadata(config={"gamma": 0.99}), network, Path(), "0" * 16)


@pytest.fixture(scope="module")
def policy() -> ExplainedPolicy:
    return load_explained("all")


@pytest.fixture(scope="module")
def moment(policy: ExplainedPolicy, bahrain: RaceRecord) -> Moment:
    return reach(policy.strategist(bahrain), bahrain, bahrain.car_index("HAM"), LAP, seed=SEED)


@pytest.fixture(scope="module")
def references(policy: ExplainedPolicy, bahrain: RaceRecord) -> ReferenceRaces:
    return drive_references(policy, bahrain, bahrain.car_index("HAM"), races=40)


# Shapley's rule


@given(st.lists(st.floats(-10, 10), min_size=1, max_size=8))
def test_a_linear_game_gives_each_player_its_weight(weights: list[float]) -> None:
    shared = solved(toy(lambda mask: 3.0 + mask @ np.array(weights), len(weights)))
    np.testing.assert_allclose(shared.values[:, 0], weights, atol=1e-12)
    np.testing.assert_allclose(shared.interactions, 0, atol=1e-12)
    assert shared.exact


def test_the_glove_game() -> None:
    shared = solved(toy(lambda mask: mask[0] and (mask[1] or mask[2]), 3))
    np.testing.assert_allclose(shared.values[:, 2], [2 / 3, 1 / 6, 1 / 6])


def test_exclusive_or_is_all_interaction() -> None:
    shared = solved(toy(lambda mask: mask[0] != mask[2], 3))
    np.testing.assert_allclose(shared.values, 0, atol=1e-12)
    expected = np.zeros((3, 3))
    expected[0, 2] = expected[2, 0] = -2.0  # together they bring 2 less than the sum of each alone
    np.testing.assert_allclose(shared.interactions[:, :, 1], expected, atol=1e-12)


@given(st.integers(1, 7), st.integers(0, 10_000))
def test_shares_and_interactions_are_those_of_the_definition(n: int, seed: int) -> None:
    values = random_game(n, seed).games[0].all_values()
    shares, pairs = exact_values(values), interaction_indices(values)
    for i in range(n):
        expected = 0.0
        for s in subsets(set(range(n)) - {i}):
            weight = math.factorial(len(s)) * math.factorial(n - len(s) - 1) / math.factorial(n)
            expected += weight * (values[code(s | {i}), 0] - values[code(s), 0])
        assert shares[i, 0] == pytest.approx(expected)
    assert shares[:, 0].sum() == pytest.approx(values[-1, 0] - values[0, 0])
    for i, j in combinations(range(n), 2):
        expected = 0.0
        for s in subsets(set(range(n)) - {i, j}):
            weight = math.factorial(len(s)) * math.factorial(n - len(s) - 2) / math.factorial(n - 1)
            gain = values[code(s | {i, j}), 0] - values[code(s | {i}), 0] - values[code(s | {j}), 0] + values[code(s), 0]
            expected += weight * gain
        assert pairs[i, j, 0] == pytest.approx(expected)


def subsets(players: set[int]) -> list[set[int]]:
    return [set(c) for size in range(len(players) + 1) for c in combinations(sorted(players), size)]


def code(players: set[int]) -> int:
    return sum(1 << p for p in players)


def test_estimates_are_as_far_off_as_they_say_and_sum_exactly() -> None:
    game, weights = random_game(6, 5), np.array([1.0, 0, 0, 0])
    exact = solved(game)
    runs = [solved(game, seed=seed, force_sampling=True) for seed in range(150)]
    scores = np.array([(run.values[:, 0] - exact.values[:, 0]) / run.standard_errors(weights) for run in runs])
    assert not any(run.exact for run in runs)
    assert abs(scores.mean()) < 0.15
    assert 0.85 < scores.std() < 1.2
    for run in runs:
        assert run.values[:, 0].sum() == pytest.approx((exact.full - exact.empty)[0], abs=1e-12)
        assert run.evaluations <= 400


def test_a_seed_names_an_estimate_and_a_budget_bounds_it() -> None:
    game = random_game(8, 1)
    first, again, other = (solved(game, 100, seed) for seed in (3, 3, 4))
    assert not first.exact
    np.testing.assert_array_equal(first.values, again.values)
    assert not np.array_equal(first.values, other.values)
    assert first.evaluations <= 100
    assert solved(game, 256).exact
    with pytest.raises(RsrlError, match="budget of 20"):
        solved(game, 20)


# The value function


@pytest.mark.parametrize("name", sorted(NETWORKS))
def test_the_folded_network_is_the_network(name: str) -> None:
    """Masks of players give what the policy says of the masked laps, whatever the network."""
    policy, rng = random_policy("drqn", name, 3), np.random.default_rng(1)
    laps, columns, n = 5, policy.agent.network.n_features, 7
    state, references = rng.random((laps, columns), np.float32), rng.random((3, laps, columns), np.float32)
    references[0, :3] = state[:3]  # agrees with the state on the first laps, and in some columns on all
    references[1, :, :9] = state[:, :9]
    owners = rng.integers(0, n, (laps, columns))
    v = ValueFunction(policy.agent, state, references, owners, n)
    masks = coalitions(n)
    shown = np.where(masks[:, None][:, :, owners][:, 0][:, None], state, references)  # [2^n, K, T, F]
    expected = np.mean([policy.q_of_sequences(np.ascontiguousarray(shown[:, k])) for k in range(3)], axis=0)
    np.testing.assert_allclose(v(masks), expected, rtol=1e-4, atol=1e-4)
    for game in v.games:
        np.testing.assert_allclose(game.all_values(), game.values(coalitions(len(game.players))), rtol=1e-4, atol=1e-5)


def test_attribution_agrees_with_shap(policy: ExplainedPolicy, moment: Moment, references: ReferenceRaces) -> None:
    """shap is asked about the policy itself, past everything that makes our own evaluation fast."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # its own, on import
        import shap
    references = ReferenceRaces(references.raw[:2], references.running[:2])
    background = make_background(policy, moment, "lap_aligned", references)
    ours = explain_attribution(policy, moment, references=references, target="call")
    call = ACTION_NAMES.index(ours.decision.call)
    players = group_players("full")
    owners = feature_level("full", players, LAP).owners[-1]
    state = policy.encoder(moment.record)(moment.raw)[-1]

    def value(masks: Any) -> Any:
        shown = np.where(masks[:, owners][:, None] > 0.5, state, background.features[:, -1])
        return policy.q_of_rows(shown.reshape(-1, len(state))).reshape(len(masks), -1, 4).mean(axis=1)[:, call]

    explainer = shap.KernelExplainer(value, np.zeros((1, len(players))), silent=True)
    expected = explainer.shap_values(np.ones((1, len(players))), nsamples=2 ** len(players), l1_reg=0, silent=True)[0]
    mine = dict(zip(ours.labels, ours.values, strict=True))
    np.testing.assert_allclose([mine[p.label] for p in players], expected, atol=2e-5)
    assert ours.baseline == pytest.approx(float(explainer.expected_value), abs=1e-5)


# Players


@pytest.mark.parametrize("name", sorted(FEATURE_SETS))
def test_every_feature_is_one_player_and_every_group_set_is_exact(name: str) -> None:
    for players in (feature_players(name), group_players(name)):
        assert sorted(f.name for p in players for f in p.features) == sorted(f.name for f in feature_set(name))
        labels = [p.label for p in players]
        assert len(set(labels)) == len(labels)
        assert not any("the same" in label for label in labels)
    assert len(group_players(name)) <= MAX_EXACT_PLAYERS
    assert len(feature_players("paper")) <= MAX_EXACT_PLAYERS


def test_a_one_hot_is_one_player() -> None:
    owners = feature_level("paper", feature_players("paper"), 1).owners[0]
    tyre = [i for i, column in enumerate(input_names("paper")) if column.startswith("tyre=")]
    assert len(tyre) == 3
    assert len(set(owners[tyre])) == 1
    assert (owners == owners[tyre[0]]).sum() == 3


# TimeSHAP's levels


def test_old_laps_are_pruned_as_the_algorithm_says() -> None:
    policy, rng = random_policy("drqn", "lstm", 8), np.random.default_rng(2)
    state, reference = rng.random((2, 12, policy.agent.network.n_features), np.float32)
    weights = np.array([1.0, -1.0, 0, 0])

    def value(old: bool, new: bool, i: int) -> float:
        shown = np.concatenate([(state if old else reference)[:i], (state if new else reference)[i:]])
        return float(policy.q_of_sequences(shown[None])[0].astype(np.float64) @ weights)

    whole = abs(value(True, True, 6) - value(False, False, 6))
    for tolerance in (0.0, 0.05, 0.3, 1.0, 10.0):
        pruned = prune(policy.agent, state, reference[None], weights, tolerance)
        expected = 0
        for i in range(11, 0, -1):
            phi = (value(True, False, i) - value(False, False, i) + value(True, True, i) - value(False, True, i)) / 2
            if abs(phi) < tolerance * whole:
                expected = i
                break
        assert pruned == expected
    assert prune(policy.agent, state, reference[None], weights, 10.0) == 11


@given(st.integers(0, 6), st.sets(st.integers(0, 8), min_size=1, max_size=3), st.sets(st.integers(0, 13), min_size=1, max_size=2))
def test_cells_leave_nothing_out(pruned: int, laps: set[int], features: set[int]) -> None:
    told = sorted(lap for lap in laps if lap >= pruned)
    cells = cell_level("paper", feature_players("paper"), 9, pruned, told, sorted(features))
    assert set(cells.owners.ravel()) == set(range(len(cells.labels)))
    assert len(cells.labels) <= 13
    assert pruned == 0 or (cells.owners[:pruned] == 0).all()


def test_events_are_laps_and_the_pruned_ones_are_together() -> None:
    cells = event_level(5, 3, 2)
    assert cells.labels == ("laps 1 to 2, pruned", "lap 3", "lap 4", "lap 5")
    assert cells.owners[:, 0].tolist() == [0, 0, 1, 2, 3]
    assert event_level(3, 1, 0).owners[:, 0].tolist() == [0, 1, 2]


@pytest.mark.parametrize("background", ["lap_aligned", "average"])
@pytest.mark.parametrize("level", ["group", "feature", "event", "cell"])
def test_a_policy_with_memory_is_explained_at_every_level(bahrain: RaceRecord, level: Any, background: Any, moment: Moment) -> None:
    policy = random_policy("drqn", "lstm", 1)
    assert isinstance(policy.agent.network, Lstm)
    told = explain_attribution(policy, moment, level=level, background=background, references=references_of(policy, bahrain))
    q = told.decision.q_values
    whole = q[told.decision.call] - q[told.decision.alternative]
    assert told.baseline + told.values.sum() == pytest.approx(whole, abs=1e-5)
    assert told.exact
    assert len(told.labels) <= MAX_EXACT_PLAYERS
    assert told.unit == "points of reward"


def references_of(policy: ExplainedPolicy, record: RaceRecord) -> ReferenceRaces:
    """Races a random policy may call: it would be out of them at once, so the rows are those of one that is not."""
    return drive_references(load_explained("all"), record, record.car_index("HAM"), races=8)


# The entry point


def test_a_decision_is_shared_out_exactly_and_told_in_words(
    policy: ExplainedPolicy, moment: Moment, references: ReferenceRaces, tmp_path: Path
) -> None:
    told = explain_attribution(policy, moment, references=references)
    spread = np.ptp(list(told.decision.q_values.values()))
    assert told.exact
    assert abs(told.baseline + told.values.sum() - told.decision.margin) < 1e-5 * spread
    assert told.details["efficiency_gap"] < 1e-5 * spread
    assert np.all(np.diff(np.abs(told.values)) <= 0)
    assert f"Lap {LAP}, HAM" in told.summary()
    assert "the same lap" in told.summary()
    rows = {row["label"]: row for row in json.loads(told.to_json())["rows"]}
    assert rows["laps"]["value"] == rows["track and car"]["value"] == 0, "the same in every race on this lap"
    assert "laps on the set fitted" in rows["tyre"]["value_here"] or "compound fitted" in rows["tyre"]["value_here"]
    assert rows["tyre"]["reference_error"] > 0
    by_call = {name: np.array(shares) for name, shares in told.details["values_by_call"].items()}
    both = by_call[told.decision.call] - by_call[told.decision.alternative]
    np.testing.assert_allclose(both, told.values, atol=1e-9)


def test_features_are_told_in_natural_units(policy: ExplainedPolicy, moment: Moment, references: ReferenceRaces) -> None:
    told = explain_attribution(policy, moment, level="feature", references=references, budget=8_000)
    assert not told.exact
    assert told.standard_errors is not None
    assert told.budget <= 8_000
    rows = {row["label"]: row for row in told.to_frame().to_dicts()}
    assert rows["laps to go"]["value_here"] == f"{moment.record.laps - LAP + 1} laps"
    assert rows["compound fitted"]["value_here"] in ("soft", "medium", "hard")
    degradation = float(moment.raw[-1, COLUMN["tyre_degradation_s"]])
    assert rows["lap time lost to wear of the set fitted"]["value_here"] == f"{degradation:.2f} s"
    again = explain_attribution(policy, moment, level="feature", references=references, budget=8_000)
    np.testing.assert_array_equal(told.values, again.values)


def test_a_policy_without_memory_says_that_only_this_lap_counts(
    policy: ExplainedPolicy, moment: Moment, references: ReferenceRaces
) -> None:
    told = explain_attribution(policy, moment, level="event", references=references)
    assert told.labels == (f"lap {LAP}",)
    assert told.values[0] == pytest.approx(told.decision.margin - told.baseline, abs=1e-5)
    assert "no memory" in told.summary()
    cells = explain_attribution(policy, moment, level="cell", references=references, budget=8_000)
    assert all(label.endswith(f", lap {LAP}") for label in cells.labels)
    assert "no memory" in cells.summary()


def test_one_legal_call_is_no_decision(policy: ExplainedPolicy, moment: Moment) -> None:
    forced = dataclasses.replace(moment, legal=np.array([True, False, False, False]))
    told = explain_attribution(policy, forced)
    assert told.labels == ()
    assert "only legal call" in told.summary()
    assert json.loads(told.to_json())["rows"] == []


def test_a_moment_against_itself_has_nothing_to_explain(policy: ExplainedPolicy, moment: Moment) -> None:
    told = explain_attribution(policy, moment, background=moment)
    assert not told.values.any()
    assert told.baseline == pytest.approx(told.decision.margin, abs=1e-6)


# Backgrounds


def test_the_average_event_is_the_mean_of_what_the_policy_saw(policy: ExplainedPolicy, moment: Moment, references: ReferenceRaces) -> None:
    background = make_background(policy, moment, "average", references)
    rows = policy.encoder(moment.record)(references.raw[references.running])
    np.testing.assert_allclose(background.features[0, 0], rows.mean(axis=0), rtol=1e-4, atol=1e-6)
    np.testing.assert_array_equal(background.features[0, 0], background.features[0, -1])
    soft, medium, hard = (rows[:, policy.agent.feature_names.index(f"tyre={c}")].mean() for c in ("soft", "medium", "hard"))
    assert soft + medium + hard == pytest.approx(1.0, abs=1e-4)


def test_lap_aligned_references_are_on_the_same_lap(policy: ExplainedPolicy, moment: Moment, references: ReferenceRaces) -> None:
    background = make_background(policy, moment, "lap_aligned", references)
    assert (background.shown[:, COLUMN["laps_left"]] == moment.raw[-1, COLUMN["laps_left"]]).all()
    assert len(background.features) == len(background.shown) == 32
    over = dataclasses.replace(references, running=np.zeros_like(references.running))
    with pytest.raises(RsrlError, match=f"lasts to lap {LAP}"):
        make_background(policy, moment, "lap_aligned", over)


def state_file(path: Path, moment: Moment, **changes: Any) -> Path:
    row: dict[str, Any] = {}
    for f in feature_set("full"):
        value = float(moment.raw[-1, COLUMN[f.name]])
        row[f.name] = f.categories[int(value)] if f.kind == "category" else bool(value) if f.kind == "boolean" else value
    row |= changes
    path.write_text(json.dumps({k: v for k, v in row.items() if v is not None}))
    return path


def test_a_state_file_is_a_background(policy: ExplainedPolicy, moment: Moment, tmp_path: Path) -> None:
    path = state_file(tmp_path / "state.json", moment, tyre_age_laps=2.0)
    np.testing.assert_allclose(read_row(path, "full")[COLUMN["gap_ahead_s"]], moment.raw[-1, COLUMN["gap_ahead_s"]])
    told = explain_attribution(policy, moment, background=path)
    assert [label for label, value in zip(told.labels, told.values, strict=True) if value] == ["tyre"]


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"gap_ahead_s": None}, "lacks gap_ahead_s"),
        ({"brake_temperature": 3.0}, "brake_temperature is no feature"),
        ({"tyre": "wet"}, "tyre is 'wet'"),
        ({"valid_finish": 0.5}, "valid_finish is 0.5"),
        ({"gap_behind_s": "far"}, "gap_behind_s is 'far'"),
        ({"gap_behind_s": math.nan}, "gap_behind_s is nan"),
    ],
)
def test_a_bad_state_file_is_refused_by_name(
    policy: ExplainedPolicy, moment: Moment, tmp_path: Path, changes: dict[str, Any], complaint: str
) -> None:
    with pytest.raises(RsrlError, match=complaint):
        explain_attribution(policy, moment, background=state_file(tmp_path / "state.json", moment, **changes))


def test_bad_input_is_refused(policy: ExplainedPolicy, moment: Moment, tmp_path: Path) -> None:
    wrong: Any = "median"
    with pytest.raises(RsrlError, match="unknown background 'median'"):
        explain_attribution(policy, moment, background=wrong)
    with pytest.raises(RsrlError, match="levels are group"):
        explain_attribution(policy, moment, level=wrong)
    with pytest.raises(RsrlError, match="cannot be read"):
        explain_attribution(policy, moment, background=tmp_path / "none.json")
    (tmp_path / "broken.json").write_text("{")
    with pytest.raises(RsrlError, match="is not JSON"):
        explain_attribution(policy, moment, background=tmp_path / "broken.json")
    with pytest.raises(RsrlError, match="has rows of 3 features"):
        explain_attribution(policy, moment, background=dataclasses.replace(moment, raw=moment.raw[:, :3]))


# Fidelity


def test_calibration_counts_each_lap_driven_once() -> None:
    running = np.array([[True, True, True], [True, False, False]])
    q, outcome = np.array([[1.0, 2, 3], [9, 50, 50]], np.float32), np.array([[0.0, 3, 1], [4, 0, 0]])
    figures = calibration(SampledDecisions((), running, q, outcome))
    assert figures["decisions"] == 4
    assert figures["mean_absolute_error"] == pytest.approx((1 + 1 + 2 + 5) / 4)
    assert figures["bias"] == pytest.approx((1 - 1 + 2 + 5) / 4)
    assert figures["bias_interval"][0] < figures["bias"] < figures["bias_interval"][1]


def test_fidelity_is_measured(policy: ExplainedPolicy, bahrain: RaceRecord) -> None:
    steps: list[tuple[int, int]] = []
    figures = measure_attribution(policy, bahrain, bahrain.car_index("HAM"), races=2, progress=lambda *at: steps.append(at))
    assert steps[-1] == (figures["decisions"], figures["decisions"])
    assert figures["exact_by_construction"] == 1.0
    assert figures["efficiency_gap_of_decision_range"]["largest"] < 1e-5
    assert figures["sampled"]["relative_error"]["mean"] < 0.02
    assert figures["sampled"]["kendall_tau_across_seeds"]["mean"] > 0.9
    for name, side in (("insertion", 1), ("deletion", -1)):
        curve = figures["curves"][name]
        assert side * (curve["area"] - curve["area_random"]) > 0
    assert figures["calibration"]["mean_absolute_error"] > 0
    json.dumps(figures)
