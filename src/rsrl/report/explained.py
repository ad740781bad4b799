"""Sections of one decision explained: what-if first, then the decision with its warnings, then the methods one after another."""

from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

from rsrl.report.bars import Z, bars
from rsrl.report.markup import Child, Markup, element, together
from rsrl.report.numbers import MISSING, counted, three, whole
from rsrl.report.race_line import race_line
from rsrl.report.tables import table

Json = Mapping[str, Any]

TITLES: Final = {
    "what-if": "What if: every option driven on from here",
    "safety-car table": "The calls prepared for a safety car",
    "attribution": "What the policy looked at",
    "tree": "The same call as a decision tree makes it",
    "counterfactual": "What would change the call",
    "summary": "The race, and the laps that mattered",
}
"""Title of each method's section."""

FIRST: Final = ("what-if", "safety-car table")
"""Stand before the decision itself: what a strategist asks first."""

IF_ASKED: Final = ", if a "
"""Stands in the question of a what-if about a track status that is not the race's."""

TABLES: Final[dict[str, tuple[tuple[str, tuple[str, ...]], ...]]] = {
    "what-if": (
        (
            "",
            (
                "verdict",
                "mean_position",
                "points",
                "chance_gain",
                "chance_lose",
                "rejoin_place",
                "rejoin_gap_ahead_s",
                "rejoin_gap_behind_s",
            ),
        ),
        ("Where the time to the flag comes from, s", ("time_s", "pit_s", "tyre_s", "traffic_s", "safety_car_s")),
    ),
}
"""Captions and columns of a method's tables; other methods have one table with all their columns."""

LISTS: Final = ("safety-car table",)
"""Methods that are a table to look things up in: all of it is shown, and nothing drawn."""

MOST_ROWS: Final = 40
"""Of other tables; a long explanation has its other rows in the JSON."""

WORDY: Final = 30
"""Characters from which entries of a table read as text, and are aligned as such."""

OWN: Final = ("label", "value", "standard_error")


class Part(NamedTuple):
    """A section: its place in links, its heading, its body."""

    id: str
    title: str
    body: Markup


def explained(document: Json) -> list[Part]:
    """Sections of `explanation.json`."""
    made = sorted(document["explanations"], key=lambda one: _rank(one["method"]))
    parts = [_part(one) for one in made if one["method"] in FIRST]
    if document.get("decision"):
        parts.append(Part("decision", "The decision", _decision(document["decision"], document["warnings"])))
    parts += [_part(one) for one in made if one["method"] not in FIRST]
    if document.get("paper"):
        parts.append(Part("paper", "The paper's reading beside this one", _paper(document["paper"])))
    return _apart(parts)


def _part(one: Json) -> Part:
    method = str(one["method"])
    title = TITLES.get(method, method)
    if method == "what-if" and IF_ASKED in one["question"]:
        title = "If a " + one["question"].rpartition(IF_ASKED)[2]
    return Part(_place(method), title, _explanation(one))


def _place(method: str) -> str:
    return method.replace(" ", "-")


def _rank(method: str) -> int:
    return list(TITLES).index(method) if method in TITLES else len(TITLES)


def _apart(parts: list[Part]) -> list[Part]:
    """Two sections of one method get places of their own."""
    seen: dict[str, int] = {}
    named = []
    for part in parts:
        seen[part.id] = seen.get(part.id, 0) + 1
        named.append(part if seen[part.id] == 1 else part._replace(id=f"{part.id}-{seen[part.id]}"))
    return named


def _decision(decision: Json, warnings: Sequence[str]) -> Markup:
    best = decision["alternative"]
    told = f"For lap {decision['lap']} the policy {decision['model']} calls: {decision['call']}"
    told += f", {three(decision['margin'])} better than {best} by its own values." if best else ", the only legal call."
    rows = [
        [name, three(value), "yes" if name in decision["legal"] else "no", _role(name, decision)]
        for name, value in decision["q_values"].items()
    ]
    note = (
        f"Model {decision['model']}, weights {decision['model_hash']}. Values are the policy's own: RSRL's are minus finishing positions."
    )
    return together(
        element("p", told),
        [element("p", f"Outside what the policy was trained on: {line}.", class_="warning") for line in warnings],
        table("The policy's value of each call", ["call", "value", "legal", ""], rows, note=note),
    )


