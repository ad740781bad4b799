"""Whether a race's compounds have an order: of two, the softer is quicker when fresh and wears more, or one dominates the other."""

from collections.abc import Iterator
from itertools import combinations
from typing import Final

import numpy as np

from rsrl.results import Domination
from rsrl.season import COMPOUNDS, Figure, RaceRecord, TyreFigures

WEAR_LAPS: Final = 20
"""Wear of a tyre whose wear is no straight line is its mean over so many laps."""


def dominations(record: RaceRecord) -> Iterator[Domination]:
    """Pairs of which one compound is quicker when fresh and wears no more; the other is slower and wears more, or as much."""
    for soft, hard in combinations(COMPOUNDS, 2):
        for better, worse in ((soft, hard), (hard, soft)):
            a, b = record.tyres[better], record.tyres[worse]
            fresh, wear = b.offset_s.value - a.offset_s.value, _wear(b) - _wear(a)
            if fresh > 0 and wear >= 0:
                errors = _se(a.offset_s, b.offset_s), _se(a.wear_s_per_lap, b.wear_s_per_lap)
                yield Domination(better, worse, fresh, errors[0], wear, errors[1], _reason(better, a, worse, b))


def _wear(tyre: TyreFigures) -> float:
    """Mean wear a lap over `WEAR_LAPS`, s."""
    return tyre.wear_s_per_lap.value + WEAR_LAPS * tyre.curvature_s_per_lap2.value


def _se(a: Figure, b: Figure) -> float:
    """Standard error of the difference of two figures."""
    return float(np.hypot(a.se, b.se))


def _reason(better: str, a: TyreFigures, worse: str, b: TyreFigures) -> str:
    """The figures of both compounds, and once each what their file says of them."""
    figures = (a.offset_s, b.offset_s, a.wear_s_per_lap, b.wear_s_per_lap)
    notes = "; ".join(dict.fromkeys(f.note for f in figures if f.note))
    return f"{_said(better, a)}, {_said(worse, b)}: {notes}"


def _said(letter: str, tyre: TyreFigures) -> str:
    wear = tyre.wear_s_per_lap
    return f"{letter} ({tyre.c_number}) {tyre.offset_s.value:+.2f} s and {wear.value:.3f} s a lap from {wear.n} laps"
