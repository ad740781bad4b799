"""The entry point: why a policy values a call as it does, by Shapley values of features, laps or cells."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.explanation.attribution import wording
from rsrl.explanation.attribution.backgrounds import Background, BackgroundName, ReferenceRaces, make_background
from rsrl.explanation.attribution.shapley import MAX_EXACT_PLAYERS, ShapleyValues, shapley_values
from rsrl.explanation.attribution.timeshap import (
    CELL_FEATURES,
    CELL_LAPS,
    TOLERANCE,
    Cells,
    Player,
    cell_level,
    column_owners,
    event_level,
    feature_level,
    feature_players,
    group_players,
    prune,
)
from rsrl.explanation.attribution.values import Floats, ValueFunction
from rsrl.explanation.moment import Moment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.explanation.result import Decision, Explanation
from rsrl.state import ACTION_NAMES, feature_set

Level = Literal["group", "feature", "event", "cell"]
Target = Literal["decision", "call"]
LEVELS: Final = ("group", "feature", "event", "cell")
TARGETS: Final = ("decision", "call")

BUDGET: Final = 2**16
RECURRENT_BUDGET: Final = 2**14
"""Coalitions evaluated where all of them are too many; a recurrent policy goes through all laps for each."""

MAX_INTERACTIONS: Final = 5
MIN_INTERACTION: Final = 0.05
"""At most so many pairs are reported, each with an interaction of at least this share of the sum of all absolute values."""

NO_MEMORY: Final = (
    "The policy has no memory: it calls by this lap alone. What it knows of the laps before is in features of this lap, such as the pace "
    "that car and set have shown, the last lap time, and how fast the gap ahead closes."
)


@dataclass(frozen=True)
class _Question:
    """What is explained, and how: the same for every level."""

    policy: ExplainedPolicy
    moment: Moment
    decision: Decision
    target: Target
    background: Background
    state: Floats
    budget: int | None
    seed: int

    @property
    def weights(self) -> NDArray[np.float64]:
        """Weight of each of the four calls in the value explained."""
        weights = np.zeros(4)
        weights[ACTION_NAMES.index(self.decision.call)] = 1.0
        if self.target == "decision":
            weights[ACTION_NAMES.index(self.decision.alternative)] = -1.0
        return weights

    @property
    def unit(self) -> str:
        """Unit of the policy's values."""
        return self.policy.unit

    def solve(self, cells: Cells) -> ShapleyValues:
        """Shapley values of the players of `cells`."""
        agent = self.policy.agent
        v = ValueFunction(agent, self.state, self.background.features, cells.owners, len(cells.labels))
        default = RECURRENT_BUDGET if self.policy.recurrent else BUDGET
        return shapley_values(v, self.budget, np.random.default_rng(self.seed), default)


def explain_attribution(
    policy: ExplainedPolicy,
    moment: Moment,
    *,
    level: Level = "group",
    target: Target = "decision",
    background: BackgroundName | Moment | Path | str = "lap_aligned",
    budget: int | None = None,
    seed: int = 0,
    references: ReferenceRaces | None = None,
    tolerance: float = TOLERANCE,
) -> Explanation:
    """Attribute a decision's value to what the policy saw, by Shapley values.

    Args:
        level: "group" of features, "feature", "event" (a lap) or "cell" (a feature on a lap); see timeshap.py.
        target: "decision", the call's value minus that of the best other legal call, or "call", the call's value alone.
        background: input of absent players; see backgrounds.py.
        budget: coalitions to evaluate at most; None evaluates all of up to 16 players, else a fixed number.
        seed: of the permutations where values are estimated.
        references: reference races (`drive_references`), to reuse them; None simulates them.
        tolerance: of pruning old laps, at event and cell level.

    Returns:
        An explanation whose rows and baseline add up to the value explained. A decision with one legal call has no rows, and says so.

    Raises:
        RsrlError: unknown level, target or background; a background of another schema; a budget that is too small.
    """
    if level not in LEVELS or target not in TARGETS:
        raise RsrlError(f"attribution: level {level!r}, target {target!r}; levels are {', '.join(LEVELS)}, targets {', '.join(TARGETS)}")
    decision = policy.decide(moment)
    if target == "decision" and not decision.alternative:
        return _forced(decision)
    compared = make_background(policy, moment, background, references)
    state = policy.encoder(moment.record)(moment.raw)
    question = _Question(policy, moment, decision, target, compared, state, budget, seed)
    if level in ("group", "feature"):
        return _of_features(question, level, _players(policy, level), "")
    if not policy.recurrent:
        return _without_memory(question, level)
    pruned = prune(policy.agent, state, compared.features, question.weights, tolerance)
    return _of_events(question, pruned) if level == "event" else _of_cells(question, pruned)


