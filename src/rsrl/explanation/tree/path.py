"""A tree's way to its answer in words: every question about a feature merged into one interval, in natural units."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from rsrl.state import feature_set
from rsrl.strategists import Condition, Tree, TreeColumn, describe

_MOST_DECIMALS: Final = 6


@dataclass(frozen=True)
class Interval:
    """What a path demands of one feature.

    Attributes:
        name: of the column, or of the feature where it is about categories.
        text: plain name of it.
        words: what is demanded, such as "12 to 18 laps" or "soft".
        lower, upper: lower < value <= upper; infinite where there is no bound. For categories not a number.
        value: of the row, nan for categories.
        unit: of these.
        shown: the row's value in words.
        steps: questions of the path that it was merged from, their places in it.
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


def merge_path(tree: Tree, row: np.ndarray) -> tuple[Interval, ...]:
    """The questions that a row float32 [C] is asked, one interval a feature, in the order in which features are first asked about."""
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
    """A number with its unit; one of something that is counted in the singular."""
    if not unit or unit in ("ratio", "share"):
        return number
    if unit == "place":
        return f"P{number}"
    return f"{number} {unit[:-1] if number == '1' and unit.endswith('s') and len(unit) > 1 else unit}"
