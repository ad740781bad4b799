"""Stops, safety cars, passes and retirements, counted in the same way in real and in simulated races."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from rsrl.season import GREEN, SC, VSC, RaceRecord
from rsrl.simulator import Trace

if TYPE_CHECKING:
    import polars as pl

    from rsrl.calibration import RaceFacts

STATISTICS: Final = ("stops", "one_stop", "two_stops", "three_stops", "sc_laps", "vsc_laps", "passes", "retirements")
"""Stops of a car that finished; shares of such cars with one, two, three or more; laps; passes on track; cars out."""

FIRST_COUNTED_LAP: Final = 3
"""Places won on the first two laps are the start, not passes."""


@dataclass(frozen=True)
class RaceArrays:
    """One race lap by lap, arrays [laps, cars]."""

    place: NDArray[np.int64]  # 1.. on the road at the end of the lap
    stopped: NDArray[np.bool_]  # changed tyres at the end of the lap
    running: NDArray[np.bool_]  # completed the lap
    status: NDArray[np.int64]  # [laps]
    finished: NDArray[np.bool_]  # [cars]


def count(race: RaceArrays) -> dict[str, float]:
    """`STATISTICS` of one race."""
    stops = race.stopped.sum(axis=0)[race.finished]
    shares = {name: float((stops == n).mean()) for name, n in (("one_stop", 1), ("two_stops", 2))} if len(stops) else {}
    return {
        "stops": float(stops.mean()) if len(stops) else float("nan"),
        "one_stop": shares.get("one_stop", float("nan")),
        "two_stops": shares.get("two_stops", float("nan")),
        "three_stops": float((stops >= 3).mean()) if len(stops) else float("nan"),
        "sc_laps": float((race.status == SC).sum()),
        "vsc_laps": float((race.status == VSC).sum()),
        "passes": float(passes(race)),
        "retirements": float((~race.finished).sum()),
    }


def passes(race: RaceArrays) -> int:
    """Pairs of cars that swapped places over a green lap on which neither stopped, had just stopped, or dropped out.

    Only places at the line are seen, so that a pass given back within the lap does not count, on either side.
    """
    laps = len(race.place)
    free = race.running & ~race.stopped
    free[1:] &= ~race.stopped[:-1]
    total = 0
    for lap in range(FIRST_COUNTED_LAP - 1, laps):
        if race.status[lap] != GREEN or race.status[lap - 1] != GREEN:
            continue
        on = np.flatnonzero(free[lap] & race.running[lap - 1])
        before, after = race.place[lap - 1][on], race.place[lap][on]
        ahead = before[:, None] < before[None, :]
        total += int((ahead & (after[:, None] > after[None, :])).sum())
    return total


def simulated_races(record: RaceRecord, trace: Trace) -> list[RaceArrays]:
    """The races of a trace, cars of the record only."""
    cars = len(record.cars)
    return [
        RaceArrays(
            place=trace.place[i, :, :cars].astype(np.int64),
            stopped=trace.stopped[i, :, :cars],
            running=trace.running[i, :, :cars],
            status=trace.track_status[i].astype(np.int64),
            finished=trace.running[i, -1, :cars],
        )
        for i in range(len(trace.place))
    ]


def real_race_arrays(race: "pl.DataFrame", facts: "RaceFacts") -> RaceArrays:
    """A real race from its laps; a car whose place is not on record keeps its last one."""
    import polars as pl

    from rsrl.laps import neutralised_laps, tyre_stops

    index = {d: i for i, d in enumerate(facts.grid)}
    shape = (facts.laps, len(index))
    place, running = np.zeros(shape, np.int64), np.zeros(shape, bool)
    for driver, lap, position in race.filter(pl.col("lap") <= facts.laps).select("driver", "lap", "position").iter_rows():
        running[lap - 1, index[driver]] = True
        place[lap - 1, index[driver]] = position or 0
    for lap in range(1, facts.laps):
        place[lap] = np.where(place[lap] > 0, place[lap], place[lap - 1])
    stopped = np.zeros(shape, bool)
    for driver, lap in tyre_stops(race).select("driver", "lap").iter_rows():
        if lap <= facts.laps:
            stopped[lap - 1, index[driver]] = True
    status = np.zeros(facts.laps, np.int64)
    for lap, code in neutralised_laps(race).select("lap", "status").iter_rows():
        if lap <= facts.laps:
            status[lap - 1] = code
    return RaceArrays(place, stopped, running, status, np.array([d not in facts.retired for d in facts.grid]))


def spread(counts: list[dict[str, float]]) -> Mapping[str, tuple[float, float, float, float]]:
    """Of each statistic over simulated races: mean, its standard error, and the 5 and 95 % quantiles of one race."""
    out = {}
    for name in STATISTICS:
        values = np.array([c[name] for c in counts])
        values = values[np.isfinite(values)]
        low, high = np.quantile(values, [0.05, 0.95])
        out[name] = (float(values.mean()), float(values.std() / np.sqrt(len(values))), float(low), float(high))
    return out
