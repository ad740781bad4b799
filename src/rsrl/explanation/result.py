"""The result type of all explanation methods: the decision, the values, and their uncertainty."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rsrl.drawing import VERDICT_COLOURS
from rsrl.errors import RsrlError
from rsrl.results import plain
from rsrl.statistics import Z

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Decision:
    """The call that is explained.

    Attributes:
        model, model_hash: name of the policy, and the first 16 hex digits of the SHA-256 of its weights.
        race, driver: whose race it is.
        lap: the lap of the call, 1 for the first.
        call: the policy's call, by name (`state.ACTION_NAMES`).
        alternative: the best other legal call, the first where calls have no values; "" if there is none.
        q_values: value of each call by name, in the policy's units: RSRL's are minus finishing positions. Empty for a policy from
            elsewhere, which gives calls alone.
        legal: names of the legal calls.
        warnings: what lies outside the policy's training, a line each.
    """

    model: str
    model_hash: str
    race: str
    driver: str
    lap: int
    call: str
    alternative: str
    q_values: Mapping[str, float]
    legal: tuple[str, ...]
    warnings: tuple[str, ...] = ()

    @property
    def margin(self) -> float:
        """Value of the call less that of the best other legal one; NaN if there is none or calls have no values."""
        return self.q_values[self.call] - self.q_values[self.alternative] if self.alternative and self.q_values else math.nan


@dataclass(frozen=True)
class Explanation:
    """Rows of an explanation: players of an attribution, options of a what-if, conditions of a path, changes of a counterfactual.

    Attributes:
        method: "attribution", "tree", "counterfactual", "what-if" ...
        decision: the decision explained.
        question: the question that `values` answer, in words: "stay out rather than box for medium".
        unit: of `values`.
        labels: plain name of each row [n].
        values: float64 [n].
        baseline: of an attribution, the value of the background, in the same unit; else 0.
        exact: the values are computed, not estimated.
        budget: network evaluations or races used.
        standard_errors: of `values`, float64 [n]; None if they are exact.
        columns: further columns of the table, each with n entries.
        details: further results, in types that JSON has.
        sentences: the explanation in words.
    """

    method: str
    decision: Decision
    question: str
    unit: str
    labels: tuple[str, ...]
    values: NDArray[np.float64]
    baseline: float = 0.0
    exact: bool = True
    budget: int = 0
    standard_errors: NDArray[np.float64] | None = None
    columns: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    details: Mapping[str, Any] = field(default_factory=dict)
    sentences: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        lengths = {"values": len(self.values)} | {name: len(column) for name, column in self.columns.items()}
        if self.standard_errors is not None:
            lengths["standard_errors"] = len(self.standard_errors)
        for name, length in lengths.items():
            if length != len(self.labels):
                raise RsrlError(f"explanation: {name} has {length} entries for {len(self.labels)} rows")
        if self.exact and self.standard_errors is not None:
            raise RsrlError("explanation: exact values have no standard errors")

    def to_frame(self) -> "pl.DataFrame":
        """One row for each label: label, value, standard_error if there is one, and the further columns."""
        import polars as pl

        errors = {} if self.standard_errors is None else {"standard_error": self.standard_errors}
        return pl.DataFrame({"label": list(self.labels), "value": self.values, **errors, **{k: list(v) for k, v in self.columns.items()}})

    def to_json(self) -> str:
        """Everything as a JSON object; NaN and infinity become null."""
        d = self.decision
        rows = [
            {"label": label, "value": float(value)}
            | ({} if self.standard_errors is None else {"standard_error": float(self.standard_errors[i])})
            | {name: column[i] for name, column in self.columns.items()}
            for i, (label, value) in enumerate(zip(self.labels, self.values, strict=True))
        ]
        document = {
            "method": self.method,
            "decision": vars(d) | {"q_values": dict(d.q_values), "margin": d.margin},
            "question": self.question,
            "unit": self.unit,
            "baseline": self.baseline,
            "exact": self.exact,
            "budget": self.budget,
            "rows": rows,
            "details": dict(self.details),
            "sentences": list(self.sentences),
        }
        return json.dumps(plain(document), allow_nan=False)

    def summary(self) -> str:
        """The sentences, or the three largest rows if there are none."""
        if self.sentences:
            return " ".join(self.sentences)
        order = np.argsort(-np.abs(self.values), kind="stable")[:3]
        return f"{self.question}: " + ", ".join(f"{self.labels[i]} {self.values[i]:+.3g} {self.unit}".strip() for i in order) + "."

    def plot(self, ax: "Axes | None" = None, rows: int = 12) -> "Axes":
        """Bars of the largest values with 95 % intervals, the largest on top."""
        import matplotlib.pyplot as plt

        axes = plt.subplots(figsize=(7, 0.4 * min(rows, len(self.labels)) + 1.2), layout="constrained")[1] if ax is None else ax
        order = np.argsort(-np.abs(self.values), kind="stable")[:rows][::-1]
        errors = None if self.standard_errors is None else Z * self.standard_errors[order]
        axes.barh(
            range(len(order)),
            self.values[order],
            xerr=errors,
            color=[VERDICT_COLOURS["better" if v >= 0 else "worse"] for v in self.values[order]],
        )
        axes.set_yticks(range(len(order)), [self.labels[i] for i in order])
        axes.axvline(0.0, color="black", linewidth=0.8)
        axes.set_xlabel(self.unit)
        axes.set_title(self.question, loc="left", fontsize=10)
        return axes
