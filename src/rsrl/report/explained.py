"""Sections of one decision explained: what-if first, then the decision with its warnings, then the methods one after another."""

from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

from rsrl.report.bars import bars
from rsrl.report.columns import Column, amount, call, column, entry
from rsrl.report.markup import Child, Markup, element, together
from rsrl.report.numbers import MISSING, counted
from rsrl.report.race_line import race_line
from rsrl.report.safety_cars import METHOD, safety_car_page_table
from rsrl.report.tables import Cell, table
from rsrl.results import Decision, Explained, MethodResult, PaperReading, SummaryRow, from_plain
from rsrl.statistics import Z

TITLES: Final = {
    "what-if": "What if: every option rolled out from here",
    METHOD: "The calls prepared for a safety car",
    "attribution": "What the policy looked at",
    "tree": "The same call as a decision tree makes it",
    "counterfactual": "What would change the call",
    "summary": "The race, and the laps that mattered",
}
"""Title of each method's section."""

FIRST: Final = ("what-if", METHOD)
"""Stand before the decision itself: what a strategist asks first."""

IF_ASKED: Final = ", if a "
"""Stands in the question of a what-if about a track status that is not the race's."""

UNTOLD: Final = ("cause", "feature", "text", "reference_error", "lower", "upper", "low", "high")
"""Columns that are for programs, or that another column says in words; the JSON has them."""


class View(NamedTuple):
    """A table of an explanation: its caption, its columns, all where none are named, and whether it has the values."""

    caption: str
    columns: tuple[str, ...] = ()
    valued: bool = True


VIEWS: Final[dict[str, tuple[View, ...]]] = {
    "what-if": (
        View(
            "Places against the policy's call (below zero is better), and what comes of each option",
            (
                "verdict", "mean_position", "points", "chance_gain", "chance_lose", "stop_lap", "rejoin_place", "rejoin_gap_ahead_s",
                "rejoin_gap_behind_s",
            ),
        ),
        View(
            "Where the time to the flag comes from, s against the policy's call (above zero is slower)",
            ("time_s", "pit_s", "tyre_s", "traffic_s", "safety_car_s"),
            valued=False,
        ),
    ),
    "attribution": (View("Shares, and what the policy saw"),),
    "tree": (View("Questions on the way, and what each adds", ("here",)),),
    "counterfactual": (View("What changes"),),
    "summary": (View("The laps that mattered", ("for_a_stop", "position", "tyre", "tyre_age_laps", "status", "mattered")),),
}  # fmt: skip
"""Tables of each method; of another one there is a table with all columns."""

MOST_ROWS: Final = 40
"""Of a table; a long explanation has its other rows in the JSON."""

WORDY: Final = 30
"""Characters from which entries of a table read as text, and are aligned as such."""

OWN: Final = ("label", "value", "standard_error")


class Part(NamedTuple):
    """A section: its place in links, its heading, its body."""

    id: str
    title: str
    body: Markup


def explained(document: Explained) -> list[Part]:
    """Sections of `explanation.json`."""
    made = sorted(document.explanations, key=lambda one: _rank(one.method))
    parts = [_part(one) for one in made if one.method in FIRST]
    if document.decision:
        parts.append(Part("decision", "The decision", _decision(document.decision, document)))
    parts += [_part(one) for one in made if one.method not in FIRST]
    if document.paper:
        parts.append(Part("paper", "The paper's reading beside this one", _paper(document.paper)))
    return _apart(parts)


def _part(one: MethodResult) -> Part:
    method = str(one.method)
    title = TITLES.get(method, method)
    if method == "what-if" and IF_ASKED in one.question:
        title = "If a " + one.question.rpartition(IF_ASKED)[2]
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


def _decision(decision: Decision, document: Explained) -> Markup:
    unit = document.value_unit or ""
    best = decision.alternative
    margin = f"{amount(decision.margin, unit, sign=False)} {unit}".rstrip()
    told = f"For lap {decision.lap} the policy {decision.model} calls: {call(decision.call)}"
    told += (
        ", the only legal call." if not best else f", {margin} better than {call(best)} by its own values." if decision.q_values else "."
    )
    rows = [
        [call(name), amount(value, unit, sign=False), "yes" if name in decision.legal else "no", _standing(name, decision)]
        for name, value in decision.q_values.items()
    ]
    note = f"Model {decision.model}, weights {decision.model_hash}. Values are the policy's own"
    note += ": minus the finishing place it expects." if unit == "places" else f", in {unit}." if unit else "."
    return together(
        element("p", told),
        [element("p", f"Outside what the policy was trained on: {line}.", class_="warning") for line in document.warnings],
        [element("p", line) for line in document.notes or ()],
        table("The policy's value of each call", ["call", "value", "legal", "standing"], rows, note=note) if rows else "",
    )


