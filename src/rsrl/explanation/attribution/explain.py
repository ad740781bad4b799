"""The entry point: why a policy values a call as it does, shared out among features, laps or cells."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.explanation.attribution import wording
from rsrl.explanation.attribution.backgrounds import Background, BackgroundName, ReferenceRaces, make_background
from rsrl.explanation.attribution.players import Player, column_owners, feature_players, group_players
from rsrl.explanation.attribution.shapley import MOST_EXACT, Shapley, shapley
from rsrl.explanation.attribution.timeshap import CELL_FEATURES, CELL_LAPS, TOLERANCE, Cells, cell_level, event_level, feature_level, prune
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
BUDGET_WITH_MEMORY: Final = 2**14
"""Coalitions tried where all of them are too many; a policy with a memory drives all laps for each."""

INTERACTIONS: Final = 5
WORTH_TELLING: Final = 0.05
"""So many pairs are told at most, each with an interaction of so much of the sum of all absolute shares."""

NO_MEMORY: Final = (
    "The policy has no memory: only what is seen on this lap counts. What the laps before tell stands in features of this lap, "
    "such as the form and the luck of the set by the laps shown, the last lap time and how the gap ahead closes."
)


@dataclass(frozen=True)
class _Subject:
    """What every level needs."""

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
        """Of the four calls in the value explained."""
        weights = np.zeros(4)
        weights[ACTION_NAMES.index(self.decision.call)] = 1.0
        if self.target == "decision":
            weights[ACTION_NAMES.index(self.decision.alternative)] = -1.0
        return weights

    @property
    def unit(self) -> str:
        """Of the policy's values."""
        return "places" if self.policy.agent.kind == "rsrl" else "points of reward"

    def share_out(self, cells: Cells) -> Shapley:
        """Shapley values of the players of `cells`."""
        agent = self.policy.agent
        v = ValueFunction(agent, self.state, self.background.features, cells.owners, len(cells.labels))
        default = BUDGET_WITH_MEMORY if self.policy.recurrent else BUDGET
        return shapley(v, self.budget, np.random.default_rng(self.seed), default)


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
    """Share a value out among what the policy saw, by Shapley's rule.

    Args:
        level: "group" of features, "feature", "event" (a lap) or "cell" (a feature on a lap); see timeshap.py.
        target: "decision", the call's value less that of the best other legal call, or "call", the value of the call alone.
        background: what stands where something is not told; see backgrounds.py.
        budget: coalitions to try at most; None tries all of up to 16 players, else a set number.
        seed: of the permutations, where values are estimated.
        references: reference races (`drive_references`) to use again; None drives them.
        tolerance: of pruning, at event and cell level.

    Returns:
        Rows sum, with the baseline, to the value explained. A decision with one legal call has no rows and a sentence.

    Raises:
        RsrlError: unknown level, target or background; a background of another schema; too small a budget.
    """
    if level not in LEVELS or target not in TARGETS:
        raise RsrlError(f"attribution: level {level!r}, target {target!r}; levels are {', '.join(LEVELS)}, targets {', '.join(TARGETS)}")
    decision = policy.decide(moment)
    if target == "decision" and not decision.alternative:
        return _forced(decision)
    compared = make_background(policy, moment, background, references)
    state = policy.encoder(moment.record)(moment.raw)
    subject = _Subject(policy, moment, decision, target, compared, state, budget, seed)
    if level in ("group", "feature"):
        return _of_features(subject, level, _players(policy, level), "")
    if not policy.recurrent:
        return _without_memory(subject, level)
    pruned = prune(policy.agent, state, compared.features, subject.weights, tolerance)
    return _of_events(subject, pruned) if level == "event" else _of_cells(subject, pruned)


def _players(policy: ExplainedPolicy, level: str) -> tuple[Player, ...]:
    return (group_players if level == "group" else feature_players)(policy.agent.feature_set)


def _forced(decision: Decision) -> Explanation:
    call = wording.call_in_words(decision.call)
    sentence = f"Lap {decision.lap}, {decision.driver}: to {call} is the only call that may be made, so there is no decision to explain."
    return Explanation("attribution", decision, f"{call}, the only legal call", "", (), np.zeros(0), sentences=(sentence,))


def _of_features(subject: _Subject, level: str, players: Sequence[Player], where: str, words: tuple[str, ...] = ()) -> Explanation:
    """Features or groups of them over all laps that count; `where` follows each label."""
    shared = subject.share_out(feature_level(subject.policy.agent.feature_set, players, len(subject.state)))
    told = _told(subject, players)
    columns = {"value_here": [t.here for t in told], "value_reference": [t.usual for t in told]}
    labels, briefs = [p.label + where for p in players], [t.brief for t in told]
    return _explanation(subject, level, labels, shared, columns, by_size=True, briefs=briefs, words=words)


def _told(subject: _Subject, players: Sequence[Player]) -> list[wording.Told]:
    """What each player is like here and in the background."""
    features = feature_set(subject.policy.agent.feature_set)
    away = np.abs(subject.state[-1] - subject.background.features[:, -1].mean(axis=0, dtype=np.float64))
    owner = column_owners(subject.policy.agent.feature_set, [Player(f.name, (f,)) for f in features])
    distance = {f.name: away[owner == i].max() for i, f in enumerate(features)}
    here, there = subject.moment.raw[-1:], subject.background.shown
    typical = np.mean if subject.background.name == "average" else np.median
    return [wording.tell(p, here, there, typical, np.array([distance[f.name] for f in p.features])) for p in players]


