"""A decision's path through a tree, as an explanation: the questions about each feature merged into one interval, in natural units."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.explanation import quantities
from rsrl.explanation.moment import Moment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.explanation.result import Decision, Explanation
from rsrl.state import ACTION_NAMES, Action, feature_set
from rsrl.strategists import Condition, Tree, TreeColumn, TreeRows, describe, made_legal

_MOST_DECIMALS: Final = 6


@dataclass(frozen=True)
class Interval:
    """What a path demands of one feature.

    Attributes:
        name: of the column, or of the feature for categories.
        text: its plain name.
        words: the demand, such as "12 to 18 laps" or "soft".
        lower, upper: lower < value <= upper; infinite without a bound, NaN for categories.
        value: of the row; NaN for categories.
        unit: of lower, upper and value.
        shown: the row's value in words.
        steps: positions in the path of the questions merged into this interval.
    """

    name: str
    text: str
    words: str
    lower: float
    upper: float
    value: float
    unit: str
    shown: str
    steps: tuple[int, ...]

    @property
    def sentence(self) -> str:
        """Such as "laps to go: 12 to 18 laps"."""
        return f"{self.text}: {self.words}"


def explain_tree(policy: ExplainedPolicy, moment: Moment, tree: Tree) -> Explanation:
    """The path of a decision through the tree, one row a feature.

    A row's value is what its questions add to the share of states with the leaf's call. The baseline is the share among all states that the
    tree was fitted to; baseline and values sum to the share among the states of this leaf.

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
        question=f"conditions that lead the tree to its call: {Action(answer)}",
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
    """Share of a call among the samples of each node on a row's path."""
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
        return (f"There is no decision: {Action(ACTION_NAMES.index(decision.legal[0]))} is the only legal call.",)
    agreed = ACTION_NAMES[call] == decision.call
    own = str(Action(ACTION_NAMES.index(decision.call)))
    lines = [f"The tree of policy {policy.name} makes the same call: {own}."]
    if not agreed:
        lines = [f"The tree of policy {policy.name} calls {Action(call)}, but the policy calls {own}: here the tree does not explain it."]
    if call != answer:
        lines.append(f"Its leaf calls {Action(answer)}, which is not legal now.")
    if intervals:
        lines.append(
            "Its conditions: "
            + "; ".join(f"{i.text}: {i.shown} (condition: {i.words})" if i.shown != i.words else i.sentence for i in intervals)
            + "."
        )
    all_there, same = int(tree.samples[leaf].sum()), int(tree.samples[leaf][answer])
    lines.append(f"In the races it was fitted to, the policy called {Action(answer)} in {same:,} of {all_there:,} states of this leaf.")
    if tree.driver and tree.driver != moment.driver:
        lines.append(f"The tree was fitted to races of {tree.driver}, not of {moment.driver}.")
    return tuple(lines)


def merge_path(tree: Tree, row: np.ndarray) -> tuple[Interval, ...]:
    """The conditions on the path of a row float32 [C], one interval for each feature, in the order of the path."""
    path = tree.path(row)
    columns = [describe(name) for name in tree.columns]
    by_feature: dict[str, list[int]] = {}
    for step, condition in enumerate(path):
        column = columns[condition.column]
        by_feature.setdefault(column.feature if column.category else column.name, []).append(step)
    return tuple(_interval(name, steps, path, columns, row) for name, steps in by_feature.items())


def _interval(name: str, steps: list[int], path: Sequence[Condition], columns: Sequence[TreeColumn], row: np.ndarray) -> Interval:
    column = columns[path[steps[0]].column]
    value = float(row[path[steps[0]].column])
    if column.category:
        words, shown = _categories(name, [path[s] for s in steps], columns)
        text = column.text.rpartition(":")[0]
        return Interval(name, text, words, math.nan, math.nan, math.nan, "", shown, tuple(steps))
    lower = max((path[s].threshold for s in steps if not path[s].at_most), default=-math.inf)
    upper = min((path[s].threshold for s in steps if path[s].at_most), default=math.inf)
    if column.kind == "boolean":
        words = "yes" if value > 0.5 else "no"
        return Interval(name, column.text, words, lower, upper, value, "", words, tuple(steps))
    if column.whole:
        words, shown = whole_words(lower, upper, column.unit), whole_number(round(value), column.unit)
    else:
        words, shown = range_words(lower, upper, value, column.unit)
    return Interval(name, column.text, words, lower, upper, value, column.unit, shown, tuple(steps))


def _categories(feature: str, asked: Sequence[Condition], columns: Sequence[TreeColumn]) -> tuple[str, str]:
    """What the questions leave of a feature's categories, in words."""
    every = next(f.categories for f in feature_set("full") if f.name == feature)
    left = [c for c in every if not any(columns[q.column].category == c and q.at_most for q in asked)]
    for question in asked:
        if not question.at_most:
            left = [columns[question.column].category]
    words = " or ".join(left) if len(left) <= 2 else "not " + " nor ".join(c for c in every if c not in left)
    return words, words


def whole_words(lower: float, upper: float, unit: str) -> str:
    """lower < value <= upper in words, for whole numbers."""
    least = None if math.isinf(lower) else math.floor(lower) + 1
    most = None if math.isinf(upper) else math.floor(upper)
    if least == most and least is not None:
        return whole_number(least, unit)
    if least is None:
        return f"at most {whole_number(most or 0, unit)}"
    if most is None:
        return f"at least {whole_number(least, unit)}"
    return f"P{least} to P{most}" if unit == "place" else with_unit(f"{least} to {most}", unit)


def whole_number(value: int, unit: str) -> str:
    """Such as "P4", "1 lap", "12 laps"."""
    return f"P{value}" if unit == "place" else with_unit(str(value), unit)


def range_words(lower: float, upper: float, value: float, unit: str) -> tuple[str, str]:
    """lower < value <= upper, and the value, in words: with as few decimals as leave the statement true of the value shown."""
    for decimals in range(1, _MOST_DECIMALS + 1):
        low, high, here = (_rounded(x, decimals) for x in (lower, upper, value))
        if low < here <= high:
            break
    shown = with_unit(f"{here:.{decimals}f}", unit)
    if math.isinf(lower):
        return with_unit(f"at most {high:.{decimals}f}", unit), shown
    if math.isinf(upper):
        return with_unit(f"above {low:.{decimals}f}", unit), shown
    return with_unit(f"above {low:.{decimals}f}, at most {high:.{decimals}f}", unit), shown


def _rounded(value: float, decimals: int) -> float:
    return value if math.isinf(value) else round(value, decimals) + 0.0


def with_unit(number: str, unit: str) -> str:
    """A number with its unit; a ratio or a share has none, since a tree's thresholds are not percentages."""
    return number if unit in quantities.PERCENT else quantities.with_unit(number, unit)
