"""Bars of values with their intervals, from the rows of an explanation."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from rsrl.drawing import FAINT, INK, VERDICT_COLOURS
from rsrl.report.columns import SHARE_UNIT, amount
from rsrl.report.markup import Markup
from rsrl.report.numbers import percent, three
from rsrl.report.svg import CHARACTER, WIDTH, Scale, box, drawing, line, scale_over, text
from rsrl.statistics import normal_interval

Json = Mapping[str, Any]

GAIN, LOSS, OPEN = VERDICT_COLOURS["better"], VERDICT_COLOURS["worse"], VERDICT_COLOURS["undecided"]
"""Of options better, worse, and equal or undecided."""

ROW: Final = 22.0
MOST: Final = 12
LONGEST: Final = 46
"""Characters of a label; the table below has it whole."""


def bars(rows: Sequence[Json], unit: str, alt: str, *, sort: bool = True, low_is_good: bool = False) -> Markup:
    """Values as bars, good ones green and bad ones red, each with its 95 % interval.

    Args:
        rows: with `label`, `value` and, where estimated, `standard_error`; null values are left out.
        sort: the largest first, and only so many.
        low_is_good: as finishing positions are.
    """
    shown = [row for row in rows if row["value"] is not None]
    if sort:
        shown = sorted(shown, key=lambda row: -abs(row["value"]))[:MOST]
    if not shown:
        return Markup("")
    left = 12 + CHARACTER * min(max(len(row["label"]) for row in shown), LONGEST)
    ends = [end for row in shown for end in _ends(row)]
    scale = scale_over([0.0, *ends], left, WIDTH - 60)
    height = ROW * len(shown) + 40
    bottom = ROW * len(shown) + 6
    parts = [
        _axis(scale, bottom, unit, "; below zero is better" if low_is_good else ""),
        *(_bar(row, unit, scale, ROW * (i + 0.5) + 4, low_is_good) for i, row in enumerate(shown)),
    ]
    return drawing(height, alt, *parts, line(scale(0.0), 2, scale(0.0), bottom))


def _axis(scale: Scale, bottom: float, unit: str, more: str) -> list[Markup]:
    ticks = scale.ticks(6)
    grid = [line(scale(tick), 2, scale(tick), bottom, FAINT) for tick in ticks]
    names = [text(scale(tick), bottom + 10, _tick(tick, unit), anchor="middle", size=11) for tick in ticks]
    return [*grid, *names, text((scale.left + scale.right) / 2, bottom + 26, unit + more, anchor="middle", size=11)]


def _tick(value: float, unit: str) -> str:
    return percent(value) if unit == SHARE_UNIT else three(value)


def _colour(row: Json, low_is_good: bool) -> str:
    if row.get("verdict") in ("equal", "undecided"):
        return OPEN
    return GAIN if (row["value"] <= 0 if low_is_good else row["value"] >= 0) else LOSS


def _bar(row: Json, unit: str, scale: Scale, y: float, low_is_good: bool) -> list[Markup]:
    value, (low, high) = float(row["value"]), _ends(row)
    x = min(scale(value), scale(0.0))
    label = row["label"] if len(row["label"]) <= LONGEST else row["label"][: LONGEST - 1] + "\N{HORIZONTAL ELLIPSIS}"
    colour = _colour(row, low_is_good)
    parts = [text(scale.left - 8, y, label, anchor="end"), box(x, y - 7, abs(scale(value) - scale(0.0)), 14, colour, colour)]
    if high > low:
        parts += _whisker(scale(low), scale(high), y)
    return [*parts, text(max(scale(high), scale(0.0)) + 6, y, amount(value, unit), size=11)]


def _ends(row: Json) -> tuple[float, float]:
    """Interval of a row's value, a point where it is exact."""
    return normal_interval(row["value"], row.get("standard_error") or 0.0)


def _whisker(low: float, high: float, y: float) -> list[Markup]:
    return [line(low, y, high, y, INK, 1.4), line(low, y - 4, low, y + 4, INK, 1.4), line(high, y - 4, high, y + 4, INK, 1.4)]
