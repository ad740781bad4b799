"""An explanation as text: the decision, then each method's sentences and table, what-if first."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from rich.text import Text

from rsrl.cli.output import Column, FittedTable, Shown, table
from rsrl.report.columns import amount, call, column, entry
from rsrl.report.explained import OWN, UNTOLD, error_of, half_interval, sentence_case
from rsrl.report.safety_cars import METHOD as SAFETY_CARS
from rsrl.report.safety_cars import WORTH, lines

Json = Mapping[str, Any]

MOST_ROWS: Final = 12
MOST_IN_BRIEF: Final = 5
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

OWN_CALL: Final = "itself"
"""Verdict on the option that is the policy's call."""

ITS_CALL: Final = " (its call)"
"""Removed from labels, since the verdict says the same."""

WIDEST: Final = 40
"""Columns with longer texts are left to --json and --html."""


def tables(document: Json) -> list[Shown]:
    """The text output of the command."""
    shown: list[Shown] = [*_head(document), ""]
    for one in document["explanations"]:
        if one["method"] == "what-if":
            shown += explanation(one)
    shown += [_values(document["decision"], document["value_unit"])] if document["decision"] and document["decision"]["q_values"] else []
    for one in document["explanations"]:
        if one["method"] != "what-if":
            shown += explanation(one)
    return shown + ([_paper(document["paper"])] if document["paper"] else [])


def in_brief(document: Json) -> list[Shown]:
    """The decision, and what each other call at once would have led to, in at most eight lines of a narrow terminal."""
    (one,) = (one for one in document["explanations"] if one["method"] == "what-if")
    others = [row for row in one["rows"] if row["verdict"] != OWN_CALL and not row["in_laps"]][:MOST_IN_BRIEF]
    width = max((len(row["label"]) for row in others), default=0)
    lines = [f"  {row['label']:{width}}  {amount(row['value'], one['unit'])} {half_interval(row, one['unit'])}" for row in others]
    title = f"Places that another call loses, over the same {one['details']['races']:,} futures (95 % interval):"
    return [*_head(document), Text(title, style="bold"), *lines, ""]


def explanation(one: Json) -> list[Shown]:
    """One method: its table, then its sentences."""
    if one["method"] == SAFETY_CARS:
        return [_prepared(one), *one["sentences"], WORTH, ""]
    rows = [row for row in one["rows"] if row.get("mattered", True)]
    shown: list[Shown] = [_rows(one, rows)] if rows else [Text(sentence_case(one["question"]), style="bold")]
    return [*shown, *one["sentences"], ""]


def _head(document: Json) -> list[str]:
    decision, where = document["decision"], f"{document['driver']} at {document['race']}"
    if document["race_number"] is not None:
        where += f", race {document['race_number']} of seed {document['seed']}"
    if decision is None:
        return [f"{where}, policy {document['model']}", *document["notes"]]
    unit = document["value_unit"]
    better = f"{amount(decision['margin'], unit, sign=False)} {unit} better than {call(decision['alternative'])} by its own values"
    than = ", the only legal call" if not decision["alternative"] else f", {better}" if decision["q_values"] else ""
    head = [f"{where}, lap {decision['lap']}: the policy {document['model']} calls {call(decision['call'])}{than}."]
    head += [f"Warning, outside training: {line}." for line in document["warnings"]]
    return head + document["notes"]


def _values(decision: Json, unit: str) -> FittedTable:
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


def _rows(one: Json, rows: Sequence[Json]) -> FittedTable:
    unit, method = one["unit"], one["method"]
    estimated = any(error_of(row) is not None for row in rows)
    there = [name for name in rows[0] if name not in (*OWN, *UNTOLD) and any(row[name] not in ("", None) for row in rows)]
    wordy = {name for name in there for row in rows if isinstance(row[name], str) and len(row[name]) > WIDEST}
    names = [name for name in COLUMNS.get(method, there[:MOST_COLUMNS]) if name in there and name not in wordy]
    heads = [Column("", words=True), Column(unit or "value"), *([Column("95 %")] if estimated else [])]
    heads += [Column(HEADS.get(name, column(name).head), number, column(name).words) for number, name in enumerate(names)]
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
    more = [f"{len(one['rows']) - MOST_ROWS} more rows with --json"] if len(one["rows"]) > MOST_ROWS else []
    return table(sentence_case(one["question"]), heads, cells, captions=more)


def _prepared(one: Json) -> FittedTable:
    """The safety-car table for the policy's most common plan, one line a lap."""
    every = lines(one["rows"])
    on_plan = [line for line in every if line.on_plan] or every
    cells = [
        (f"{line.lap}", line.tyre, f"{line.age_laps}", *(text for a in line.answers for text in (a.call, a.worth))) for line in on_plan
    ]
    heads = (
        "lap", Column("tyre", words=True), "age, laps", Column("safety car", words=True), "worth",
        Column("virtual safety car", words=True), "worth",
    )  # fmt: skip
    off_plan = len(every) - len(on_plan)
    more = [f"{off_plan} more lines, for sets off the plan, with --html or --json"] if off_plan else []
    return table("If a safety car comes out before the lap: the call, and places it gains", heads, cells, captions=more)


def _paper(rows: Sequence[Json]) -> FittedTable:
    cells = [(row["question"], row["paper"], row["ours"], entry(row["agrees"])) for row in rows]
    heads = [Column(head, words=True) for head in ("", "the paper", "here", "agrees")]
    return table("Lap 10 of Bahrain 2023: the paper's findings beside these", heads, cells)
