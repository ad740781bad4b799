"""An attribution in words: values with their units as people know them, and sentences in which every number stands in the result."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.attribution.players import Player, feature_text
from rsrl.explanation.result import Decision
from rsrl.state import ACTION_NAMES, COLUMN, NO_CAR_GAP_S, Action, Feature

Rows = NDArray[np.float32]
Typical = Callable[[NDArray[np.float64]], np.float64]
"""`np.mean` or `np.median`: what stands for a number of which there are several."""

TOLD_OF_A_GROUP: Final = 3
"""Features of a group whose values are told, those furthest from the background first."""

NAMED: Final = 3
WORTH_NAMING: Final = 0.05
"""At most so many players for and against a call are named in a sentence, each with so much of the sum of all absolute shares."""

_UNITS: Final = {"share": "%", "ratio": "%"}


def call_in_words(name: str) -> str:
    """A call of `ACTION_NAMES` as a strategist says it: "stay out", "box for soft"."""
    return str(Action(ACTION_NAMES.index(name)))


def shown_unit(feature: Feature) -> str:
    """Unit of what `shown_value` gives."""
    return _UNITS.get(feature.unit, feature.unit)


def shown_value(feature: Feature, rows: Rows, typical: Typical) -> str:
    """A feature's value over raw rows [R, RAW_SIZE]: of one row as it is, of several what is `typical` or the share of each category."""
    values = rows[:, COLUMN[feature.name]].astype(np.float64)
    if feature.kind == "category":
        shares = [(float((values == code).mean()), name) for code, name in enumerate(feature.categories)]
        told = [name if share == 1 else f"{name} {share:.0%}" for share, name in shares if share > 0.005]
        return ", ".join(told) if len(told) <= 3 else "mixed"
    if feature.kind == "boolean":
        share = float(values.mean())
        return {0.0: "no", 1.0: "yes"}.get(share, f"yes {share:.0%}")
    if "gap" in feature.name and feature.name != "gap_to_leader_s":
        there = values[values < NO_CAR_GAP_S]
        return _number(float(typical(there))) if len(there) else "no car"
    value = float(typical(values))
    return f"{100 * value:.1f}" if feature.unit in _UNITS else _number(value)


@dataclass(frozen=True)
class Told:
    """What a player is like, in words.

    Attributes:
        here, usual: its value at hand and in the background; of a group, of its features that differ most.
        unit: of both; "" for a group, whose values bring theirs along.
        brief: one clause for a sentence: the one feature that differs most.
    """

    here: str
    usual: str
    unit: str
    brief: str


def tell(player: Player, here: Rows, background: Rows, typical: Typical, difference: NDArray[np.float64]) -> Told:
    """A player's values; `difference` [features] is how far each of its features is from the background, scaled."""
    order = np.argsort(-difference, kind="stable")
    most = player.features[order[0]]
    pair = (shown_value(most, here, typical), shown_value(most, background, typical))
    unit = shown_unit(most)
    of = "" if len(player.features) == 1 else f"{feature_text(most)} "
    brief = f"{of}{pair[0]} {unit}".strip() + f" against {pair[1]} {unit}".rstrip()
    if len(player.features) == 1:
        return Told(*pair, unit, brief)
    several = [player.features[i] for i in order[:TOLD_OF_A_GROUP] if difference[i] > 0] or [most]
    seen, usual = ("; ".join(_in_full(f, rows, typical) for f in several) for rows in (here, background))
    return Told(seen, usual, "", brief)


def question(decision: Decision, target: str) -> str:
    """What the values answer."""
    if target == "call":
        return f"value of the call to {call_in_words(decision.call)}"
    return f"{call_in_words(decision.call)} rather than {call_in_words(decision.alternative)}"


def opening(decision: Decision, target: str, unit: str, baseline: float, background: str) -> list[str]:
    """What the policy calls, by how much, and what it is compared with."""
    call = call_in_words(decision.call)
    illegal = [] if decision.call in decision.legal else [f"The policy calls to {call}, which the rules or the tyres left do not allow."]
    if target == "call":
        meaning = ", minus the finishing place it expects" if unit == "places" else f" {unit}"
        first = f"Lap {decision.lap}, {decision.driver}: {call} is valued at {decision.q_values[decision.call]:.2f}{meaning}"
        return [*illegal, f"{first}; for {background} it is {baseline:.2f}."]
    first = f"Lap {decision.lap}, {decision.driver}: {question(decision, target)}, by {decision.margin:.2f} {unit}"
    return [*illegal, f"{first}; for {background} that difference is {baseline:+.2f}."]


def reasons(labels: Sequence[str], values: NDArray[np.float64], briefs: Sequence[str]) -> list[str]:
    """What speaks most for a call and what against it, with a clause on each player where there is one."""
    least = WORTH_NAMING * np.abs(values).sum()
    sentences = []
    for sign, word in ((1, "For it"), (-1, "Against it")):
        order = [i for i in np.argsort(-sign * values, kind="stable") if sign * values[i] > 0 and abs(values[i]) >= least][:NAMED]
        if order:
            told = (f"{labels[i]} {values[i]:+.2f}" + (f" ({briefs[i]})" if briefs[i] else "") for i in order)
            sentences.append(f"{word}: " + ", ".join(told) + ".")
    return sentences or ["Nothing speaks for it or against it: every share is zero."]


def _in_full(feature: Feature, rows: Rows, typical: Typical) -> str:
    return f"{feature_text(feature)} {shown_value(feature, rows, typical)} {shown_unit(feature)}".strip()


def _number(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"
