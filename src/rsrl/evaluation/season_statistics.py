"""Stops, safety cars, passes and retirements, counted in the same way in real and in simulated races."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from rsrl.season import GREEN, RED, SC, VSC, RaceRecord
from rsrl.simulator import Script, Trace, trace_races

if TYPE_CHECKING:
    import polars as pl

    from rsrl.calibration import RaceFacts

STATISTICS: Final = ("stops", "one_stop", "two_stops", "three_stops", "sc_laps", "vsc_laps", "passes", "retirements")
"""Stops of a car that finished; shares of such cars with one, two, three or more; laps; passes on track; cars out."""

FIRST_COUNTED_LAP: Final = 3
"""A pass is a change between the ends of two racing laps, and lap 1 is none."""

TRACED_AT_ONCE: Final = 100
"""Races whose laps are kept in memory together."""

SLOW_LAP: Final = 1.15
"""Median lap time, against the race's, beyond which a lap was no racing lap: a stoppage or restart that the track status does not show."""


@dataclass(frozen=True)
class RaceArrays:
    """One race lap by lap, arrays [laps, cars]."""

    place: NDArray[np.int64]  # 1.. on the road at the end of the lap, by race distance
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
    """On-track passes: pairs of running cars whose order at the line changed between two racing laps under green.

    Left out: lap 1, in-laps and out-laps of either car, the last lap of a car that retires, and lapping, which changes no place. What
    happens between two crossings of the line is not seen, in real races or in simulated ones: a pass given back within the lap does not
    count, two cars passed on one lap count as two, and a car that spins or slows with damage is passed by everyone it falls behind.
    """
    laps = len(race.place)
    free = race.running & ~race.stopped
    free[1:] &= ~race.stopped[:-1]
    free[:-1] &= race.running[1:] | race.finished
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


def simulated_counts(record: RaceRecord, races: int, seed: int, script: Script | None = None) -> list[dict[str, float]]:
    """`count` of each simulated race; `script`: with a real race's own stops, retirements and safety cars."""
    counted = []
    for first in range(0, races, TRACED_AT_ONCE):
        trace = trace_races(record, min(TRACED_AT_ONCE, races - first), seed, first_race=first, script=script)
        counted += [count(race) for race in simulated_races(record, trace)]
    return counted


def real_race_arrays(race: "pl.DataFrame", facts: "RaceFacts") -> RaceArrays:
    """A real race from its laps; a car whose place is not on record keeps its last one. Cars that did not start are left out."""
    import polars as pl

    from rsrl.laps import tyre_stops

    index = {d: i for i, d in enumerate(facts.grid)}
    shape = (facts.laps, len(index))
    place, running = np.zeros(shape, np.int64), np.zeros(shape, bool)
    laps = race.filter((pl.col("lap") <= facts.laps) & pl.col("driver").is_in(list(index)))
    for driver, lap, position in laps.select("driver", "lap", "position").iter_rows():
        running[lap - 1, index[driver]] = True
        place[lap - 1, index[driver]] = position or 0
    for lap in range(1, facts.laps):
        place[lap] = np.where(place[lap] > 0, place[lap], place[lap - 1])
    stopped = np.zeros(shape, bool)
    for driver, lap in tyre_stops(laps).select("driver", "lap").iter_rows():
        stopped[lap - 1, index[driver]] = True
    finished = np.array([d not in facts.retired for d in facts.grid])
    return RaceArrays(place, stopped, running, _status(laps, facts.laps), finished)


def _status(laps: "pl.DataFrame", distance: int) -> NDArray[np.int64]:
    """Track status of each lap, `RED` also where the field was too slow for a racing lap and nothing says why."""
    import polars as pl

    from rsrl.laps import neutralised_laps

    status = np.zeros(distance, np.int64)
    usual = pl.col("lap_time_s").median()
    slow = laps.group_by("lap").agg(usual).filter(pl.col("lap_time_s") > SLOW_LAP * laps.select(usual).item())
    status[slow["lap"].to_numpy() - 1] = RED
    for lap, code in neutralised_laps(laps).select("lap", "status").iter_rows():
        status[lap - 1] = code
    return status


def spread(counts: list[dict[str, float]]) -> Mapping[str, tuple[float, float, float, float]]:
    """Of each statistic over simulated races: mean, its standard error, and the 5 and 95 % quantiles of one race."""
    out = {}
    for name in STATISTICS:
        values = np.array([c[name] for c in counts])
        values = values[np.isfinite(values)]
        low, high = np.quantile(values, [0.05, 0.95])
        out[name] = (float(values.mean()), float(values.std() / np.sqrt(len(values))), float(low), float(high))
    return out
