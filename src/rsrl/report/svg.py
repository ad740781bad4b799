"""What figures are drawn of: lines, boxes, marks and text as inline SVG, and a scale with ticks."""

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

from rsrl.drawing import INK, SERIES_COLOURS
from rsrl.report.markup import Child, Markup, element

WIDTH: Final = 720.0
"""Of every figure, in its own units; the page scales it."""

CHARACTER: Final = 6.3
"""Width of a character of usual text, about; figures leave room by it."""

SHAPES: Final = ("disc", "square", "diamond", "triangle")
"""Of the marks of a series: shapes and brightness differ, for print in grey. From the fifth series on marks are hollow."""


class Scale(NamedTuple):
    """Values from `low` to `high` over the widths from `left` to `right`."""

    low: float
    high: float
    left: float
    right: float

    def __call__(self, value: float) -> float:
        """Where a value lies."""
        return self.left + (value - self.low) / (self.high - self.low) * (self.right - self.left)

    def ticks(self, most: int = 8) -> list[float]:
        """Round values within it, at most so many."""
        span = self.high - self.low
        unit = 10.0 ** math.floor(math.log10(span / most))
        step = next(unit * m for m in (1, 2, 5, 10, 20) if span / (unit * m) <= most)
        first = math.ceil(self.low / step - 1e-9)
        return [round(i * step, 10) for i in range(first, math.floor(self.high / step + 1e-9) + 1)]


def scale_over(values: Sequence[float], left: float, right: float) -> Scale:
    """A scale with a little room around values; one without width gets some."""
    low, high = min(values), max(values)
    room = 0.04 * (high - low) or 0.5
    return Scale(low - room, high + room, left, right)


def drawing(height: float, alt: str, *parts: Child) -> Markup:
    """An SVG of the usual width, told in words by `alt`."""
    return element("svg", *parts, viewBox=f"0 0 {WIDTH:g} {height:g}", role="img", aria_label=alt)


def figure(caption: Child, drawn: Markup, note: Child = "") -> Markup:
    """A drawing under its caption, with a note in small type below."""
    return element("figure", element("figcaption", caption), drawn, element("p", note, class_="note") if note else "")


def line(x1: float, y1: float, x2: float, y2: float, colour: str = INK, width: float = 1.0, dash: str | None = None) -> Markup:
    """A straight line."""
    return element("line", x1=x1, y1=y1, x2=x2, y2=y2, stroke=colour, stroke_width=width, stroke_dasharray=dash)


def box(x: float, y: float, width: float, height: float, fill: str, edge: str = INK) -> Markup:
    """A rectangle."""
    return element("rect", x=x, y=y, width=width, height=height, fill=fill, stroke=edge, stroke_width=0.8)


def text(x: float, y: float, content: str, *, anchor: str = "start", size: float = 12, bold: bool = False, fill: str = INK) -> Markup:
    """A line of text, its middle at height `y`."""
    weight = 700 if bold else None
    return element("text", content, x=x, y=y + 0.35 * size, text_anchor=anchor, font_size=size, font_weight=weight, fill=fill)


def mark(x: float, y: float, series: int) -> Markup:
    """The mark of a series."""
    colour, shape = colour_of(series), SHAPES[series % len(SHAPES)]
    fill = colour if series < len(SHAPES) else "#ffffff"
    if shape == "disc":
        return element("circle", cx=x, cy=y, r=4.0, fill=fill, stroke=colour, stroke_width=1.6)
    corners = {
        "square": ((-3.8, -3.8), (3.8, -3.8), (3.8, 3.8), (-3.8, 3.8)),
        "diamond": ((0.0, -5.2), (5.2, 0.0), (0.0, 5.2), (-5.2, 0.0)),
        "triangle": ((0.0, -4.8), (4.8, 3.8), (-4.8, 3.8)),
    }[shape]
    points = " ".join(f"{x + dx:.2f},{y + dy:.2f}" for dx, dy in corners)
    return element("polygon", points=points, fill=fill, stroke=colour, stroke_width=1.6)


def colour_of(series: int) -> str:
    """The colour of a series."""
    return SERIES_COLOURS[series % len(SHAPES)]