def _role(name: str, decision: Json) -> str:
    return "called" if name == decision["call"] else "next best" if name == decision["alternative"] else ""


def _explanation(one: Json) -> Markup:
    return together(
        element("ul", [element("li", sentence) for sentence in one["sentences"]], class_="summary") if one["sentences"] else "",
        _figure(one),
        [_table(one, *shown) for shown in TABLES.get(one["method"], (("", ()),))] if one["rows"] else "",
    )


def _figure(one: Json) -> Markup:
    alt = f"{one['question']}; the table below has the values"
    if one["method"] in LISTS:
        return Markup("")
    if one["method"] == "summary":
        drawn = race_line(one["rows"], one["unit"], alt)
    else:
        options = one["method"] == "what-if"
        drawn = bars(one["rows"], one["unit"], alt, sort=not options, low_is_good=options)
    return element("figure", element("figcaption", one["question"]), drawn) if drawn else drawn


def _table(one: Json, caption: str, wanted: Sequence[str]) -> Markup:
    rows = [row for row in one["rows"] if row["mattered"]] if one["method"] == "summary" else one["rows"]
    there = [name for name in rows[0] if name not in OWN] if rows else []
    columns = [name for name in wanted if name in there] if wanted else there
    first = not caption  # a further table does not say the values again
    estimated = first and bool(rows) and "standard_error" in rows[0]
    heads = ["", *([one["unit"] or "value"] if first else []), *(["95 %"] if estimated else []), *(n.replace("_", " ") for n in columns)]
    shown = rows if one["method"] in LISTS else rows[:MOST_ROWS]
    cells = [_cells(row, columns, first, estimated) for row in shown]
    if not rows or len(heads) == 1:
        return Markup("")
    wordy = any(isinstance(row[name], str) and len(row[name]) > WORDY for row in rows for name in columns)
    note = _note(one, len(rows) - len(shown)) if first else ""
    return table(caption or one["question"], heads, cells, note=note, class_="runs" if wordy else None)


def _cells(row: Json, columns: Sequence[str], valued: bool, estimated: bool) -> list[Child]:
    error = row.get("standard_error")
    value = [three(row["value"], sign=True)] if valued else []
    interval = [MISSING if error is None else f"±{three(Z * error)}"] if estimated else []
    return [row["label"], *value, *interval, *(cell(row[name]) for name in columns)]


def cell(value: Any) -> str:
    """An entry of a table, whatever JSON has there."""
    if value is None:
        return MISSING
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return three(value)
    if isinstance(value, int):
        return whole(value)
    if isinstance(value, list):
        return " to ".join(cell(part) for part in value) if len(value) == 2 else ", ".join(cell(part) for part in value)
    return str(value)


def _note(one: Json, left_out: int) -> str:
    how = "Exact" if one["exact"] else "Estimated, with 95 % intervals"
    told = f"{how}; {counted(one['budget'], 'evaluation')}." if one["budget"] else f"{how}."
    if one["baseline"]:
        told += f" Values start from {three(one['baseline'])}."
    return told + (f" {left_out} more rows are in the JSON." if left_out else "")


def _paper(rows: Sequence[Json]) -> Markup:
    cells = [[row["question"], row["paper"], row["ours"], cell(row["agrees"])] for row in rows]
    note = "Worked out when this page was made. The paper's readings are from its section on explanations, lap 10 of Bahrain 2023."
    return table("Lap 10 of Bahrain 2023", ["", "the paper", "here", "agrees"], cells, note=note, class_="runs")


def headline(document: Json) -> list[tuple[str, tuple[str, ...]]]:
    """The first sentence of each method for the top of the page, with the section it points to."""
    first: dict[str, str] = {}
    for one in sorted(document["explanations"], key=lambda one: _rank(one["method"])):
        if one["sentences"]:
            first.setdefault(one["method"], one["sentences"][0])
    return [(sentence, (_place(method),)) for method, sentence in first.items()]
