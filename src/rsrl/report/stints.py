"""The paper's Figure 3: strategies as bars of stints, lap by lap, with pit windows."""

from collections.abc import Sequence
from typing import Final, NamedTuple

from rsrl.drawing import COMPOUND_COLOURS, COMPOUND_INKS, INK
from rsrl.report.markup import Markup
from rsrl.report.svg import CHARACTER, WIDTH, Scale, box, drawing, line, text
from rsrl.results import DrivenStrategy
from rsrl.season import COMPOUND_NAMES, COMPOUNDS

TOP: Final = 28.0
STEP: Final = 28.0
BAR: Final = 15.0


class Bar(NamedTuple):
    """A strategy as a result file has it, under a label, with a note on the right."""

    label: str
    note: str
    strategy: DrivenStrategy


def stint_bars(bars: Sequence[Bar], laps: int, alt: str) -> Markup:
    """Draw strategies of a race of so many laps from top to bottom; brackets are the laps within which 80 % of the stops are."""
    left = 12 + CHARACTER * max(len(bar.label) for bar in bars)
    right = WIDTH - 16 - CHARACTER * max(len(bar.note) for bar in bars)
    scale = Scale(0, laps, left, right)
    bottom = TOP + STEP * len(bars)
    ticks = [*(tick for tick in scale.ticks(10) if tick < 0.96 * laps), laps]
    parts = [*_legend(left), line(left, bottom, right, bottom)]
    for tick in ticks:
        parts += [line(scale(tick), bottom, scale(tick), bottom + 4), text(scale(tick), bottom + 12, f"{tick:g}", anchor="middle", size=11)]
    parts.append(text((left + right) / 2, bottom + 28, "lap", anchor="middle"))
    for i, bar in enumerate(bars):
        y = TOP + STEP * i + 4
        middle = y + BAR / 2
        parts += [text(left - 6, middle, bar.label, anchor="end"), text(right + 8, middle, bar.note, size=11)]
        parts += _stints(bar.strategy, laps, y, scale)
    return drawing(bottom + 38, alt, parts)


def _stints(strategy: DrivenStrategy, laps: int, y: float, scale: Scale) -> list[Markup]:
    edges = [0, *strategy.laps, laps]
    parts = []
    for compound, begin, end in zip(strategy.compounds, edges, edges[1:], strict=False):
        middle = (scale(begin) + scale(end)) / 2
        parts.append(box(scale(begin), y, scale(end) - scale(begin), BAR, COMPOUND_COLOURS[compound]))
        label = f"{COMPOUNDS[compound]} {end - begin}"
        if scale(end) - scale(begin) > CHARACTER * len(label) + 2:
            parts.append(text(middle, y + BAR / 2, label, anchor="middle", size=11, fill=COMPOUND_INKS[compound]))
    for low, high in strategy.windows:
        below = y + BAR + 4.5
        parts.append(line(scale(low), below, scale(high), below, INK, 1.4))
        parts += [line(scale(lap), below - 3, scale(lap), below + 3, INK, 1.4) for lap in (low, high)]
    return parts


def _legend(left: float) -> list[Markup]:
    parts, x = [], left
    for name, letter, fill, ink in zip(COMPOUND_NAMES, COMPOUNDS, COMPOUND_COLOURS, COMPOUND_INKS, strict=True):
        parts += [box(x, 5, 16, 14, fill), text(x + 8, 12, letter, anchor="middle", size=10, fill=ink), text(x + 22, 12, name, size=11)]
        x += 40 + CHARACTER * len(name)
    parts += [line(x, 12, x + 22, 12, INK, 1.4), line(x, 9, x, 15, INK, 1.4), line(x + 22, 9, x + 22, 15, INK, 1.4)]
    return [*parts, text(x + 30, 12, "pit window: 10 to 90 % of the stops", size=11)]