def _standing(name: str, decision: Decision) -> str:
    return "called" if name == decision.call else "next best" if name == decision.alternative else ""


def _explanation(one: MethodResult) -> Markup:
    sentences = element("ul", [element("li", sentence) for sentence in one.sentences], class_="summary") if one.sentences else ""
    if one.method == METHOD:
        return together(sentences, safety_car_page_table(one))
    views = VIEWS.get(one.method, (View(sentence_case(one.question)),))
    return together(sentences, _figure(one), [_table(one, view) for view in views] if one.rows else "")


def sentence_case(text: str) -> str:
    """With a capital letter in front."""
    return text[:1].upper() + text[1:]


def _figure(one: MethodResult) -> Markup:
    alt = f"{one.question}; the table below has the values"
    if one.method == "summary":
        drawn = race_line([from_plain(row, SummaryRow) for row in one.rows], one.unit, alt)
    else:
        options, rows = one.method == "what-if", [dict(row, standard_error=error_of(row)) for row in one.rows]
        drawn = bars(rows, one.unit, alt, sort=not options, low_is_good=options)
    return element("figure", element("figcaption", sentence_case(one.question)), drawn) if drawn else drawn


def error_of(row: Mapping[str, Any]) -> float | None:
    """Standard error of a row's value: of its estimate, else of there being no more references."""
    found: float | None = row.get("standard_error", row.get("reference_error"))
    return found


def _table(one: MethodResult, view: View) -> Markup:
    rows = [row for row in one.rows if row["mattered"]] if one.method == "summary" else one.rows
    if not rows:
        return Markup("")
    names = [name for name in view.columns or rows[0] if name in rows[0] and name not in (*OWN, *UNTOLD)]
    columns = [(name, column(name)) for name in names if any(row[name] not in ("", None) for row in rows)]
    estimated = view.valued and any(error_of(row) is not None for row in rows)
    heads: list[Child | Cell] = ["", *([one.unit or "value"] if view.valued else []), *(["95 %"] if estimated else [])]
    heads += [Cell(known.head, _class(known)) for _, known in columns]
    cells = [_cells(row, one.unit, columns, view.valued, estimated) for row in rows[:MOST_ROWS]]
    wordy = any(isinstance(row[name], str) and len(row[name]) > WORDY for row in rows for name in ("label", *names))
    note = _note(one, len(rows) - len(cells)) if view.valued else ""
    return table(view.caption, heads, cells, note=note, class_="runs" if wordy else "options")


def _class(known: Column) -> str | None:
    return "words" if known.words else None


def _cells(row: Mapping[str, Any], unit: str, columns: Sequence[tuple[str, Column]], valued: bool, estimated: bool) -> list[Child | Cell]:
    value = [amount(row["value"], unit)] if valued else []
    interval = [half_interval(row, unit)] if estimated else []
    return [row["label"], *value, *interval, *(Cell(known.write(row[name]), _class(known)) for name, known in columns)]


def half_interval(row: Mapping[str, Any], unit: str) -> str:
    """Half the 95 % interval of a row's value; nothing of one that is compared with itself."""
    error = error_of(row)
    if error is None or row.get("verdict") == "itself":
        return MISSING
    return f"±{amount(Z * error, unit, sign=False)}"


def _note(one: MethodResult, left_out: int) -> str:
    if one.method == "what-if":
        told = f"Estimated over {counted(one.budget, 'race')}, the same luck for every option; 95 % intervals."
    elif not one.exact:
        told = f"Estimated, with 95 % intervals, from {counted(one.budget, 'evaluation')} of the policy."
    elif any(error_of(row) for row in one.rows):
        told = "Exact for the races it is compared with; the 95 % interval says how far as many other races could move it."
    else:
        told = "Exact."
    if one.baseline:
        told += f" Values start from {amount(one.baseline, one.unit, sign=False)}."
    return told + (f" {counted(left_out, 'more row')} in the JSON." if left_out else "")


def _paper(rows: Sequence[PaperReading]) -> Markup:
    cells = [[row.question, row.paper, row.ours, entry(row.agrees)] for row in rows]
    note = "Worked out when this page was made. The paper's readings are from its section on explanations, lap 10 of Bahrain 2023."
    return table("Lap 10 of Bahrain 2023", ["", "the paper", "here", "agrees"], cells, note=note, class_="runs")


def headline(document: Explained) -> list[tuple[str, tuple[str, ...]]]:
    """The first sentence of each explanation for the top of the page, with the section it points to."""
    made = sorted(document.explanations, key=lambda one: _rank(one.method))
    told = _apart([Part(_place(one.method), one.sentences[0] if one.sentences else "", Markup("")) for one in made])
    return [(part.title, (part.id,)) for part in told if part.title]