def _players(policy: ExplainedPolicy, level: str) -> tuple[Player, ...]:
    return (group_players if level == "group" else feature_players)(policy.agent.feature_set)


def _forced(decision: Decision) -> Explanation:
    call = wording.call_in_words(decision.call)
    sentence = f"Lap {decision.lap}, {decision.driver}: to {call} is the only legal call, so there is no decision to explain."
    return Explanation("attribution", decision, f"{call}, the only legal call", "", (), np.zeros(0), sentences=(sentence,))


def _of_features(question: _Question, level: str, players: Sequence[Player], where: str, words: tuple[str, ...] = ()) -> Explanation:
    """Features, or groups of them, over all laps that count; `where` follows each label."""
    solved = question.solve(feature_level(question.policy.agent.feature_set, players, len(question.state)))
    described = _described(question, players)
    columns = {"value_here": [d.here for d in described], "value_reference": [d.reference for d in described]}
    labels, briefs = [p.label + where for p in players], [d.brief for d in described]
    return _explanation(question, level, labels, solved, columns, by_size=True, briefs=briefs, words=words)


def _described(question: _Question, players: Sequence[Player]) -> list[wording.Description]:
    """What each player is like here and in the background."""
    features = feature_set(question.policy.agent.feature_set)
    away = np.abs(question.state[-1] - question.background.features[:, -1].mean(axis=0, dtype=np.float64))
    owner = column_owners(question.policy.agent.feature_set, [Player(f.name, (f,)) for f in features])
    distance = {f.name: away[owner == i].max() for i, f in enumerate(features)}
    here, there = question.moment.raw[-1:], question.background.shown
    typical = np.mean if question.background.name == "average" else np.median
    return [wording.describe(p, here, there, typical, np.array([distance[f.name] for f in p.features])) for p in players]


def _without_memory(question: _Question, level: str) -> Explanation:
    """Events and cells of a policy without memory: the only event is this lap, and its cells are its features."""
    if level == "event":
        solved = question.solve(Cells(("this lap",), np.zeros(question.state.shape, np.int64)))
        label = f"lap {question.moment.lap}"
        return _explanation(question, level, [label], solved, {"last_lap": [question.moment.lap]}, by_size=False, words=(NO_MEMORY,))
    return _of_features(question, level, _players(question.policy, "feature"), f", lap {question.moment.lap}", (NO_MEMORY,))


def _of_events(question: _Question, pruned: int) -> Explanation:
    cells = event_level(len(question.state), question.state.shape[1], pruned)
    solved = question.solve(cells)
    last = ([pruned] if pruned else []) + list(range(pruned + 1, len(question.state) + 1))
    return _explanation(question, "event", cells.labels, solved, {"last_lap": last}, by_size=False, pruned=pruned)


