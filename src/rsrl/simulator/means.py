"""Averages by lap over many races in one pass, for comparison with real laps."""

import time
from dataclasses import dataclass, replace
from typing import NamedTuple, Unpack

import numpy as np
from numpy.typing import NDArray

from rsrl.compiled import kernel
from rsrl.season import GREEN, RaceRecord
from rsrl.simulator import layout as at
from rsrl.simulator.engine import in_chunks
from rsrl.simulator.lap import advance_lap
from rsrl.simulator.race import start_race, write_result
from rsrl.simulator.race_arrays import empty_race
from rsrl.simulator.results import RaceResults
from rsrl.simulator.setup import RaceOptions, assign_callers, set_up
from rsrl.simulator.tyres import stint_laps


@dataclass(frozen=True)
class LapMeans:
    """Averages over `results.races` races; arrays by lap are [laps, cars], over the races in which the car completed the lap."""

    results: RaceResults  # the same races as `simulate` gives
    lap_time_s: NDArray[np.float64]  # NaN where the car never completed the lap
    green_lap_s: NDArray[np.float64]  # the same over races in which the lap was green and neither in-lap nor out-lap
    position: NDArray[np.float64]  # on the road at the end of the lap, 1 for the leader; NaN likewise
    running: NDArray[np.float64]  # share of races in which the car completed the lap
    first_stop: NDArray[np.int64]  # [laps + 1, cars] races whose first stop came at the end of lap 1, 2 ...; row 0: never stopped
    mean_stops: NDArray[np.float64]  # [cars], changes of tyres under a red flag included
    sc_laps: float  # per race
    vsc_laps: float
    red_laps: float


class _Sums(NamedTuple):
    """Sums over races; row i of `counts` is of lap i, its row 0 of the start."""

    times: NDArray[np.float64]  # [all laps, green laps][laps, CARS]
    counts: NDArray[np.int64]  # [laps done, sum of places, first stops, green laps][laps + 1, CARS]
    red: NDArray[np.int64]  # [1] laps under a red flag


def lap_means(record: RaceRecord, races: int, seed: int, *, threads: int | None = None, **options: Unpack[RaceOptions]) -> LapMeans:
    """The races of `simulate`, with averages by lap. Arguments and errors as there; threads never change the result."""
    setup = set_up(record, races, **options)
    table, callers = assign_callers(setup.figures, setup.plans, rivals=setup.rivals)
    results = RaceResults.empty(races, len(record.cars))

    def run(part: slice) -> _Sums:
        counts = np.zeros((4, record.laps + 1, at.CARS), np.int64)
        sums = _Sums(np.zeros((2, record.laps, at.CARS)), counts, np.zeros(1, np.int64))
        actions = np.zeros(at.CARS, np.int8)
        _sum_races(setup.figures, table, seed, setup.numbers[part], callers, empty_race(), actions, results.part(part), sums)
        return sums

    begun = time.perf_counter()
    # added up in the order of the chunks: float sums depend on it
    total = _Sums(*(np.add.reduce(parts) for parts in zip(*in_chunks(races, run, threads=threads), strict=True)))
    return _means(replace(results, seconds=time.perf_counter() - begun), total)


def _means(results: RaceResults, sums: _Sums) -> LapMeans:
    cars = results.positions.shape[1]
    times, counts = sums.times[..., :cars], sums.counts[..., :cars]
    done, places, first, green = counts[0, 1:], counts[1, 1:], counts[2], counts[3, 1:]
    with np.errstate(invalid="ignore", divide="ignore"):
        lap_time_s, green_lap_s, position = times[0] / done, times[1] / green, places / done
    sc_laps, vsc_laps = (float(x) for x in results.slow_laps.mean(axis=0))
    return LapMeans(
        results,
        lap_time_s,
        green_lap_s,
        position,
        done / results.races,
        first,
        results.stops.mean(axis=0),
        sc_laps,
        vsc_laps,
        int(sums.red[0]) / results.races,
    )


@kernel()
def _sum_races(fig, plans, seed, races, callers, race, actions, out, sums):
    """Run races and add them up. `race`, `actions`, `out`: as of `race.run_races`; `sums`: `_Sums`."""
    f, k, r = race.f, race.k, race.r
    times, counts = sums.times, sums.counts
    done, places, first, green = counts[0], counts[1], counts[2], counts[3]
    for i in range(races.shape[0]):
        start_race(fig, plans, seed, races[i], callers, f, k, r)
        for lap in range(fig.whole[at.I_LAPS]):
            status = r[at.R_STATUS]
            advance_lap(fig, plans, f, k, r, actions)
            for p in range(r[at.R_RUNNING]):
                car = k[at.K_ORDER, p]
                times[0, lap, car] += np.float64(f[at.F_LAP, car])
                if status == GREEN and k[at.K_STOPPED, car] == 0 and (stint_laps(k, car) > 1 or lap == 0):  # 1 at its end: an out-lap
                    times[1, lap, car] += np.float64(f[at.F_LAP, car])
                    green[lap + 1, car] += 1
                done[lap + 1, car] += 1
                places[lap + 1, car] += p + 1
                first[lap + 1, car] += np.int64(k[at.K_STOPPED, car] == 1 and k[at.K_STOPS, car] == 1)
        for car in range(at.CARS):
            first[0, car] += np.int64(k[at.K_STOPS, car] == 0)
        sums.red[0] += r[at.R_RED_LAPS]
        write_result(fig.whole, f, k, r, out, i)
