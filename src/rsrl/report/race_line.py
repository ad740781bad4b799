"""A race lap by lap: what a stop was worth against staying out, with the stops, the close calls and the safety cars."""

from collections.abc import Sequence
from typing import Final

from rsrl.drawing import COMPOUND_COLOURS, FAINT, INK, SERIES_COLOURS, STATUS_COLOURS
from rsrl.report.markup import Markup, element
from rsrl.report.numbers import three
from rsrl.report.svg import WIDTH, Scale, drawing, line, text
from rsrl.results import SummaryRow
from rsrl.season import SC

HEIGHT: Final = 250.0
TOP, BOTTOM, LEFT, RIGHT = 12.0, 200.0, 56.0, WIDTH - 12
TYRES: Final = dict(zip(("pit soft", "pit medium", "pit hard"), COMPOUND_COLOURS, strict=True))
FLOOR_SHARE: Final = 0.2
"""Values below this quantile are drawn at it: early in a stint a stop costs so much that it would flatten the rest of the line."""


def race_line(rows: Sequence[SummaryRow], unit: str, alt: str) -> Markup:
    """Draw the rows of a race summary; nothing where no lap had a choice."""
    known = sorted(row.for_a_stop for row in rows if row.for_a_stop is not None)
    if not known:
        return Markup("")
    floor = min(known[int(FLOOR_SHARE * (len(known) - 1))], 0.0)
    room = 0.08 * ((known[-1] - floor) or 1.0)
    x = Scale(rows[0].lap - 0.5, max(rows[-1].lap, rows[0].lap + 1) + 0.5, LEFT, RIGHT)
    y = Scale(floor - room, max(known[-1], 0.0) + room, BOTTOM, TOP)
    return drawing(HEIGHT, alt, _slow_laps(rows, x), _axes(x, y, unit), _curve(rows, x, y, floor), _marks(rows, x, y, floor))


def _slow_laps(rows: Sequence[SummaryRow], x: Scale) -> list[Markup]:
    width = x(1.0) - x(0.0)
    slow = [row for row in rows if row.status != "green flag"]
    return [element("rect", x=x(row.lap - 0.5), y=TOP, width=width, height=BOTTOM - TOP, fill=STATUS_COLOURS[SC]) for row in slow]


def _axes(x: Scale, y: Scale, unit: str) -> list[Markup]:
    parts = []
    for tick in y.ticks(5):
        parts += [line(LEFT, y(tick), RIGHT, y(tick), FAINT), text(LEFT - 6, y(tick), three(tick), anchor="end", size=11)]
    parts += [text(x(tick), BOTTOM + 12, f"{tick:.0f}", anchor="middle", size=11) for tick in x.ticks(12) if tick >= 1]
    middle = (LEFT + RIGHT) / 2
    legend = f"lap; line: best stop over staying out, {unit}; dots: stops; rings: close calls; bands: safety cars"
    return [*parts, line(LEFT, y(0.0), RIGHT, y(0.0), INK), text(middle, BOTTOM + 34, legend, anchor="middle", size=11)]


def _curve(rows: Sequence[SummaryRow], x: Scale, y: Scale, floor: float) -> list[Markup]:
    """Broken where a call was forced."""
    pieces: list[list[str]] = [[]]
    for row in rows:
        if row.for_a_stop is None:
            pieces.append([])
        else:
            pieces[-1].append(f"{x(row.lap):.1f},{y(max(row.for_a_stop, floor)):.1f}")
    drawn = [piece for piece in pieces if piece]
    return [element("polyline", points=" ".join(piece), fill="none", stroke=SERIES_COLOURS[0], stroke_width=1.6) for piece in drawn]


def _marks(rows: Sequence[SummaryRow], x: Scale, y: Scale, floor: float) -> list[Markup]:
    parts = []
    for row in rows:
        if row.mattered not in ("stop", "close call"):
            continue
        height = y(max(row.for_a_stop or 0.0, floor))
        fill = TYRES.get(row.call, "none")
        parts.append(element("circle", cx=x(row.lap), cy=height, r=5.0, fill=fill, stroke=INK, stroke_width=1.5))
        parts.append(text(x(row.lap), height - 12, f"{row.lap}", anchor="middle", size=11, bold=row.mattered == "stop"))
    return parts
