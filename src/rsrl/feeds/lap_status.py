"""When the track status changed, from the digits of the laps: a lap says what was seen during it, not when.

At any moment each car is on some lap. While a safety car is out every one of those laps bears its digit, and laps that ended before it or
began after it do not. So a stretch between two crossings of the line belongs to a status if at least `AGREED` of the laps under way bear
its digit, and stretches with no less than `KEPT` of them in between are one. Both ends of what that gives are then moved to where the
fewest laps contradict it: the leader alone, one crossing into a lap, can tell that a safety car was not out before. A change lies between
two crossings and is placed half way; the end of a safety car on the later one, since it comes in at the end of a lap. Against the recorded
track status of Bahrain 2023 and Azerbaijan 2018 the six changes of these two races are placed 1 to 27 s off.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from statistics import median
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.feeds.events import StatusChanged
from rsrl.season import GREEN, RED, SC, VSC

AGREED: Final = 0.9
"""Two exports of a race agree on the digits of 93 % of the laps, so not every lap need bear one."""

KEPT: Final = 0.5
"""Where the digits of a few more laps are missing, a status that has begun goes on."""

DIGITS: Final = ((VSC, "67"), (SC, "4"), (RED, "5"))
"""FastF1's digits of each status, the gravest last."""

WAITED_S: Final = 240.0
"""A passage of the pit lane longer than this waits for a race to go on; no stop and no repair of a car that races on takes so long."""

GATHERED_S: Final = 600.0
"""In so long after a red flag every car has come to the pit lane."""

LEFT_S: Final = 90.0
"""The field leaves the pit lane within so long."""

FEWEST_STOOD: Final = 3
"""So many cars that waited together stood under a red flag; fewer may have been under repair."""

KNOWN_S: Final = 10.0
"""A red flag that the digits miss, as they do on the first laps, is taken to be known so long before the field enters the pit lane."""

SEARCHED: Final = 60
"""Crossings before and after an end among which a better place for it is sought: three laps of a full field."""


class Lap(NamedTuple):
    """A lap of one car: session times of its beginning and end, and the digits seen on it; None where the source has none."""

    start_s: float
    end_s: float
    digits: str | None


class _Crossings(NamedTuple):
    """Laps on a common scale: `edges` are the crossings in time, and laps run from edge `first` to edge `last` of them."""

    edges: NDArray[np.float64]
    first: NDArray[np.int64]
    last: NDArray[np.int64]


def status_changes(laps: Sequence[Lap], passages: Sequence[tuple[float, float]] = ()) -> list[StatusChanged]:
    """The changes of track status in a race; the first is the status at the start, which is green.

    Args:
        passages: session times of entry and exit of each passage of the pit lane. Behind a red flag the field waits there, and the first
            car that leaves ends it: the lap on which cars wait bears no digit of it as a rule.
    """
    changes = _with_missed(list(_by_digits(laps)), passages)
    for red in [change for change in changes if change.status == RED]:
        waits = [out_s for in_s, out_s in passages if out_s - in_s > WAITED_S and red.time_s - WAITED_S < in_s < red.time_s + GATHERED_S]
        if waits:
            # cars that are a lap down may be let go a lap before the others
            changes = _until(changes, red, min(out_s for out_s in waits if out_s > median(waits) - LEFT_S))
    return changes


def _with_missed(changes: Sequence[StatusChanged], passages: Sequence[tuple[float, float]]) -> list[StatusChanged]:
    """The changes, with a red flag wherever the field waited in the pit lane and the digits have none."""
    groups: list[list[tuple[float, float]]] = []
    for passage in sorted((in_s, out_s) for in_s, out_s in passages if out_s - in_s > WAITED_S):
        if groups and passage[0] < min(out_s for _, out_s in groups[-1]):
            groups[-1].append(passage)
        else:
            groups.append([passage])
    missed: list[StatusChanged] = []
    for group in groups:
        if len(group) < FEWEST_STOOD:
            continue
        # cars that came in before it may have been under repair already
        begin_s, end_s = group[FEWEST_STOOD - 1][0], min(out_s for _, out_s in group)
        if not any(change.status == RED and begin_s - GATHERED_S < change.time_s < end_s for change in changes):
            missed.append(StatusChanged(begin_s - KNOWN_S, RED))
    return sorted([*changes, *missed], key=lambda change: change.time_s)


