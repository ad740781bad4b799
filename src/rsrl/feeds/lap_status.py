"""When the track status changed, from the digits of the laps: a lap says what was seen during it, not when.

At any moment each car is on some lap. While a safety car is out every one of those laps bears its digit, and when it is not, laps that
ended before it or began after it do not. So a status is taken to hold between two crossings of the line if at least `AGREED` of the laps
under way bear its digit. A change lies between two crossings and is placed half way.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.feeds.events import StatusChanged
from rsrl.season import GREEN, RED, SC, VSC

AGREED: Final = 0.9
"""Two exports of a race agree on the digits of 93 % of the laps, so not every lap need bear one."""

DIGITS: Final = ((VSC, "67"), (SC, "4"), (RED, "5"))
"""FastF1's digits of each status, the gravest last."""


class Lap(NamedTuple):
    """A lap of one car: session times of its beginning and end, and the digits seen on it; None where the source has none."""

    start_s: float
    end_s: float
    digits: str | None


def status_changes(laps: Sequence[Lap]) -> Iterator[StatusChanged]:
    """The changes of track status in a race, the first one the status at the start."""
    marked = [lap for lap in laps if lap.digits is not None and lap.end_s > lap.start_s]
    if not marked:
        yield StatusChanged(min(lap.start_s for lap in laps), GREEN)
        return
    edges = np.unique([time for lap in marked for time in (lap.start_s, lap.end_s)])
    under_way = _laps_between(edges, marked)
    status = np.full(len(edges) - 1, GREEN)
    for code, digits in DIGITS:
        bearing = _laps_between(edges, [lap for lap in marked if set(digits) & set(str(lap.digits))])
        status[(bearing >= AGREED * under_way) & (bearing > 0)] = code
    yield StatusChanged(float(edges[0]), int(status[0]))
    for i, (before, now) in enumerate(pairwise(status.tolist()), 1):
        if now != before:
            yield StatusChanged(float(edges[i] + edges[i + 1]) / 2, now)


def _laps_between(edges: NDArray[np.float64], laps: Sequence[Lap]) -> NDArray[np.int64]:
    """How many of the laps were under way between each two edges in a row."""
    steps = np.zeros(len(edges), np.int64)
    np.add.at(steps, np.searchsorted(edges, [lap.start_s for lap in laps]), 1)
    np.add.at(steps, np.searchsorted(edges, [lap.end_s for lap in laps]), -1)
    return np.cumsum(steps)[:-1]
