"""What would have to be different for another call: the smallest change of causes under which the policy itself makes it."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.explanation.counterfactual.asking import Asker
from rsrl.explanation.counterfactual.causes import CAUSE, CAUSES, HYPOTHETICAL, Alterer, Change, change_rows
from rsrl.explanation.counterfactual.costs import Costs
from rsrl.explanation.counterfactual.leaves import Leaves, confirmed_on_last_lap, leaf_report, nearest_leaves
from rsrl.explanation.counterfactual.nearest import Norm, cost_of
from rsrl.explanation.counterfactual.proposals import MOST_LAPS, Grid
from rsrl.explanation.counterfactual.search import Counterfactual, search
from rsrl.explanation.counterfactual.simulated import Share, simulated_share
from rsrl.explanation.counterfactual.space import described
from rsrl.explanation.counterfactual.words import labels_of, leaf_sentence, sentence_of, table_of
from rsrl.explanation.moment import Moment
from rsrl.explanation.result import Decision, Explanation
from rsrl.explanation.subject import ExplainedPolicy
from rsrl.state import ACTION_NAMES, Action, Observer
from rsrl.strategists import Tree

Level = Literal["last-lap", "consistent", "simulated"]
LEVELS: tuple[Level, ...] = ("last-lap", "consistent", "simulated")
OFTEN = 0.5
"""Share of runs from which on a counterfactual counts as simulated."""


@dataclass(frozen=True)
class Outcome:
    """All that was found for one decision and target; what `explain_counterfactual` tells in words and the fidelity study counts.

    Attributes:
        leaves: the tree's nearest leaves; None without a tree.
        last_lap, consistent: bool [leaves.found], which of them the policy confirms with the last lap substituted, and put into the race.
        causal: bool [leaves.found], which of them move a cause at all, and not only what follows from causes.
        found: verified counterfactuals, the best first.
        share: of runs in which the first of them holds; None where it was not simulated.
        on_the_way: other stops the policy would call for before that, as (laps from now, call).
        asked: changed races the policy was asked about.
    """

    leaves: Leaves | None
    last_lap: NDArray[np.bool_]
    consistent: NDArray[np.bool_]
    causal: NDArray[np.bool_]
    found: tuple[Counterfactual, ...]
    share: Share | None
    on_the_way: tuple[tuple[int, int], ...]
    asked: int


_NONE: NDArray[np.bool_] = np.zeros(0, np.bool_)


def find_counterfactual(
    policy: ExplainedPolicy,
    moment: Moment,
    tree: Tree | None,
    target: int,
    norm: Norm = "l1",
    *,
    simulate: bool = False,
    observer: Observer | None = None,
    seed: int = 0,
) -> Outcome:
    """Look for the smallest change under which the policy calls `target`; every candidate is checked on the policy."""
    alterer = Alterer(moment.record, moment.car, moment.arrays, observer)
    asker = Asker(policy, moment, alterer)
    grid = Grid(moment.raw[-1], target)
    expected = alterer(change_rows([Change(), *(Change(laps_later=float(n)) for n in range(1, MOST_LAPS + 1))])).raw
    costs = Costs(moment.record, policy.agent.feature_set, moment.raw[-1], expected)
    leaves, last_lap, consistent, causal = None, _NONE, _NONE, _NONE
    rows = np.zeros((0, len(CAUSES)), np.float32)
    if tree is not None:
        leaves = nearest_leaves(tree, moment, policy.agent.feature_set, target, norm)
        last_lap = confirmed_on_last_lap(asker, leaves, target)
        rows = np.concatenate([rows, *(grid.of_leaf(f, leaves.space) for f in leaves.found)])
        causal = np.array(~np.isnan(rows).all(axis=1), np.bool_)
        consistent = asker(rows).says(target) & causal if len(rows) else consistent
        rows = rows[consistent]
    found = search(asker, costs, target, norm, rows, grid.singles(), grid.pairs())
    share = None
    if simulate and found:
        found, share = _most_often(asker, found, target, seed)
    return Outcome(leaves, last_lap, consistent, causal, tuple(found), share, _on_the_way(asker, found, target), asker.asked)


def _on_the_way(asker: Asker, found: list[Counterfactual], target: int) -> tuple[tuple[int, int], ...]:
    """Other stops the policy would call for before the laps from now are over, as (laps from now, call), the first of each."""
    laps = found[0].change.laps_later if found else None
    if laps is None:
        return ()
    rows = np.repeat(found[0].row[None], int(laps), axis=0)
    rows[:, [i for i, cause in enumerate(CAUSES) if cause not in HYPOTHETICAL]] = np.nan
    rows[1:, CAUSE["laps_later"]] = np.arange(1, int(laps))
    first: dict[int, int] = {}
    for n, call in enumerate(asker(rows).calls.tolist()):
        if call not in (0, target):
            first.setdefault(call, n)
    return tuple(sorted((n, call) for call, n in first.items()))


def _most_often(asker: Asker, found: list[Counterfactual], target: int, seed: int) -> tuple[list[Counterfactual], Share | None]:
    """The first of the candidates that holds in most runs put in front; where none does, they stay as they are."""
    first: Share | None = None
    for i, one in enumerate(found):
        share = simulated_share(asker, one.row, one.starts, target, seed=seed)
        if share is not None and share.share >= OFTEN:
            return [one, *found[:i], *found[i + 1 :]], share
        first = share if i == 0 else first
    return found, first


def explain_counterfactual(
    policy: ExplainedPolicy,
    moment: Moment,
    tree: Tree | None,
    *,
    target: str | int | None = None,
    norm: Norm = "l1",
    level: Level = "consistent",
    observer: Observer | None = None,
    seed: int = 0,
) -> Explanation:
    """What would have to be different for the policy to make another call.

    Args:
        tree: the surrogate tree whose nearest leaves are tried first and reported; None for none.
        target: the call asked for, by name or number; None for the best other legal one.
        norm: "l0", "l1" or "l2": how distances are summed where as many causes change.
        level: the check that what is shown has passed. "last-lap": a leaf's features put into the last row; "consistent": the change put
            into the race, all that follows computed anew; "simulated": besides, in what share of runs the call is then made.
        observer: of the record and car, where there is one.
        seed: of the runs.

    Raises:
        RsrlError: an unknown call, norm or level; the call asked for is the one made; a tree of another model; "last-lap" without a tree.
    """
    decision = policy.decide(moment)
    if norm not in ("l0", "l1", "l2") or level not in LEVELS:
        raise RsrlError(f"counterfactual: no norm {norm!r} with level {level!r}; norms are l0, l1, l2 and levels {', '.join(LEVELS)}")
    if tree is not None and tree.model_hash and tree.model_hash != policy.hash:
        raise RsrlError(f"the tree is of another model, {tree.model_hash}; the policy asked for is {policy.hash}; fit the tree again")
    wanted = _target(decision, target)
    if wanted is None:
        return _only_one(decision)
    if level == "last-lap" and tree is None:
        raise RsrlError("a counterfactual checked on the last lap alone needs a tree; fit one, or ask for the level consistent")
    outcome = find_counterfactual(policy, moment, tree, wanted, norm, simulate=level == "simulated", observer=observer, seed=seed)
    if level == "last-lap":
        return _last_lap(decision, wanted, norm, outcome)
    return _told(decision, moment.driver, wanted, norm, level, outcome)


def _target(decision: Decision, target: str | int | None) -> int | None:
    """The call asked for; None where there is no other legal call."""
    if target is None:
        return ACTION_NAMES.index(decision.alternative) if decision.alternative else None
    names = {name: i for i, name in enumerate(ACTION_NAMES)} | {str(Action(i)): i for i in range(4)}
    wanted = names.get(target, -1) if isinstance(target, str) else target
    if wanted not in range(4):
        raise RsrlError(f"no call {target!r}; calls are {', '.join(ACTION_NAMES)}")
    if ACTION_NAMES[wanted] == decision.call:
        raise RsrlError(f"{decision.call} is the call already made for lap {decision.lap}; ask for another one")
    return wanted


def _explanation(decision: Decision, wanted: int, norm: Norm, **rest: Any) -> Explanation:
    details = {"target": ACTION_NAMES[wanted], "norm": norm} | rest.pop("details")
    question = f"what would have to be different to {Action(wanted)}"
    return Explanation("counterfactual", decision, question, "scaled distance", details=details, **rest)


def _only_one(decision: Decision) -> Explanation:
    sentence = f"There is nothing to choose on lap {decision.lap}: {Action(ACTION_NAMES.index(decision.call))} is the only legal call."
    return Explanation(
        "counterfactual", decision, "what would have to be different for another call", "scaled distance", (), np.zeros(0),
        details={"found": False, "reason": "one legal call"}, sentences=(sentence,),
    )  # fmt: skip


def _told(decision: Decision, driver: str, wanted: int, norm: Norm, level: Level, outcome: Outcome) -> Explanation:
    report = leaf_report(outcome.leaves, outcome.last_lap, outcome.consistent, outcome.causal) if outcome.leaves else None
    details: dict[str, Any] = {"found": bool(outcome.found), "nearest_leaf": report}
    details |= {"leaves_tried": len(outcome.leaves.found) if outcome.leaves else 0, "races_asked": outcome.asked}
    leaf = (leaf_sentence(report, Action(wanted)),) if outcome.leaves else ()
    if not outcome.found:
        told = f"No change of one or two causes was found under which the policy would {Action(wanted)}, in {outcome.asked} changed races."
        return _explanation(
            decision, wanted, norm, labels=(), values=np.zeros(0), budget=outcome.asked, details=details, sentences=(told, *leaf)
        )
    best = outcome.found[0]
    parts = [CAUSES.index(name) for name in best.change.parts]
    moved = ~np.isnan(best.row)
    details |= {
        "cost": float(cost_of(best.distances, moved, norm)),
        "distance": float(best.distances.sum()),
        "causes_changed": int(moved.sum()),
        "level": "simulated" if outcome.share is not None else "consistent",
        "q_values": dict(zip(ACTION_NAMES, best.q.tolist(), strict=True)),
        "reachable": best.change.reachable,
        "proposed_by": "tree" if best.from_leaf else "causes",
        "stops_on_the_way": [{"laps_from_now": n, "call": ACTION_NAMES[call]} for n, call in outcome.on_the_way],
        "others": [sentence_of(o, Action(wanted), driver) for o in outcome.found[1:]],
    }
    sentences = [sentence_of(best, Action(wanted), driver, outcome.on_the_way), *leaf]
    if level == "simulated":
        details["share"], told = _share(outcome.share)
        sentences.insert(1, told)
    return _explanation(
        decision, wanted, norm, labels=labels_of(best), values=best.distances[parts], budget=outcome.asked,
        columns=table_of(best), details=details, sentences=tuple(sentences),
    )  # fmt: skip


def _share(share: Share | None) -> tuple[dict[str, Any] | None, str]:
    if share is None:
        return None, "It could not be simulated: the change holds at once, and the laps before cannot be driven again."
    told = f"Driven on with everything hidden drawn anew, the policy makes that call in {share.share:.0%} of {share.runs} runs"
    told += f" (standard error {share.standard_error:.1%}, {share.laps} lap{'s' if share.laps != 1 else ''})."
    return {"value": share.share, "standard_error": share.standard_error, "runs": share.runs, "laps": share.laps}, told


def _last_lap(decision: Decision, wanted: int, norm: Norm, outcome: Outcome) -> Explanation:
    """The nearest leaf that the policy confirms with the last lap substituted: the weakest check, and said to be."""
    leaves = outcome.leaves
    good = np.flatnonzero(outcome.last_lap)
    if leaves is None or not len(good):
        told = f"No leaf of the tree, put in the place of the last lap, makes the policy {Action(wanted)}."
        details: dict[str, Any] = {"found": False, "level": "last-lap"}
        return _explanation(decision, wanted, norm, labels=(), values=np.zeros(0), budget=outcome.asked, details=details, sentences=(told,))
    found = leaves.found[good[0]]
    moved = np.flatnonzero(found.moved)
    names = tuple(leaves.space.names[i] for i in moved)
    told = f"{str(Action(wanted)).capitalize()} would be called with " + ", ".join(
        f"{described(n).text} {found.point[i]:.3g} {described(n).unit}".strip() + f" ({leaves.x[i]:.3g} now)"
        for n, i in zip(names, moved, strict=True)
    )
    return _explanation(
        decision, wanted, norm, labels=names, values=found.distance[moved], budget=outcome.asked,
        columns={"from": leaves.x[moved].tolist(), "to": found.point[moved].tolist()},
        details={
            "found": True, "level": "last-lap", "cost": found.cost, "features_changed": len(moved),
            "consistent": bool(outcome.consistent[good[0]]), "leaves_tried": len(leaves.found),
        },
        sentences=(told + ". Checked with the last lap substituted only: what follows from the change was not computed anew.",),
    )  # fmt: skip
