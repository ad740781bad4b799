"""An explanation as text: the decision, then each method's sentences and table, what-if first."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from rsrl.cli.output import table
from rsrl.report.columns import amount, call, column, entry
from rsrl.report.explained import OWN, UNTOLD, error_of, half_interval, sentence_case
from rsrl.report.safety_cars import METHOD as SAFETY_CARS
from rsrl.report.safety_cars import WORTH, lines

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table

Json = Mapping[str, Any]

MOST_ROWS: Final = 12
MOST_COLUMNS: Final = 5
"""Most further columns of a table; --json and --html have them all."""

COLUMNS: Final = {
    "what-if": ("verdict", "mean_position", "chance_gain", "chance_lose", "stop_lap", "rejoin_place", "rejoin_gap_ahead_s", "time_s"),
    "attribution": ("value_here", "value_reference"),
    "tree": ("here",),
    "summary": ("for_a_stop", "position", "tyre", "tyre_age_laps", "status", "mattered"),
}
"""Further columns of a method's table; for other methods the first ones."""

HEADS: Final = {
    "mean_position": "place", "stop_lap": "box lap", "rejoin_place": "rejoins", "rejoin_gap_ahead_s": "ahead, s", "time_s": "time, s",
    "for_a_stop": "best stop",
}  # fmt: skip
"""Shorter heads than those of the page, for a terminal."""

ITS_CALL: Final = " (its call)"
"""Removed from labels, since the verdict says the same."""

WIDEST: Final = 40
"""Columns with longer texts are left to --json and --html."""


def tables(document: Json) -> "list[RenderableType]":
    """The text output of the command."""
    from rich.text import Text

    shown: list[RenderableType] = [Text(line) for line in _head(document)]
    for one in document["explanations"]:
        if one["method"] == "what-if":
            shown += explanation(one)
    shown += [_values(document["decision"], document["value_unit"])] if document["decision"] and document["decision"]["q_values"] else []
    for one in document["explanations"]:
        if one["method"] != "what-if":
            shown += explanation(one)
    return shown + ([_paper(document["paper"])] if document["paper"] else [])


def explanation(one: Json) -> "list[RenderableType]":
    """One method: its table, then its sentences."""
    from rich.text import Text

    if one["method"] == SAFETY_CARS:
        return [_prepared(one), *(Text(f"  {sentence}") for sentence in (*one["sentences"], WORTH))]
    rows = [row for row in one["rows"] if row.get("mattered", True)]
    shown: list[RenderableType] = [_rows(one, rows)] if rows else [Text(f"\n{sentence_case(one['question'])}", style="bold")]
    return [*shown, *(Text(f"  {sentence}") for sentence in one["sentences"])]


def _head(document: Json) -> list[str]:
    decision, where = document["decision"], f"{document['driver']} at {document['race']}"
    if decision is None:
        return [f"{where}, policy {document['model']}", *document["notes"]]
    unit = document["value_unit"]
    better = f"{amount(decision['margin'], unit, sign=False)} {unit} better than {call(decision['alternative'])} by its own values"
    than = ", the only legal call" if not decision["alternative"] else f", {better}" if decision["q_values"] else ""
    head = [f"{where}, lap {decision['lap']}: the policy {document['model']} calls {call(decision['call'])}{than}."]
    head += [f"Warning, outside training: {line}." for line in document["warnings"]]
    return head + document["notes"]


def _values(decision: Json, unit: str) -> "Table":
    cells = [
        (
            call(name),
            amount(value, unit, sign=False),
            "yes" if name in decision["legal"] else "no",
            "<- called" if name == decision["call"] else "",
        )
        for name, value in decision["q_values"].items()
    ]
    meaning = "minus expected position" if unit == "places" else unit
    return table("The policy's value of each call", ("call", meaning, "legal", ""), cells)


def _rows(one: Json, rows: Sequence[Json]) -> "Table":
    unit, method = one["unit"], one["method"]
    estimated = any(error_of(row) is not None for row in rows)
    there = [name for name in rows[0] if name not in (*OWN, *UNTOLD) and any(row[name] not in ("", None) for row in rows)]
    wordy = {name for name in there for row in rows if isinstance(row[name], str) and len(row[name]) > WIDEST}
    names = [name for name in COLUMNS.get(method, there[:MOST_COLUMNS]) if name in there and name not in wordy]
    heads = ["", unit or "value", *(["95 %"] if estimated else []), *(HEADS.get(name, column(name).head) for name in names)]
    order = rows if method != "attribution" else sorted(rows, key=lambda row: -abs(row["value"] or 0.0))
    cells = [
        [
            row["label"].removesuffix(ITS_CALL),
            amount(row["value"], unit),
            *([half_interval(row, unit)] if estimated else []),
            *(column(n).write(row[n]) for n in names),
        ]
        for row in order[:MOST_ROWS]
    ]
    built = table(sentence_case(one["question"]), heads, cells)
    built.columns[0].no_wrap = max(len(row["label"]) for row in rows) <= WIDEST
    for head, name in zip(built.columns[len(heads) - len(names) :], names, strict=True):
        head.no_wrap = column(name).words
    if len(one["rows"]) > MOST_ROWS:
        built.caption, built.caption_justify = f"{len(one['rows']) - MOST_ROWS} more rows with --json", "left"
    return built


def _prepared(one: Json) -> "Table":
    """The safety-car table for the policy's most common plan, one line a lap."""
    every = lines(one["rows"])
    on_plan = [line for line in every if line.on_plan] or every
    cells = [
        (f"{line.lap}", line.tyre, f"{line.age_laps}", *(text for a in line.answers for text in (a.call, a.worth))) for line in on_plan
    ]
    heads = ("lap", "tyre", "age, laps", "safety car", "worth", "virtual safety car", "worth")
    built = table("If a safety car comes out before the lap: the call, and places it gains", heads, cells)
    for i in (1, 3, 5):
        built.columns[i].justify = "left"
    if len(every) > len(on_plan):
        built.caption, built.caption_justify = (
            f"{len(every) - len(on_plan)} more lines, for sets off the plan, with --html or --json",
            "left",
        )
    return built


def _paper(rows: Sequence[Json]) -> "Table":
    cells = [(row["question"], row["paper"], row["ours"], entry(row["agrees"])) for row in rows]
    return table("Lap 10 of Bahrain 2023: the paper's findings beside these", ("", "the paper", "here", "agrees"), cells, left=3)
