"""Lap by lap averages over many races in one pass: what a validation against real laps compares."""

import time
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rsrl.compiled import kernel
from rsrl.errors import RsrlError
from rsrl.season import GREEN, RaceRecord
from rsrl.simulator import layout as at
from rsrl.simulator.callers import Rivals, line_of_callers
from rsrl.simulator.engine import CHUNKS, all_plans, available_cores, working_memory
from rsrl.simulator.figures import compile_figures
from rsrl.simulator.lap import advance_lap
from rsrl.simulator.plans import Plan
from rsrl.simulator.race import start_race, write_result
from rsrl.simulator.results import RaceResults
from rsrl.simulator.script import Script


@dataclass(frozen=True)
class LapMeans:
    """Averages over `results.races` races; arrays by lap are [laps, 20] by car index, over the races in which the car completed the lap."""

    results: RaceResults  # the same races as `simulate` gives
    lap_time_s: NDArray[np.float64]  # NaN where the car never completed the lap
    green_lap_s: NDArray[np.float64]  # the same over races in which the lap was green and neither in-lap nor out-lap
    position: NDArray[np.float64]  # on the road at the end of the lap, 1..20; NaN likewise
    running: NDArray[np.float64]  # share of races in which the car completed the lap
    first_stop: NDArray[np.int64]  # [laps + 1, 20] races whose first stop came at the end of lap 1, 2 ...; row 0: never stopped
    mean_stops: NDArray[np.float64]  # [20], changes of tyres under a red flag included
    sc_laps: float  # per race
    vsc_laps: float
    red_laps: float


def lap_means(
    record: RaceRecord,
    races: int,
    seed: int,
    *,
    plans: Mapping[int, Plan] | None = None,
    script: Script | None = None,
    rivals: Rivals | None = None,
    as_dry: bool = False,
    first_race: int = 0,
    threads: int | None = None,
) -> LapMeans:
    """The races of `simulate`, with averages by lap. Arguments and errors as there; threads never change the result."""
    if races < 1:
        raise RsrlError(f"races is {races}; ask for one at least")
    figures = compile_figures(record, script=script, as_dry=as_dry)
    table, callers = line_of_callers(figures, all_plans(record, plans, script), rivals=rivals)
    numbers = np.arange(first_race, first_race + races, dtype=np.int64)
    results = RaceResults.empty(races)
    begun = time.perf_counter()
    edges = np.linspace(0, races, min(CHUNKS, races) + 1).astype(int)

    def run(part: slice) -> tuple[NDArray[np.float64], NDArray[np.int64], int]:
        times, counts, red = np.zeros((2, record.laps, at.CARS)), np.zeros((4, record.laps + 1, at.CARS), np.int64), np.zeros(1, np.int64)
        out = results.part(part)
        _sum_races(figures, table, seed, numbers[part], callers, *working_memory(), *out, times, counts, red)
        return times, counts, int(red[0])

    parts = [slice(int(a), int(b)) for a, b in zip(edges, edges[1:], strict=False)]
    with ThreadPoolExecutor(threads or available_cores()) as pool:
        sums = list(pool.map(run, parts))
    # in the order of the parts, which are the same for any number of threads
    times = np.add.reduce([s[0] for s in sums])
    counts = np.add.reduce([s[1] for s in sums])
    results = replace(results, seconds=time.perf_counter() - begun)
    return _means(results, times, counts, sum(s[2] for s in sums))


def _means(results: RaceResults, times: NDArray[np.float64], counts: NDArray[np.int64], red: int) -> LapMeans:
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
        red / results.races,
    )


@kernel()
def _sum_races(fig, plans, seed, races, callers, f, k, r, actions, positions, stops, retired, times_s, slow_laps, times, counts, red):
    """Add races up: times float64 [all, green laps][laps, 20], red laps [1],
    counts int64 [laps done, sum of places, first stops, green laps][laps + 1, 20].
    """
    done, places, first, green = counts[0], counts[1], counts[2], counts[3]
    for i in range(races.shape[0]):
        start_race(fig, plans, seed, races[i], callers, f, k, r)
        for lap in range(fig.whole[at.I_LAPS]):
            status = r[at.R_STATUS]
            advance_lap(fig, plans, f, k, r, actions)
            for p in range(r[at.R_RUNNING]):
                car = k[at.K_ORDER, p]
                times[0, lap, car] += np.float64(f[at.F_LAP, car])
                if status == GREEN and k[at.K_STOPPED, car] == 0 and (k[at.K_AGE, car] > 1 or lap == 0):  # age 1 at its end: an out-lap
                    times[1, lap, car] += np.float64(f[at.F_LAP, car])
                    green[lap + 1, car] += 1
                done[lap + 1, car] += 1
                places[lap + 1, car] += p + 1
                first[lap + 1, car] += np.int64(k[at.K_STOPPED, car] == 1 and k[at.K_STOPS, car] == 1)
        for car in range(at.CARS):
            first[0, car] += np.int64(k[at.K_STOPS, car] == 0)
        red[0] += r[at.R_RED_LAPS]
        write_result(k, f, r, positions[i], stops[i], retired[i], times_s[i], slow_laps[i])
