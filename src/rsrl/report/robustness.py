"""A model among other rivals, and in seasons whose figures differ from the fitted ones."""

from collections import Counter
from collections.abc import Sequence
from typing import Final

from rsrl.report.differences import difference_cell, difference_plot
from rsrl.report.dots import Dot, DotRow
from rsrl.report.markup import Child, Markup, element, together
from rsrl.report.numbers import half_width, percent, place, race_title, verdict, whole
from rsrl.report.scored import find
from rsrl.report.tables import Body, Cell, Group, table
from rsrl.results import Robustness, RobustnessRow

RIVALS: Final = {
    "reactive": "Rivals called lap by lap as teams call (reactive)",
    "plans": "Rivals on plans drawn from what teams ran (plans)",
    "itself": "Rivals all called by the model (itself)",
}


def robustness(document: Robustness) -> Markup:
    """The table by rivals and scale of the errors, and its differences as a figure."""
    return together(_table(document), _figure(document))


def verdicts(document: Robustness) -> Counter[int]:
    """How many comparisons of all settings the model surely wins (1), loses (-1), or neither (0)."""
    return Counter(verdict(one.difference_ci95) for row in document.rows for one in row.against)


def _names(document: Robustness) -> list[str]:
    return list(dict.fromkeys(one.strategist for row in document.rows for one in row.against))


def _ways(document: Robustness) -> list[str]:
    return list(dict.fromkeys(row.rivals for row in document.rows))


def _table(document: Robustness) -> Markup:
    names = _names(document)
    heads = ["errors, x s.e.", "races", "model"]
    groups = [Group("", 2), Group("position", 1), *(Group(name, 3) for name in names)]
    heads += ["position", "behind model", "model ahead"] * len(names)
    bodies = [Body(RIVALS.get(way, way), [_row(row, names) for row in document.rows if row.rivals == way]) for way in _ways(document)]
    counts = verdicts(document)
    knowing = "know the figures drawn" if document.plan.informed else "keep believing the fitted figures"
    note = (
        f"Errors: the season's figures were drawn anew within so many of their standard errors; pit walls {knowing}. Small: half the width "
        f"of the 95 % interval, over draws where there are several. Of {counts.total()} comparisons the model is surely ahead "
        f"in {counts[1]}, surely behind in {counts[-1]}, and {counts[0]} are open."
    )
    caption = f"{document.driver} at {race_title(document.race)}: other rivals and other figures"
    return table(caption, heads, bodies, groups=groups, note=note, class_="grid")


def _row(row: RobustnessRow, names: Sequence[str]) -> list[Child | Cell]:
    cells: list[Child | Cell] = [
        f"{row.scale:g}",
        whole(row.races),
        together(place(row.mean_position), " ", element("small", half_width(row.mean_position, row.ci95))),
    ]
    for name in names:
        one = find(row.against, strategist=name)
        if one is None:
            cells += ["", "", ""]
            continue
        cells += [
            place(one.mean_position),
            difference_cell(one.difference, one.difference_ci95, whole_range=False),
            percent(one.p_better),
        ]
    return cells


def _figure(document: Robustness) -> Markup:
    names = _names(document)
    rows = []
    for row in document.rows:
        found = [find(row.against, strategist=name) for name in names]
        rows.append(
            DotRow(
                f"{row.rivals}, {row.scale:g} s.e.",
                [Dot(one.difference, one.difference_ci95) if one else None for one in found],
            )
        )
    if not names or not rows:
        return Markup("")
    return difference_plot(rows, names, "the model", f"Places behind the model, by rivals and errors in the figures: {', '.join(names)}")
