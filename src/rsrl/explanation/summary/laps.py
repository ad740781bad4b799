"""Which laps of a race mattered: its stops, the calls that were close, and the laps on which the safety car came out."""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.summary.driven import DrivenRace
from rsrl.state import COLUMN

CLOSE_SHARE: Final = 0.25
"""A call is close where its margin is at most this share of the race's median margin."""

APART_LAPS: Final = 3
"""Of several close calls so near to one another, or to a stop, the closest is told."""

MOST_CLOSE: Final = 3


class LapThatMattered(NamedTuple):
    """A lap, 1 for the first, and why it mattered: "stop", "close call" or "safety car"."""

    lap: int
    why: str


def laps_that_mattered(driven: DrivenRace) -> list[LapThatMattered]:
    """In the order of the race."""
    stops = [lap for lap in range(1, driven.laps + 1) if driven.calls[lap - 1]]
    found = dict.fromkeys(stops, "stop")
    for lap in _neutralised(driven):
        found.setdefault(lap, "safety car")
    for lap in _close_calls(driven, stops):
        found.setdefault(lap, "close call")
    return [LapThatMattered(lap, found[lap]) for lap in sorted(found)]


def _neutralised(driven: DrivenRace) -> list[int]:
    """First laps of safety cars and virtual ones; where one turns into the other is such a lap too."""
    status = driven.raw[:, COLUMN["safety_car"]].astype(int)
    return [i + 1 for i in range(driven.laps) if status[i] and (i == 0 or status[i - 1] != status[i]) and driven.legal[i].sum() > 1]


def _close_calls(driven: DrivenRace, stops: list[int]) -> list[int]:
    """Laps it stayed out on though a stop was nearly as good, the closest of each neighbourhood, none just before a stop."""
    margins = driven.margins()
    known = np.isfinite(margins)
    if not known.any():
        return []
    limit = CLOSE_SHARE * float(np.median(margins[known]))
    chosen: list[int] = []
    for i in np.argsort(np.where(known, margins, np.inf), kind="stable"):
        lap = int(i) + 1
        near = any(abs(lap - other) <= APART_LAPS for other in (*stops, *chosen))
        if known[i] and 0 <= margins[i] <= limit and not driven.calls[i] and not near and len(chosen) < MOST_CLOSE:
            chosen.append(lap)
    return chosen


def turning_lap(for_a_stop: NDArray[np.float64], lap: int) -> int | None:
    """The last lap before `lap` on which staying out was preferred; None where there is none."""
    for earlier in range(lap - 1, 0, -1):
        if for_a_stop[earlier - 1] < 0:
            return earlier
    return None
