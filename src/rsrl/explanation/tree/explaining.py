"""The tree's reading of one decision, and whether the policy agrees with it."""

import math

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.explanation.moment import Moment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.explanation.result import Decision, Explanation
from rsrl.explanation.tree.path import Interval, merge_path
from rsrl.state import ACTION_NAMES, Action
from rsrl.strategists import Tree, TreeRows, made_legal


def explain_tree(policy: ExplainedPolicy, moment: Moment, tree: Tree) -> Explanation:
    """The path of a decision through the tree, one row a feature.

    A row's value is what its questions add to the share of the leaf's call. The baseline is its share of all states the tree was fitted to;
    baseline and values add up to its share of those that came to the same leaf.

    Raises:
        RsrlError: the tree is of another model or race.
    """
    if tree.model_hash != policy.hash:
        raise RsrlError(f"the tree is of another model, {tree.model_hash}; {policy.name} is {policy.hash}; fit the tree again")
    if tree.race and tree.race != moment.record.name:
        raise RsrlError(f"the tree is for {tree.race}, the decision is of {moment.record.name}; fit a tree for that race")
    decision = policy.decide(moment)
    row = TreeRows(tree.columns).of_race(moment.raw)[-1]
    leaf = tree.leaf(row)
    answer = int(tree.action[leaf])
    call = int(made_legal(np.array([answer], np.int8), moment.legal[None])[0])
    intervals = merge_path(tree, row)
    shares = _path_shares(tree, row, answer)
    values = np.array([sum(shares[s + 1] - shares[s] for s in interval.steps) for interval in intervals])
    agrees = ACTION_NAMES[call] == decision.call
    return Explanation(
        method="tree",
        decision=decision,
        question=f"what leads the tree to {Action(answer)}",
        unit="share of states",
        labels=tuple(interval.sentence for interval in intervals),
        values=values,
        baseline=shares[0],
        budget=1,
        columns=_columns(intervals),
        details={
            "tree_call": ACTION_NAMES[call],
            "leaf_call": ACTION_NAMES[answer],
            "agrees": agrees,
            "leaf_samples": tree.samples[leaf].tolist(),
            "leaves": len(tree.leaves),
            "depth": tree.depth,
            "questions": len(tree.path(row)),
            "fitted_on": {"race": tree.race, "driver": tree.driver},
        },
        sentences=_sentences(policy, moment, tree, decision, leaf, call, intervals),
    )


def _path_shares(tree: Tree, row: NDArray[np.float32], answer: int) -> list[float]:
    """Share of a call among the samples of each node on a row's way."""
    shares, node = [_share(tree, 0, answer)], 0
    for condition in tree.path(row):
        node = int(tree.left[node] if condition.at_most else tree.right[node])
        shares.append(_share(tree, node, answer))
    return shares


def _share(tree: Tree, node: int, answer: int) -> float:
    total = int(tree.samples[node].sum())
    return float(tree.samples[node, answer]) / total if total else 0.0


def _columns(intervals: tuple[Interval, ...]) -> dict[str, list[object]]:
    return {
        "feature": [i.name for i in intervals],
        "text": [i.text for i in intervals],
        "condition": [i.words for i in intervals],
        "here": [i.shown for i in intervals],
        "unit": [i.unit for i in intervals],
        "lower": [i.lower if math.isfinite(i.lower) else None for i in intervals],
        "upper": [i.upper if math.isfinite(i.upper) else None for i in intervals],
    }


def _sentences(
    policy: ExplainedPolicy, moment: Moment, tree: Tree, decision: Decision, leaf: int, call: int, intervals: tuple[Interval, ...]
) -> tuple[str, ...]:
    answer = int(tree.action[leaf])
    if len(decision.legal) == 1:
        return (f"There is nothing to decide: {Action(ACTION_NAMES.index(decision.legal[0]))} is the only legal call.",)
    agreed = ACTION_NAMES[call] == decision.call
    says = f"The tree fitted to {policy.name} says {Action(call)}"
    says += (
        " too." if agreed else f", but the policy says {Action(ACTION_NAMES.index(decision.call))}: here the tree does not speak for it."
    )
    lines = [says]
    if call != answer:
        lines.append(f"Its leaf says {Action(answer)}, which may not be called now.")
    if intervals:
        lines.append(
            "It asks about " + "; ".join(f"{i.text} ({i.shown}: {i.words})" if i.shown != i.words else i.sentence for i in intervals) + "."
        )
    all_there, same = int(tree.samples[leaf].sum()), int(tree.samples[leaf][answer])
    lines.append(f"Of {all_there:,} states of fitting races that came to this leaf the policy called {Action(answer)} in {same:,}.")
    if tree.driver and tree.driver != moment.driver:
        lines.append(f"The tree was fitted on races of {tree.driver}, not of {moment.driver}.")
    return tuple(lines)
