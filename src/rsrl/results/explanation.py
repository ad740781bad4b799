"""Results of explaining: `explanation.json` of `rsrl explain --json`, and `explanations.json` of `rsrl study explanations`.

Rows of an explanation have the columns of their method, so they stay mappings; what every method has is checked here.
"""

from typing import Any, Final, Literal

from rsrl.errors import RsrlError
from rsrl.results.base import Number, Provenance, Result, from_plain

RowColumns = dict[str, Any]
"""A row of an explanation by column; `label` and `value` are always there."""


class ExplanationRow(Result, frozen=True):
    """What rows of all methods have."""

    label: str
    value: Number
    standard_error: Number = None


class SummaryRow(ExplanationRow, frozen=True, kw_only=True):
    """A lap of a race summary: the call, what the best stop was worth against staying out, the track, why it mattered."""

    lap: int
    call: str
    for_a_stop: Number
    status: str
    mattered: str


class SafetyCarRow(ExplanationRow, frozen=True, kw_only=True):
    """The call of a lap and tyre under a track status, and the share of states in which it is made."""

    lap: int
    compound: Literal["S", "M", "H"]
    tyre_age_laps: int
    on_plan: bool
    share_of_races: float
    track_status: str
    call: str
    share_calling_it: float
    value: float
    standard_error: float


ROWS: Final[dict[str, type[ExplanationRow]]] = {"summary": SummaryRow, "safety-car table": SafetyCarRow}
"""Rows of methods that have more than every method."""


class MethodResult(Result, frozen=True):
    """One explanation.

    Attributes:
        question: in words, what the values answer.
        unit: of the values.
        baseline: what the values start from.
        exact: computed, not estimated.
        budget: evaluations or races it took.
        sentences: the explanation in words.
    """

    method: str
    question: str
    unit: str
    baseline: Number
    exact: bool
    budget: int
    sentences: tuple[str, ...]
    rows: tuple[RowColumns, ...]

    def __post_init__(self) -> None:
        for i, row in enumerate(self.rows):
            try:
                from_plain(row, ROWS.get(self.method, ExplanationRow))
            except RsrlError as error:
                raise ValueError(f"rows[{i}]: {str(error).removeprefix('the whole: ')}") from None


class Decision(Result, frozen=True):
    """The call that is explained: by how much it is better than the best other legal call, and the value of each."""

    model: str
    model_hash: str
    lap: int
    call: str
    alternative: str
    margin: Number
    legal: tuple[str, ...]
    q_values: dict[str, Number]


class PaperReading(Result, frozen=True):
    """What the paper reads out of an explanation, beside this one; `agrees` is None where that cannot be told."""

    question: str
    paper: str
    ours: str
    agrees: bool | None


class Explained(Result, frozen=True, kw_only=True):
    """What the report shows of `explanation.json`; `lap` and `decision` are None for a race without a lap asked for."""

    race: str
    driver: str
    lap: int | None = None
    model: str
    model_hash: str
    warnings: tuple[str, ...]
    notes: tuple[str, ...] | None = None
    value_unit: str | None = None
    decision: Decision | None = None
    explanations: tuple[MethodResult, ...]
    paper: tuple[PaperReading, ...] | None = None
    provenance: Provenance


class JudgedGoal(Result, frozen=True):
    """A figure held against its goal.

    Attributes:
        met: None where it could not be judged; `why` says why.
        by_construction: the code makes it so; a figure that is off is a bug, and one that is not is no merit.
    """

    method: str
    what: str
    paper: str
    value: Number
    relation: str
    bound: Number
    met: bool | None
    why: str
    by_construction: bool


class ExplanationStudy(Result, frozen=True):
    """`explanations.json`; `figures` has what was measured of each method, under the names of `rsrl.explanation.fidelity`."""

    model: str
    model_hash: str
    race: str
    driver: str
    races: int
    goals: tuple[JudgedGoal, ...]
    figures: dict[str, dict[str, Any]]
    provenance: Provenance