def _of_cells(question: _Question, pruned: int) -> Explanation:
    """Cells of the laps and features with the largest values at event and feature level."""
    laps, name = len(question.state), question.policy.agent.feature_set
    events = question.solve(event_level(laps, question.state.shape[1], pruned)).values @ question.weights
    ranked = np.argsort(-np.abs(events[1 if pruned else 0 :]), kind="stable")[:CELL_LAPS] + pruned
    players = _players(question.policy, "feature")
    if len(players) > MAX_EXACT_PLAYERS:
        players = _players(question.policy, "group")
    features = question.solve(feature_level(name, players, laps)).values @ question.weights
    chosen = np.argsort(-np.abs(features), kind="stable")[:CELL_FEATURES]
    cells = cell_level(name, players, laps, pruned, sorted(int(i) for i in ranked), [int(j) for j in chosen])
    return _explanation(question, "cell", cells.labels, question.solve(cells), {}, by_size=True, pruned=pruned)


def _explanation(
    question: _Question,
    level: str,
    labels: Sequence[str],
    solved: ShapleyValues,
    columns: Mapping[str, Sequence[Any]],
    *,
    by_size: bool,
    briefs: Sequence[str] = (),
    words: tuple[str, ...] = (),
    pruned: int = 0,
) -> Explanation:
    """The result, its rows by size of their values or in the order of the players."""
    weights, decision = question.weights, question.decision
    values = solved.values @ weights
    order = np.argsort(-np.abs(values), kind="stable") if by_size else np.arange(len(values))
    table: dict[str, Sequence[Any]] = {name: [column[i] for i in order] for name, column in columns.items()}
    if len(question.background.features) > 1:
        table["reference_error"] = solved.reference_errors(weights)[order].tolist()
    names, values = tuple(labels[i] for i in order), values[order]
    baseline = float(solved.empty @ weights)
    pairs = _interactions(labels, solved, weights)
    sentences = wording.opening(decision, question.target, question.unit, baseline, question.background.text)
    sentences += wording.reasons(names, values, [briefs[i] if briefs else "" for i in order])
    sentences += [wording.together(p["first"], p["second"], p["value"], question.unit) for p in pairs[:1]]
    if not solved.exact:
        largest = float(solved.standard_errors(weights).max())
        sentences.append(f"Estimated from {solved.evaluations} coalitions, each value with a standard error of {largest:.2g} or less.")
    return Explanation(
        "attribution", decision, wording.question(decision, question.target), question.unit, names, values, baseline, solved.exact,
        solved.evaluations, None if solved.exact else solved.standard_errors(weights)[order], table,
        _details(question, level, solved, order, pairs, baseline + float(values.sum()), pruned), (*words, *sentences),
    )  # fmt: skip


def _interactions(labels: Sequence[str], solved: ShapleyValues, weights: NDArray[np.float64]) -> list[dict[str, Any]]:
    """The largest interactions of two players; none where they were not computed."""
    if solved.interactions is None:
        return []
    indices = np.triu(solved.interactions @ weights, 1)
    least = MIN_INTERACTION * np.abs(solved.values @ weights).sum()
    order = np.argsort(-np.abs(indices), axis=None, kind="stable")[:MAX_INTERACTIONS]
    pairs = [divmod(int(i), len(labels)) for i in order]
    found = [(i, j, float(indices[i, j])) for i, j in pairs if i < j]
    return [{"first": labels[i], "second": labels[j], "value": value} for i, j, value in found if abs(value) >= least > 0]


def _details(
    question: _Question, level: str, solved: ShapleyValues, order: NDArray[np.int64], pairs: list[dict[str, Any]], total: float, pruned: int
) -> dict[str, Any]:
    q = np.array([question.decision.q_values[name] for name in ACTION_NAMES])
    return {
        "level": level,
        "target": question.target,
        "background": question.background.name,
        "background_text": question.background.text,
        "references": len(question.background.features),
        "values_by_call": {name: solved.values[order, a].tolist() for a, name in enumerate(ACTION_NAMES)},
        "efficiency_gap": abs(total - float(q @ question.weights)),
        "interactions": pairs,
        "interactions_computed": solved.interactions is not None,
        "pruned_laps": pruned,
    }