def _until(changes: Sequence[StatusChanged], red: StatusChanged, end_s: float) -> list[StatusChanged]:
    """The changes, with a red flag that ends at `end_s`: what the digits have in between, or have of its end later, gives way."""
    before = [change for change in changes if change.time_s <= red.time_s]
    within = [change for change in changes if red.time_s < change.time_s]
    over = next((i for i, change in enumerate(within) if change.status != RED), len(within))
    after = [change for i, change in enumerate(within) if i > over and change.time_s > end_s]
    # what follows is the last status within, or that with which the digits have the red flag end later
    followed = within[over].status if over < len(within) else GREEN
    then = next((c.status for c in reversed(within) if c.time_s <= end_s and c.status != RED), followed)
    return [*before, StatusChanged(end_s, then), *after]


def _by_digits(laps: Sequence[Lap]) -> Iterator[StatusChanged]:
    yield StatusChanged(min(lap.start_s for lap in laps), GREEN)
    marked = [lap for lap in laps if lap.digits is not None and lap.end_s > lap.start_s]
    if not marked:
        return
    starts, ends = np.array([lap.start_s for lap in marked]), np.array([lap.end_s for lap in marked])
    edges = np.unique([starts, ends])
    on = _Crossings(edges, np.searchsorted(edges, starts), np.searchsorted(edges, ends))
    status = np.full(len(edges) - 1, GREEN)
    for code, digits in DIGITS:
        bears = np.array([bool(set(digits) & set(str(lap.digits))) for lap in marked])
        for begin, end in _refined(on, bears, _agreed(on, bears)):
            status[begin:end] = code
    yield from _changes(edges, status.tolist())


def _changes(edges: NDArray[np.float64], status: Sequence[int]) -> Iterator[StatusChanged]:
    """Changes between stretches: a status has begun in the first stretch that belongs to it, and ended in its last one."""
    latest_s = float(edges[0])
    for i, (before, now) in enumerate(pairwise((GREEN, *status))):
        if now == before:
            continue
        within = i if now > before else i - 1
        begin_s, end_s = max(float(edges[within]), latest_s), float(edges[within + 1])
        latest_s = end_s if before == SC and now < SC else (begin_s + end_s) / 2
        yield StatusChanged(latest_s, now)


def _agreed(on: _Crossings, bears: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Stretches, as numbers of edges, in which the laps under way bear the digit."""
    steps = np.zeros((2, len(on.edges)), np.int64)
    for row, chosen in enumerate((np.ones_like(bears), bears)):
        np.add.at(steps[row], on.first[chosen], 1)
        np.add.at(steps[row], on.last[chosen], -1)
    under_way, bearing = np.cumsum(steps, axis=1)[:, :-1]
    active = np.concatenate([[False], (bearing >= AGREED * under_way) & (bearing > 0), [False]])
    changes = np.flatnonzero(active[1:] != active[:-1]).tolist()
    found: list[tuple[int, int]] = []
    for begin, end in zip(changes[::2], changes[1::2], strict=True):
        if found and (bearing[found[-1][1] : begin] >= KEPT * under_way[found[-1][1] : begin]).all():
            found[-1] = (found[-1][0], end)
        else:
            found.append((begin, end))
    return found


def _refined(on: _Crossings, bears: NDArray[np.bool_], stretches: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """The stretches with their ends where the fewest laps contradict them."""
    found = list(stretches)
    for i, (begin, end) in enumerate(stretches):
        others = np.zeros_like(bears)
        for other in [*found[:i], *found[i + 1 :]]:
            others |= _overlap(on, *other)
        low = found[i - 1][1] if i else 0
        high = stretches[i + 1][0] if i + 1 < len(stretches) else len(on.edges) - 1
        begins = range(max(low, begin - SEARCHED), min(begin + SEARCHED, end))
        begin = min(begins, key=lambda b: (_contradictions(on, bears, others, b, end), abs(b - begin)))
        ends = range(max(begin + 1, end - SEARCHED), min(high, end + SEARCHED) + 1)
        end = min(ends, key=lambda e: (_contradictions(on, bears, others, begin, e), abs(e - end)))
        found[i] = (begin, end)
    return found


def _overlap(on: _Crossings, begin: int, end: int) -> NDArray[np.bool_]:
    return (on.last > begin) & (on.first < end)


def _contradictions(on: _Crossings, bears: NDArray[np.bool_], others: NDArray[np.bool_], begin: int, end: int) -> int:
    """Laps that bear the digit outside all stretches, or do not bear it inside."""
    return int((bears != (others | _overlap(on, begin, end))).sum())
