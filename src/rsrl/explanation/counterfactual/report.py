"""What a search for counterfactuals found, as a result with sentences. Every number in a sentence was put to the policy."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.counterfactual.change import CAUSE
from rsrl.explanation.counterfactual.leaves import NearestLeaves
from rsrl.explanation.counterfactual.rollout_check import RolloutShare
from rsrl.explanation.counterfactual.search import MAX_TIME_S, Counterfactual
from rsrl.explanation.counterfactual.space import Norm, cost_of, described
from rsrl.explanation.result import Decision, Explanation
from rsrl.season import COMPOUND_NAMES, TRACK_STATUS_NAMES
from rsrl.state import ACTION_NAMES, Action

LABELS: Final = {
    "laps_later": ("laps from now", "laps"),
    "laps_called": ("laps from now, called by the policy", "laps"),
    "time_lost_s": ("time lost", "s"),
    "gap_ahead_s": ("gap ahead", "s"),
    "gap_behind_s": ("gap behind", "s"),
    "track_status": ("track status", ""),
    "boxed_ahead": ("the car ahead has just boxed", ""),
    "boxed_behind": ("the car behind has just boxed", ""),
    "laps_older": ("laps by which the set is older", "laps"),
    "compounds_used": ("compounds used", ""),
    "soft_sets": ("sets of softs left", "sets"),
    "medium_sets": ("sets of mediums left", "sets"),
    "hard_sets": ("sets of hards left", "sets"),
}
"""Label and unit of each cause."""

NUMBERS: Final = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")
STATUS: Final = ("on a green track", "under a virtual safety car", "under a safety car")
PARTICIPLE: Final = ("stayed out", *(f"boxed for {name}" for name in COMPOUND_NAMES))
"""Each call in the past tense."""


@dataclass(frozen=True)
class SearchResult:
    """All that was found for one decision and target: `explain_counterfactual` puts it into words, the fidelity study counts it.

    Attributes:
        leaves: the tree's nearest leaves; None without a tree.
        confirmed_on_last_lap, confirmed_consistent: which of the leaves the policy confirms, bool [leaves], with the last lap
            substituted, and with the change made to the race.
        names_a_cause: which of the leaves move a cause, and not only what follows from causes, bool [leaves].
        found: counterfactuals that the policy confirms, the best first.
        share: rollouts in which the first of them holds; None where it was not rolled out.
        asked: edited races that the policy was asked about.
    """

    leaves: NearestLeaves | None
    confirmed_on_last_lap: NDArray[np.bool_]
    confirmed_consistent: NDArray[np.bool_]
    names_a_cause: NDArray[np.bool_]
    found: tuple[Counterfactual, ...]
    share: RolloutShare | None
    asked: int


def no_alternative(decision: Decision) -> Explanation:
    """The explanation of a decision with one legal call."""
    sentence = f"There is nothing to choose on lap {decision.lap}: {Action(ACTION_NAMES.index(decision.call))} is the only legal call."
    return Explanation(
        "counterfactual", decision, "what would have to be different for another call", "scaled distance", (), np.zeros(0),
        details={"found": False, "reason": "one legal call"}, sentences=(sentence,),
    )  # fmt: skip


def report(decision: Decision, target: int, norm: Norm, result: SearchResult, *, rolled_out: bool) -> Explanation:
    """The best counterfactual found, or that none was found, with what the tree alone would say."""
    leaf = _nearest_leaf(result)
    details: dict[str, Any] = {"found": bool(result.found), "nearest_leaf": leaf}
    details |= {"leaves_tried": len(result.leaves.points) if result.leaves else 0, "races_asked": result.asked}
    on_leaf = (_leaf_sentence(leaf, Action(target)),) if result.leaves else ()
    if not result.found:
        sentence = f"No change of up to three causes was found under which the policy would {Action(target)}; {result.asked:,} edited races"
        return _explanation(decision, target, norm, result, details=details, sentences=(sentence + " were tried.", *on_leaf))
    best = result.found[0]
    changed = ~np.isnan(best.row)
    details |= {
        "cost": float(cost_of(best.distances, changed, norm)),
        "distance": float(best.distances.sum()),
        "causes_changed": int(changed.sum()),
        "level": "simulated" if result.share is not None else "consistent",
        "q_values": dict(zip(ACTION_NAMES, best.q.tolist(), strict=True)),
        "reachable": best.change.reachable,
        "forced": not bool(best.legal[0]),
        "proposed_by": "tree" if best.from_leaf else "causes",
        "stops_on_the_way": [{"laps_from_now": n, "call": ACTION_NAMES[call]} for n, call in best.stops_before],
        "others": [sentence_of(one, target, decision.driver) for one in result.found[1:]],
    }
    sentences = [sentence_of(best, target, decision.driver), *on_leaf]
    if rolled_out:
        details["share"] = None if result.share is None else _share_document(result.share)
        sentences.insert(1, _share_sentence(result.share))
    labels = tuple(LABELS[cause][0] for cause in best.change.parts)
    return _explanation(
        decision, target, norm, result, labels=labels, values=best.distances[changed], columns=_table(best), details=details,
        sentences=tuple(sentences),
    )  # fmt: skip


def report_on_last_lap(decision: Decision, target: int, norm: Norm, result: SearchResult) -> Explanation:
    """The nearest leaf that the policy confirms with the last lap substituted: the weakest check, and labelled as such."""
    leaves, confirmed = result.leaves, np.flatnonzero(result.confirmed_on_last_lap)
    if leaves is None or not len(confirmed):
        sentence = f"No leaf of the tree, put into the last lap, makes the policy {Action(target)}."
        return _explanation(decision, target, norm, result, details={"found": False, "level": "last-lap"}, sentences=(sentence,))
    point = leaves.points[confirmed[0]]
    moved = np.flatnonzero(point.moved)
    names = tuple(leaves.space.names[i] for i in moved)
    changes = (
        f"{described(n).text} {point.point[i]:.3g} {described(n).unit}".strip() + f" ({leaves.x[i]:.3g} now)"
        for n, i in zip(names, moved, strict=True)
    )
    sentence = f"The policy would {Action(target)} with {', '.join(changes)}."
    check = "Checked only with these features put into the last lap: what follows from the change was not computed anew."
    return _explanation(
        decision, target, norm, result, labels=names, values=point.distance[moved],
        columns={"from": leaves.x[moved].tolist(), "to": point.point[moved].tolist()},
        details={
            "found": True, "level": "last-lap", "cost": point.cost, "features_changed": len(moved),
            "consistent": bool(result.confirmed_consistent[confirmed[0]]), "leaves_tried": len(leaves.points),
        },
        sentences=(f"{sentence} {check}",),
    )  # fmt: skip


def _explanation(decision: Decision, target: int, norm: Norm, result: SearchResult, **rest: Any) -> Explanation:
    parts: dict[str, Any] = {"labels": (), "values": np.zeros(0)} | rest
    parts["details"] = {"target": ACTION_NAMES[target], "norm": norm} | parts["details"]
    question = f"what would have to be different to {Action(target)}"
    return Explanation("counterfactual", decision, question, "scaled distance", budget=result.asked, **parts)


def _nearest_leaf(result: SearchResult) -> dict[str, Any] | None:
    """The nearest leaf as the paper reports it: what moves, how many features and how far; and whether the policy confirms it."""
    leaves = result.leaves
    if leaves is None or not leaves.points:
        return None
    nearest = leaves.points[0]
    moved = np.flatnonzero(nearest.moved).tolist()
    start, end, distance = leaves.x, nearest.point, nearest.distance
    return {
        "leaf": nearest.leaf,
        "distance": nearest.cost,
        "features_changed": len(moved),
        "changes": [
            {"feature": leaves.space.names[i], "from": float(start[i]), "to": float(end[i]), "distance": float(distance[i])} for i in moved
        ],
        "confirmed_on_last_lap": bool(result.confirmed_on_last_lap[0]),
        "names_a_cause": bool(result.names_a_cause[0]),
        "confirmed_consistent": bool(result.confirmed_consistent[0]),
        "tree_says": leaves.tree_call,
    }


def _leaf_sentence(leaf: dict[str, Any] | None, target: Action) -> str:
    """The tree's own counterfactual, and whether it can be trusted."""
    if leaf is None:
        return f"The tree has no leaf that can be reached from here in which it would {target}."
    n = leaf["features_changed"]
    if n == 0:
        return f"The tree would already {target} here; the policy would not."
    verdict = "the policy does not confirm it"
    if leaf["confirmed_consistent"]:
        verdict = "the policy confirms it"
    elif leaf["confirmed_on_last_lap"]:
        verdict = "the policy confirms it only while features that follow from it keep their values"
    elif not leaf["names_a_cause"]:
        verdict = "it changes only features that follow from others, and the policy does not confirm it"
    distance = f"{n} feature{'s' if n != 1 else ''} and a distance of {leaf['distance']:.3f}"
    return f"The nearest leaf in which the tree would {target} is {distance} away; {verdict}."


