"""An explanation as text: the decision, then each method's sentences and table, what-if first."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from rsrl.cli.output import table

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table

Json = Mapping[str, Any]

MOST_ROWS: Final = 12
MOST_COLUMNS: Final = 5
"""Further columns a table has room for; --json and --html have them all."""

LISTS: Final = ("safety-car table",)
"""Methods that are a table to look things up in; on paper or screen the rows on the plan are all shown."""

COLUMNS: Final = {
    "safety-car table": ("call", "share_calling_it", "stop_tried", "share_of_races"),
    "what-if": ("verdict", "mean_position", "chance_gain", "rejoin_place", "rejoin_gap_ahead_s", "time_s"),
    "attribution": ("value_here", "value_reference", "unit"),
}
"""Further columns of a method's table; other methods have their first ones."""

WIDEST: Final = 40
"""Characters from which a text is left to --json and --html."""

Z: Final = 1.96
"""Standard errors of a 95 % interval."""


def tables(document: Json) -> "list[RenderableType]":
    """What the command shows."""
    from rich.text import Text

    shown: list[RenderableType] = [Text(line) for line in _head(document)]
    for one in document["explanations"]:
        if one["method"] == "what-if":
            shown += explanation(one)
    shown += [_values(document["decision"])] if document["decision"] else []
    for one in document["explanations"]:
        if one["method"] != "what-if":
            shown += explanation(one)
    return shown + ([_paper(document["paper"])] if document["paper"] else [])


def explanation(one: Json) -> "list[RenderableType]":
    """One method: its table, then its sentences."""
    from rich.text import Text

    rows = [row for row in one["rows"] if row.get("mattered", True) and row.get("on_plan", True)]
    shown: list[RenderableType] = [_rows(one, rows)] if rows else [Text(f"\n{one['question']}", style="bold")]
    return [*shown, *(Text(f"  {sentence}") for sentence in one["sentences"])]


def _head(document: Json) -> list[str]:
    decision, where = document["decision"], f"{document['driver']} at {document['race']}"
    if decision is None:
        return [f"{where}, policy {document['model']}", *document["notes"]]
    than = f", {number(decision['margin'])} better than {decision['alternative']}" if decision["alternative"] else ""
    lines = [f"{where}, lap {decision['lap']}: the policy {document['model']} calls {decision['call']}{than}."]
    lines += [f"Warning, outside training: {line}." for line in document["warnings"]]
    return lines + document["notes"]


def _values(decision: Json) -> "Table":
    cells = [
        (name, number(value), "yes" if name in decision["legal"] else "no", "<- called" if name == decision["call"] else "")
        for name, value in decision["q_values"].items()
    ]
    return table("The policy's value of each call", ("call", "value", "legal", ""), cells)


def _rows(one: Json, rows: Sequence[Json]) -> "Table":
    estimated = any("standard_error" in row for row in rows)
    there = [name for name in rows[0] if name not in ("label", "value", "standard_error")]
    wordy = {name for name in there for row in rows if isinstance(row[name], str) and len(row[name]) > WIDEST}
    names = [name for name in COLUMNS.get(one["method"], there[:MOST_COLUMNS]) if name in there and name not in wordy]
    heads = ["", one["unit"] or "value", *(["+- 95 %"] if estimated else []), *(name.replace("_", " ") for name in names)]
    order = rows if one["method"] != "attribution" else sorted(rows, key=lambda row: -abs(row["value"] or 0.0))
    cells = []
    most = len(rows) if one["method"] in LISTS else MOST_ROWS
    for row in order[:most]:
        error = [number(Z * (row["standard_error"] or 0.0))] if estimated else []
        cells.append([row["label"], number(row["value"], "+"), *error, *(entry(row[name]) for name in names)])
    built = table(one["question"], heads, cells)
    if len(one["rows"]) > most:
        built.caption, built.caption_justify = f"{len(one['rows']) - most} more rows with --json", "left"
    return built


def number(value: float | None, sign: str = "") -> str:
    """Three digits, "-" where there is none."""
    return "-" if value is None else f"{value:{sign}.3g}"


def entry(value: Any) -> str:
    """An entry of a table, whatever JSON has there."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float) or value is None:
        return number(value)
    if isinstance(value, list):
        return " to ".join(entry(part) for part in value) if len(value) == 2 else ", ".join(entry(part) for part in value)
    return str(value)


def _paper(rows: Sequence[Json]) -> "Table":
    cells = [(row["question"], row["paper"], row["ours"], entry(row["agrees"])) for row in rows]
    return table("Lap 10 of Bahrain 2023: the paper's reading beside this one", ("", "the paper", "here", "agrees"), cells, left=3)
