"""Dot plots: a row for each thing compared, marks for values, bars for their 95 % intervals."""

from collections.abc import Sequence
from typing import Final, NamedTuple

from rsrl.drawing import FAINT, INK
from rsrl.report.markup import Markup
from rsrl.report.numbers import MINUS
from rsrl.report.svg import CHARACTER, WIDTH, Scale, colour_of, drawing, line, mark, scale_over, text
from rsrl.results import Interval, known

TOP: Final = 8.0
BELOW: Final = 40.0
BETWEEN_SERIES: Final = 9.0


class Dot(NamedTuple):
    """A value with its interval."""

    value: float
    ends: Interval | None


class DotRow(NamedTuple):
    """A label, a value for each series (None: there is none), and a note on the right."""

    label: str
    dots: Sequence[Dot | None]
    note: str = ""


def dot_plot(rows: Sequence[DotRow], axis: str, alt: str, *, series: Sequence[str] = (), zero: bool = False) -> Markup:
    """Draw rows from top to bottom.

    Args:
        rows: one at least, each with a dot for every series.
        axis: what the values are, below the axis.
        alt: the figure in words.
        series: their names, for the legend; none for a single one.
        zero: draw a line at zero, for differences.
    """
    step = 9.0 + BETWEEN_SERIES * len(rows[0].dots)
    legend = 22.0 if series else 0.0
    bottom = TOP + legend + step * len(rows)
    left = min(10 + CHARACTER * max(len(row.label) for row in rows), 0.4 * WIDTH)
    right = WIDTH - 14 - CHARACTER * max(len(row.note) for row in rows)
    scale = scale_over([*_values(rows), *([0.0] if zero else [])], left + 10, right - 6)
    parts = [*_grid(scale, TOP + legend, bottom, axis, zero), *_legend(series, left + 10)]
    for i, row in enumerate(rows):
        y = TOP + legend + step * (i + 0.5)
        parts += [text(left, y, row.label, anchor="end"), text(right + 4, y, row.note, size=11), *_dots(row, y, scale)]
    return drawing(bottom + BELOW, alt, parts)


def _values(rows: Sequence[DotRow]) -> list[float]:
    dots = [dot for row in rows for dot in row.dots if dot]
    return [value for dot in dots for value in (dot.value, *(known(dot.ends) or ()))]


def _grid(scale: Scale, top: float, bottom: float, axis: str, zero: bool) -> list[Markup]:
    ticks = scale.ticks()
    digits = max(len(f"{tick:.10g}".partition(".")[2]) for tick in ticks)
    parts = [line(scale(tick), top, scale(tick), bottom, FAINT) for tick in ticks]
    parts += [text(scale(tick), bottom + 11, f"{tick:.{digits}f}".replace("-", MINUS), anchor="middle", size=11) for tick in ticks]
    if zero:
        parts.append(line(scale(0), top, scale(0), bottom, INK, 1.4))
    return [*parts, text((scale.left + scale.right) / 2, bottom + 29, axis, anchor="middle")]


def _dots(row: DotRow, y: float, scale: Scale) -> list[Markup]:
    parts = []
    for i, dot in enumerate(row.dots):
        if dot is None:
            continue
        height = y + BETWEEN_SERIES * (i - (len(row.dots) - 1) / 2)
        ends = known(dot.ends)
        if ends:
            parts += [
                line(scale(ends[0]), height, scale(ends[1]), height, colour_of(i), 1.8),
                *(line(scale(end), height - 3, scale(end), height + 3, colour_of(i), 1.8) for end in ends),
            ]
        parts.append(mark(scale(dot.value), height, i))
    return parts


def _legend(series: Sequence[str], left: float) -> list[Markup]:
    parts, x = [], left
    for i, name in enumerate(series):
        parts += [mark(x + 6, TOP + 4, i), text(x + 16, TOP + 4, name)]
        x += 34 + CHARACTER * len(name)
    return parts
