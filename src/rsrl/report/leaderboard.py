"""The leaderboard of `rsrl evaluate`: strategists on the same races of one Grand Prix."""

from collections.abc import Sequence

from rsrl.report.differences import difference_cell
from rsrl.report.dots import Dot, DotRow, dot_plot
from rsrl.report.markup import Child, Markup, element, together
from rsrl.report.numbers import half_width, percent, percent_range, place, place_range, race_title, whole
from rsrl.report.strategies import strategies_table
from rsrl.report.svg import figure
from rsrl.report.tables import Cell, table
from rsrl.results import Aggregate, Evaluation, Row, known


def leaderboard(document: Evaluation) -> Markup:
    """Table and figure, several training seeds together, strategies driven, and warnings."""
    aggregate, strategies = document.aggregate, document.strategies
    return together(
        [element("p", f"Warning: {line}", class_="warning") for line in document.warnings or ()],
        _table(document),
        _figure(document),
        _aggregate(aggregate) if aggregate else "",
        strategies_table(strategies) if strategies else "",
    )


def model_row(document: Evaluation) -> Row | None:
    """The row of the model the others are compared with; None where that is the mean of several seeds."""
    if document.aggregate:
        return None
    return next((r for r in document.rows if r.difference == 0 and known(r.difference_ci95) in (None, (0, 0))), None)


def reference(document: Evaluation) -> str:
    """What the others are compared with, in words."""
    aggregate, model = document.aggregate, model_row(document)
    return f"the mean of {aggregate.seeds} seeds" if aggregate else model.strategist if model else "the model"


def _table(document: Evaluation) -> Markup:
    rows, model, name = document.rows, model_row(document), reference(document)
    gaps = any(row.gap_closed is not None for row in rows)
    heads = ["strategist", "position", f"behind {name}", f"{name} ahead", *(["gap closed"] if gaps else []), "points", "stops"]
    heads += ["invalid", "out", "ms"]
    cells = [_row(row, row is model, gaps) for row in rows]
    note = (
        f"Small: 95 % intervals. Behind: mean places behind {name} on the same race, above zero {name} is better; ahead: share of races "
        "in which it is, ties half. Invalid: finished out of the rules. Out: did not finish, counted where classified. "
        "ms: time of a decision."
    )
    if gaps:
        note += " Gap closed: share of the way from fixed strategies to hindsight, which knows each race in advance, a bound."
    return table(f"Leaderboard: {where(document)}", heads, cells, note=note, class_="heated")


def where(document: Evaluation) -> str:
    """Car, race, and how many races."""
    count, seed = whole(document.races), document.seed
    return f"{document.driver} at {race_title(document.race)}, {count} races of seed {seed}, the same for all"


def _row(row: Row, is_model: bool, gaps: bool) -> list[Child | Cell]:
    cells: list[Child | Cell] = [
        element("strong", row.strategist) if is_model else row.strategist,
        together(place(row.mean_position), " ", element("small", half_width(row.mean_position, row.ci95))),
    ]
    cells += ["", ""] if is_model else [difference_cell(row.difference, row.difference_ci95), percent(row.p_better)]
    if gaps:
        share = row.gap_closed
        cells.append("" if share is None else together(percent(share), " ", element("small", percent_range(row.gap_closed_ci95))))
    cells += [f"{row.mean_points:.2f}", f"{row.mean_stops:.2f}", percent(row.invalid_share, 1), percent(row.retired_share, 1)]
    return [*cells, f"{row.decision_ms:.3f}"]


def _figure(document: Evaluation) -> Markup:
    rows = [DotRow(row.strategist, [Dot(row.mean_position, row.ci95)], f"P{place(row.mean_position)}") for row in document.rows]
    told = "; ".join(f"{row.label} {row.note}" for row in rows)
    drawn = dot_plot(rows, "mean finishing position (left is better)", f"Dot plot of mean finishing positions: {told}.")
    return figure("Mean finishing positions, with 95 % intervals", drawn)


def _aggregate(aggregate: Aggregate) -> Markup:
    cells: Sequence[Sequence[Child | Cell]] = [
        [
            one.strategist,
            difference_cell(one.difference, one.difference_ci95),
            together(percent(one.p_better), " ", element("small", percent_range(one.p_better_ci95))),
        ]
        for one in aggregate.comparisons
    ]
    mean = f"P{place(aggregate.mean_position)} ({place_range(aggregate.mean_position_ci95)})"
    iqm = f"P{place(aggregate.iqm_position)} ({place_range(aggregate.iqm_position_ci95)})"
    caption = f"{aggregate.seeds} training seeds together: {mean}, interquartile mean {iqm}"
    note = "Intervals are over training seeds and races; that of the interquartile mean is a stratified bootstrap."
    return table(caption, ["strategist", "behind the model", "model ahead"], cells, note=note, class_="heated")