def _table(found: Counterfactual) -> dict[str, list[Any]]:
    """Columns of the result: each cause, its values from and to, the condition on the second, its unit."""
    rows: dict[str, list[Any]] = {"cause": [], "from": [], "to": [], "condition": [], "unit": []}
    for cause in found.change.parts:
        start, end = found.starts[CAUSE[cause]], float(found.row[CAUSE[cause]])
        named = cause == "track_status"
        rows["cause"].append(cause)
        rows["from"].append(TRACK_STATUS_NAMES[int(start)] if named else round(float(start), 1))
        rows["to"].append(TRACK_STATUS_NAMES[int(end)] if named else round(end, 1))
        rows["condition"].append(_condition(found, cause))
        rows["unit"].append(LABELS[cause][1])
    return rows


def _condition(found: Counterfactual, cause: str) -> str:
    """How far beyond its value a time holds; "exactly" for any other cause."""
    if cause not in found.holds_to:
        return "exactly"
    end, rises = found.holds_to[cause], found.row[CAUSE[cause]] > found.starts[CAUSE[cause]]
    if rises:
        return "at least" if end >= MAX_TIME_S else f"up to {end:.1f}"
    return "at most" if end <= 0.0 else f"down to {end:.1f}"


def sentence_of(found: Counterfactual, target: int, driver: str) -> str:
    """A counterfactual in one sentence: "The policy would box for hard in eight laps, under a safety car."."""
    would = f"would {Action(target)}" if found.change.reachable else f"would have {PARTICIPLE[target]}"
    sentence = f"The policy {would} " + ", ".join(_conditions(found, driver))
    if past := _past_conditions(found):
        sentence = f"{sentence.rstrip()}, " + " and ".join(past)
    if found.change.laps_later and found.stops_before:
        n, call = found.stops_before[0]
        earlier = f"would {Action(call)} in {_laps(n)}" if n else f"calls to {Action(call)} now"
        sentence += f"; until then the car has to stay out, although the policy {earlier}"
    return sentence + ("." if found.legal[0] else "; the rules leave no choice but a stop there.")