def _without_memory(subject: _Subject, level: str) -> Explanation:
    """Events and cells of a policy that looks at one lap: that lap is all there is, and its cells are its features."""
    if level == "event":
        shared = subject.share_out(Cells(("this lap",), np.zeros(subject.state.shape, np.int64)))
        label = f"lap {subject.moment.lap}"
        return _explanation(subject, level, [label], shared, {"last_lap": [subject.moment.lap]}, by_size=False, words=(NO_MEMORY,))
    return _of_features(subject, level, _players(subject.policy, "feature"), f", lap {subject.moment.lap}", (NO_MEMORY,))


def _of_events(subject: _Subject, pruned: int) -> Explanation:
    cells = event_level(len(subject.state), subject.state.shape[1], pruned)
    shared = subject.share_out(cells)
    last = ([pruned] if pruned else []) + list(range(pruned + 1, len(subject.state) + 1))
    return _explanation(subject, "event", cells.labels, shared, {"last_lap": last}, by_size=False, pruned=pruned)


def _of_cells(subject: _Subject, pruned: int) -> Explanation:
    """The cells of the laps and features that matter most, as events and features alone say."""
    laps, name = len(subject.state), subject.policy.agent.feature_set
    events = subject.share_out(event_level(laps, subject.state.shape[1], pruned)).values @ subject.weights
    ranked = np.argsort(-np.abs(events[1 if pruned else 0 :]), kind="stable")[:CELL_LAPS] + pruned
    players = _players(subject.policy, "feature")
    if len(players) > MOST_EXACT:
        players = _players(subject.policy, "group")
    features = subject.share_out(feature_level(name, players, laps)).values @ subject.weights
    chosen = np.argsort(-np.abs(features), kind="stable")[:CELL_FEATURES]
    cells = cell_level(name, players, laps, pruned, sorted(int(i) for i in ranked), [int(j) for j in chosen])
    return _explanation(subject, "cell", cells.labels, subject.share_out(cells), {}, by_size=True, pruned=pruned)


def _explanation(
    subject: _Subject,
    level: str,
    labels: Sequence[str],
    shared: Shapley,
    columns: Mapping[str, Sequence[Any]],
    *,
    by_size: bool,
    briefs: Sequence[str] = (),
    words: tuple[str, ...] = (),
    pruned: int = 0,
) -> Explanation:
    """Rows in order of size or as they come, with everything that belongs to the result."""
    weights, decision = subject.weights, subject.decision
    values = shared.values @ weights
    order = np.argsort(-np.abs(values), kind="stable") if by_size else np.arange(len(values))
    told: dict[str, Sequence[Any]] = {name: [column[i] for i in order] for name, column in columns.items()}
    if len(subject.background.features) > 1:
        told["reference_error"] = shared.reference_errors(weights)[order].tolist()
    names, values = tuple(labels[i] for i in order), values[order]
    baseline = float(shared.start @ weights)
    pairs = _interactions(labels, shared, weights)
    sentences = wording.opening(decision, subject.target, subject.unit, baseline, subject.background.text)
    sentences += wording.reasons(names, values, [briefs[i] if briefs else "" for i in order])
    sentences += [wording.together(p["first"], p["second"], p["value"], subject.unit) for p in pairs[:1]]
    if not shared.exact:
        largest = float(shared.standard_errors(weights).max())
        sentences.append(f"Estimated from {shared.evaluations} coalitions, each value with a standard error of {largest:.2g} or less.")
    return Explanation(
        "attribution", decision, wording.question(decision, subject.target), subject.unit, names, values, baseline, shared.exact,
        shared.evaluations, None if shared.exact else shared.standard_errors(weights)[order], told,
        _details(subject, level, shared, order, pairs, baseline + float(values.sum()), pruned), (*words, *sentences),
    )  # fmt: skip


def _interactions(labels: Sequence[str], shared: Shapley, weights: NDArray[np.float64]) -> list[dict[str, Any]]:
    """The pairs that matter, largest first; none where interactions were not computed."""
    if shared.interactions is None:
        return []
    indices = np.triu(shared.interactions @ weights, 1)
    least = WORTH_TELLING * np.abs(shared.values @ weights).sum()
    order = np.argsort(-np.abs(indices), axis=None, kind="stable")[:INTERACTIONS]
    pairs = [divmod(int(i), len(labels)) for i in order]
    told = [(i, j, float(indices[i, j])) for i, j in pairs if i < j]
    return [{"first": labels[i], "second": labels[j], "value": value} for i, j, value in told if abs(value) >= least > 0]


def _details(
    subject: _Subject, level: str, shared: Shapley, order: NDArray[np.int64], pairs: list[dict[str, Any]], total: float, pruned: int
) -> dict[str, Any]:
    q = np.array([subject.decision.q_values[name] for name in ACTION_NAMES])
    return {
        "level": level,
        "target": subject.target,
        "background": subject.background.name,
        "background_text": subject.background.text,
        "references": len(subject.background.features),
        "values_by_call": {name: shared.values[order, a].tolist() for a, name in enumerate(ACTION_NAMES)},
        "efficiency_gap": abs(total - float(q @ subject.weights)),
        "interactions": pairs,
        "interactions_computed": shared.interactions is not None,
        "pruned_laps": pruned,
    }
