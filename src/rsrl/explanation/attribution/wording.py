"""An attribution in words: feature values with units, and sentences whose every number stands in the result."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.attribution.timeshap import Player
from rsrl.explanation.quantities import feature_text, quantity
from rsrl.explanation.result import Decision
from rsrl.state import ACTION_NAMES, COLUMN, NO_CAR_GAP_S, Action, Feature

Rows = NDArray[np.float32]
Typical = Callable[[NDArray[np.float64]], np.float64]
"""`np.mean` or `np.median`, by which several values of a number are summarised."""

GROUP_FEATURES: Final = 3
"""Features of a group whose values are shown, those furthest from the background first."""

MAX_NAMED: Final = 3
MIN_NAMED: Final = 0.05
"""At most so many players for and against a call are named, each with at least this share of the sum of all absolute values."""


def call_in_words(name: str) -> str:
    """A call of `ACTION_NAMES` as a strategist says it: "stay out", "box for soft"."""
    return str(Action(ACTION_NAMES.index(name)))


def shown_value(feature: Feature, rows: Rows, typical: Typical) -> str:
    """A feature's value over raw rows [R, RAW_SIZE], with its unit; of several rows the `typical` value, or the share of each category."""
    values = rows[:, COLUMN[feature.name]].astype(np.float64)
    if feature.kind == "category":
        shares = [(float((values == code).mean()), name) for code, name in enumerate(feature.categories)]
        shown = [name if share == 1 else f"{name} {100 * share:.0f} %" for share, name in shares if share > 0.005]
        return ", ".join(shown) if len(shown) <= 3 else "mixed"
    if feature.kind == "boolean":
        share = float(values.mean())
        return {0.0: "no", 1.0: "yes"}.get(share, f"yes {100 * share:.0f} %")
    if "gap" in feature.name and feature.name != "gap_to_leader_s":
        values = values[values < NO_CAR_GAP_S]
        if not len(values):
            return "no car"
    return quantity(feature, float(typical(values)))


@dataclass(frozen=True)
class Description:
    """A player's values in words.

    Attributes:
        here, reference: its value in the decision and in the background, with units; of a group, those of the features that differ most.
        brief: a clause on the feature that differs most.
    """

    here: str
    reference: str
    brief: str


def describe(player: Player, here: Rows, background: Rows, typical: Typical, difference: NDArray[np.float64]) -> Description:
    """A player's values; `difference` [features]: scaled distance of each of its features from the background."""
    order = np.argsort(-difference, kind="stable")
    most = player.features[order[0]]
    pair = (shown_value(most, here, typical), shown_value(most, background, typical))
    of = "" if len(player.features) == 1 else f"{feature_text(most)}: "
    brief = f"{of}{pair[0]} against {pair[1]}"
    if len(player.features) == 1:
        return Description(*pair, brief)
    several = [player.features[i] for i in order[:GROUP_FEATURES] if difference[i] > 0] or [most]
    shown, reference = ("; ".join(_in_full(f, rows, typical) for f in several) for rows in (here, background))
    return Description(shown, reference, brief)


def question(decision: Decision, target: str) -> str:
    """The question that the values answer."""
    if target == "call":
        return f"value of the call to {call_in_words(decision.call)}"
    return f"{call_in_words(decision.call)} rather than {call_in_words(decision.alternative)}"


def opening(decision: Decision, target: str, unit: str, baseline: float, background: str) -> list[str]:
    """The call, its margin, and the background it is compared with."""
    call = call_in_words(decision.call)
    illegal = [] if decision.call in decision.legal else [f"The policy calls to {call}, which the rules or the tyres left do not allow."]
    if target == "call":
        meaning = ", minus the finishing place it expects" if unit == "places" else f" {unit}"
        first = f"Lap {decision.lap}, {decision.driver}: {call} is valued at {decision.q_values[decision.call]:.2f}{meaning}"
        return [*illegal, f"{first}; for {background} it is {baseline:.2f}."]
    first = f"Lap {decision.lap}, {decision.driver}: {question(decision, target)}, by {decision.margin:.2f} {unit}"
    usual = ", so it is the usual call there" if baseline > 0 else ""
    return [*illegal, f"{first}; for {background} that difference is {baseline:+.2f}{usual}."]


def reasons(labels: Sequence[str], values: NDArray[np.float64], briefs: Sequence[str]) -> list[str]:
    """The players that speak most for a call and against it, each with its clause where there is one."""
    least = MIN_NAMED * np.abs(values).sum()
    sentences = []
    for sign, word in ((1, "For it"), (-1, "Against it")):
        order = [i for i in np.argsort(-sign * values, kind="stable") if sign * values[i] > 0 and abs(values[i]) >= least][:MAX_NAMED]
        if order:
            named = (f"{labels[i]} {values[i]:+.2f}" + (f" ({briefs[i]})" if briefs[i] else "") for i in order)
            sentences.append(f"{word}: " + ", ".join(named) + ".")
    return sentences or ["Nothing speaks for it or against it: every value is zero."]


def together(first: str, second: str, value: float, unit: str) -> str:
    """The interaction of two players."""
    return f"{first[:1].upper()}{first[1:]} and {second} together add {value:+.2f} {unit} to what each adds alone."


def _in_full(feature: Feature, rows: Rows, typical: Typical) -> str:
    return f"{feature_text(feature)}: {shown_value(feature, rows, typical)}"