def _conditions(found: Counterfactual, driver: str) -> list[str]:
    """Conditions that the race can still come to."""
    c, words = found.change, []
    if c.laps:
        words.append(f"in {_laps(c.laps)}")
    if c.laps_called and found.stops_before:
        stops = (f"for {COMPOUND_NAMES[call - 1]} {'in ' + _laps(n) if n else 'now'}" for n, call in found.stops_before)
        words.append(f"after boxing {' and '.join(stops)}")
    if c.time_lost_s is not None:
        words.append(f"after losing {_seconds(found, 'time_lost_s')}")
    if c.track_status is not None:
        words.append(STATUS[int(c.track_status)])
    for side in ("ahead", "behind"):
        if (cause := f"gap_{side}_s") in c.parts:
            then = "expected by then" if c.laps else "now"
            words.append(f"with the gap {side} at {_seconds(found, cause)} ({found.starts[CAUSE[cause]]:.1f} s {then})")
    return words + [f"if the car {side} of {driver} had just boxed" for side in ("ahead", "behind") if f"boxed_{side}" in c.parts]


def _past_conditions(found: Counterfactual) -> list[str]:
    """Conditions that only another past could have brought."""
    c, words = found.change, []
    if c.laps_older is not None:
        words.append(f"had the set been {_laps(int(c.laps_older))} older")
    if c.compounds_used is not None:
        words.append("had only one compound been used so far" if c.compounds_used == 1 else "had two compounds been used by now")
    for name, sets in zip(COMPOUND_NAMES, (c.soft_sets, c.medium_sets, c.hard_sets), strict=True):
        if sets is not None:
            words.append(f"had there been {'a' if sets else 'no'} set of {name}s left")
    return words


def _seconds(found: Counterfactual, cause: str) -> str:
    """A time, with how far beyond it the call holds."""
    value, end = float(found.row[CAUSE[cause]]), found.holds_to[cause]
    if value > found.starts[CAUSE[cause]]:
        return f"{value:.1f} s or more" if end >= MAX_TIME_S else f"{value:.1f} to {end:.1f} s"
    return f"{value:.1f} s or less" if end <= 0.0 else f"{end:.1f} to {value:.1f} s"


def _laps(n: int) -> str:
    return f"{NUMBERS[n] if n < len(NUMBERS) else n} lap{'s' if n != 1 else ''}"


def _share_document(share: RolloutShare) -> dict[str, Any]:
    return {"value": share.share, "standard_error": share.standard_error, "runs": share.runs, "laps": share.laps}


def _share_sentence(share: RolloutShare | None) -> str:
    if share is None:
        return "It was not checked in rollouts: the change holds at once, and the laps before it cannot be simulated again."
    error = f"standard error {share.standard_error:.1%}, {share.laps} lap{'s' if share.laps != 1 else ''}"
    return f"In rollouts with all hidden state drawn anew, the policy makes that call in {share.share:.0%} of {share.runs} ({error})."
