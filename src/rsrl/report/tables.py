"""Tables with captions, and heads that say what they are heads of."""

from collections.abc import Sequence
from typing import NamedTuple

from rsrl.report.markup import Child, Markup, element


class Cell(NamedTuple):
    """A cell that is more than its text: with a class, or a background."""

    content: Child
    class_: str | None = None
    background: str | None = None


class Group(NamedTuple):
    """A head over several columns."""

    text: Child
    columns: int


class Body(NamedTuple):
    """Rows under a head of their own, none where it is empty. The first cell of a row is its head."""

    head: Child
    rows: Sequence[Sequence[Child | Cell]]


def table(
    caption: Child,
    heads: Sequence[Child | Cell],
    rows: Sequence[Sequence[Child | Cell]] | Sequence[Body],
    *,
    groups: Sequence[Group] = (),
    note: Child = "",
    class_: str | None = None,
) -> Markup:
    """A table.

    Args:
        caption: stands above it.
        heads: of the columns, that of the row heads included.
        rows: of cells, or bodies of rows.
        groups: heads above the heads; they share out the columns.
        note: stands below it, in small type.
        class_: of the table.
    """
    bodies = [row if isinstance(row, Body) else None for row in rows]
    parts = [body for body in bodies if body] or [Body("", [row for row in rows if not isinstance(row, Body)])]
    head = [element("tr", [_head(group.text, "colgroup", group.columns) for group in groups])] if groups else []
    head.append(element("tr", [_head(one.content, "col", class_=one.class_) for one in map(_as_cell, heads)]))
    built = element(
        "table",
        element("caption", caption),
        element("thead", head),
        [element("tbody", _body_head(body, len(heads)), [_row(row) for row in body.rows]) for body in parts],
        class_=class_,
    )
    return element("div", built, element("p", note, class_="note") if note else "", class_="block")


def _as_cell(content: Child | Cell) -> Cell:
    return content if isinstance(content, Cell) else Cell(content)


def _head(text: Child, scope: str, columns: int = 1, class_: str | None = None) -> Markup:
    if not text:
        return element("td", colspan=columns)
    return element("th", text, scope=scope, colspan=columns if columns > 1 else None, class_=class_)


def _body_head(body: Body, columns: int) -> Markup:
    if not body.head:
        return Markup("")
    return element("tr", element("th", body.head, scope="rowgroup", colspan=columns), class_="part")


def _row(cells: Sequence[Child | Cell]) -> Markup:
    first, *others = map(_as_cell, cells)
    return element("tr", element("th", first.content, scope="row", class_=first.class_), [_cell(cell) for cell in others])


def _cell(cell: Cell) -> Markup:
    style = f"background:{cell.background}" if cell.background else None
    return element("td", cell.content, class_=cell.class_, style=style)
