"""Running many races from Python: chunks over threads, with the same bits for any number of threads."""

import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import pairwise
from typing import TypeVar, Unpack

import numpy as np
from numpy.typing import NDArray

from rsrl.season import RaceRecord
from rsrl.simulator import layout as at
from rsrl.simulator.figures import Figures
from rsrl.simulator.plans import Plan, plan_table
from rsrl.simulator.race import run_races
from rsrl.simulator.race_arrays import empty_race
from rsrl.simulator.results import RaceResults
from rsrl.simulator.setup import RaceOptions, assign_callers, rival_code, set_up

CHUNKS = 64
"""Of races; a fixed number, so that sums over chunks do not depend on the number of threads."""

Progress = Callable[[int, int], None]
"""Called with (races done, races in all)."""

T = TypeVar("T")


def simulate(
    record: RaceRecord,
    races: int,
    seed: int,
    *,
    threads: int | None = None,
    progress: Progress | None = None,
    **options: Unpack[RaceOptions],
) -> RaceResults:
    """Simulate races of a seed.

    Args:
        record: the race.
        races: how many.
        seed: with the race number it determines everything random in a race.
        threads: how many; None for one a core. Never changes the result.
        progress: called as races are done.
        options: plans, script, rivals, as_dry, first_race: see `RaceOptions`.

    Raises:
        RsrlError: no races, a wet race, a plan that breaks the rules, a script that does not fit.
    """
    setup = set_up(record, races, **options)
    table, callers = assign_callers(setup.figures, setup.plans, rivals=setup.rivals)
    return run_rows(setup.figures, table, seed, setup.numbers, callers, threads=threads, progress=progress)


def simulate_plans(
    figures: Figures, car: int, plans: Sequence[Plan], seed: int, races: NDArray[np.int64], *, threads: int | None = None
) -> tuple[NDArray[np.int8], NDArray[np.float32]]:
    """Every plan for one car on the same races: positions int8 and race times float32 in s, both [plans, races]. Plans are not checked."""
    table = np.concatenate([figures.rival_plans, plan_table(plans)])
    callers = np.full(at.CARS, rival_code(figures), np.int32)
    rows = np.repeat(np.arange(len(plans), dtype=np.int32) + np.int32(len(figures.rival_plans)), len(races))
    result = run_rows(figures, table, seed, np.tile(races, len(plans)), callers, focus=car, focus_plans=rows, threads=threads)
    shape = (len(plans), len(races))
    return result.positions[:, car].reshape(shape), result.race_time_s[:, car].reshape(shape)


def run_rows(
    figures: Figures,
    table: NDArray[np.int32],
    seed: int,
    races: NDArray[np.int64],
    callers: NDArray[np.int32],
    *,
    focus: int = -1,
    focus_plans: NDArray[np.int32] | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> RaceResults:
    """Run one race a row, in chunks over threads. See `race.run_races` for the arguments."""
    n = len(races)
    rows = focus_plans if focus_plans is not None else np.zeros(n, np.int32)
    results = RaceResults.empty(n, int(figures.whole[at.I_CARS]))

    def run(part: slice) -> None:
        actions = np.zeros(at.CARS, np.int8)
        run_races(figures, table, seed, races[part], callers.copy(), focus, rows[part], empty_race(), actions, results.part(part))

    begun = time.perf_counter()
    in_chunks(n, run, threads=threads, progress=progress)
    return replace(results, seconds=time.perf_counter() - begun)


def in_chunks(n: int, run: Callable[[slice], T], *, threads: int | None = None, progress: Progress | None = None) -> list[T]:
    """What `run` returns for each chunk of the rows 0 to n - 1, in their order; chunks are the same for any number of threads."""
    edges = np.linspace(0, n, min(CHUNKS, n) + 1).astype(int)
    parts = [slice(int(a), int(b)) for a, b in pairwise(edges)]
    found = []
    with ThreadPoolExecutor(threads or available_cores()) as pool:
        for part, result in zip(parts, pool.map(run, parts), strict=True):
            found.append(result)
            if progress:
                progress(part.stop, n)
    return found


def available_cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
