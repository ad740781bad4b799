"""What a search for counterfactuals came to, as a result that people read."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.counterfactual.change import CAUSES
from rsrl.explanation.counterfactual.leaves import Leaves, leaf_report
from rsrl.explanation.counterfactual.nearest import Norm, cost_of
from rsrl.explanation.counterfactual.refining import Counterfactual
from rsrl.explanation.counterfactual.rollout_check import Share
from rsrl.explanation.counterfactual.space import described
from rsrl.explanation.counterfactual.words import labels_of, leaf_sentence, sentence_of, table_of
from rsrl.explanation.result import Decision, Explanation
from rsrl.state import ACTION_NAMES, Action

Level = Literal["last-lap", "consistent", "simulated"]
LEVELS: tuple[Level, ...] = ("last-lap", "consistent", "simulated")


@dataclass(frozen=True)
class Outcome:
    """All that was found for one decision and target; what `explain_counterfactual` tells in words and the fidelity study counts.

    Attributes:
        leaves: the tree's nearest leaves; None without a tree.
        last_lap, consistent: bool [leaves.found], which of them the policy confirms with the last lap substituted, and put into the race.
        causal: bool [leaves.found], which of them move a cause at all, and not only what follows from causes.
        found: verified counterfactuals, the best first.
        share: of runs in which the first of them holds; None where it was not simulated.
        asked: changed races the policy was asked about.
    """

    leaves: Leaves | None
    last_lap: NDArray[np.bool_]
    consistent: NDArray[np.bool_]
    causal: NDArray[np.bool_]
    found: tuple[Counterfactual, ...]
    share: Share | None
    asked: int


def _explanation(decision: Decision, wanted: int, norm: Norm, **rest: Any) -> Explanation:
    details = {"target": ACTION_NAMES[wanted], "norm": norm} | rest.pop("details")
    question = f"what would have to be different to {Action(wanted)}"
    return Explanation("counterfactual", decision, question, "scaled distance", details=details, **rest)


def only_one(decision: Decision) -> Explanation:
    """A decision with one legal call, explained as such."""
    sentence = f"There is nothing to choose on lap {decision.lap}: {Action(ACTION_NAMES.index(decision.call))} is the only legal call."
    return Explanation(
        "counterfactual", decision, "what would have to be different for another call", "scaled distance", (), np.zeros(0),
        details={"found": False, "reason": "one legal call"}, sentences=(sentence,),
    )  # fmt: skip


def told(decision: Decision, driver: str, wanted: int, norm: Norm, level: Level, outcome: Outcome) -> Explanation:
    """The best counterfactual found, with what the tree alone would say; or that none was found."""
    report = leaf_report(outcome.leaves, outcome.last_lap, outcome.consistent, outcome.causal) if outcome.leaves else None
    details: dict[str, Any] = {"found": bool(outcome.found), "nearest_leaf": report}
    details |= {"leaves_tried": len(outcome.leaves.found) if outcome.leaves else 0, "races_asked": outcome.asked}
    leaf = (leaf_sentence(report, Action(wanted)),) if outcome.leaves else ()
    if not outcome.found:
        sentence = (
            f"No change of up to three causes was found under which the policy would {Action(wanted)}, in {outcome.asked} changed races."
        )
        return _explanation(
            decision, wanted, norm, labels=(), values=np.zeros(0), budget=outcome.asked, details=details, sentences=(sentence, *leaf)
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
        "forced": not bool(best.legal[0]),
        "proposed_by": "tree" if best.from_leaf else "causes",
        "stops_on_the_way": [{"laps_from_now": n, "call": ACTION_NAMES[call]} for n, call in best.on_the_way],
        "others": [sentence_of(o, Action(wanted), driver) for o in outcome.found[1:]],
    }
    sentences = [sentence_of(best, Action(wanted), driver), *leaf]
    if level == "simulated":
        details["share"], words = _share(outcome.share)
        sentences.insert(1, words)
    return _explanation(
        decision, wanted, norm, labels=labels_of(best), values=best.distances[parts], budget=outcome.asked,
        columns=table_of(best), details=details, sentences=tuple(sentences),
    )  # fmt: skip


def _share(share: Share | None) -> tuple[dict[str, Any] | None, str]:
    if share is None:
        return None, "It could not be simulated: the change holds at once, and the laps before cannot be driven again."
    words = f"Driven on with everything hidden drawn anew, the policy makes that call in {share.share:.0%} of {share.runs} runs"
    words += f" (standard error {share.standard_error:.1%}, {share.laps} lap{'s' if share.laps != 1 else ''})."
    return {"value": share.share, "standard_error": share.standard_error, "runs": share.runs, "laps": share.laps}, words


def told_of_last_lap(decision: Decision, wanted: int, norm: Norm, outcome: Outcome) -> Explanation:
    """The nearest leaf that the policy confirms with the last lap substituted: the weakest check, and said to be."""
    leaves = outcome.leaves
    good = np.flatnonzero(outcome.last_lap)
    if leaves is None or not len(good):
        sentence = f"No leaf of the tree, put in the place of the last lap, makes the policy {Action(wanted)}."
        details: dict[str, Any] = {"found": False, "level": "last-lap"}
        return _explanation(
            decision, wanted, norm, labels=(), values=np.zeros(0), budget=outcome.asked, details=details, sentences=(sentence,)
        )
    found = leaves.found[good[0]]
    moved = np.flatnonzero(found.moved)
    names = tuple(leaves.space.names[i] for i in moved)
    words = f"{str(Action(wanted)).capitalize()} would be called with " + ", ".join(
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
        sentences=(words + ". Checked with the last lap substituted only: what follows from the change was not computed anew.",),
    )  # fmt: skip
