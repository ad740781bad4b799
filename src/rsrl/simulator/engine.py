"""Running many races from Python: chunks over threads, with the same bits for any number of them."""

import os
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.season import RaceRecord
from rsrl.simulator import layout as at
from rsrl.simulator.callers import Rivals, line_of_callers, rival_code
from rsrl.simulator.figures import Figures, compile_figures
from rsrl.simulator.plans import Plan, check_plan, plan_table
from rsrl.simulator.race import run_races
from rsrl.simulator.results import RaceResults
from rsrl.simulator.script import Script

CHUNKS = 64
Progress = Callable[[int, int], None]
"""Called with (races done, races in all)."""


def simulate(
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
    progress: Progress | None = None,
) -> RaceResults:
    """Simulate races numbered first_race, first_race + 1 ... of a seed.

    Args:
        plans: plan for some cars, by car index; it goes before the script's.
        script: incidents, retirements and stops happen as it says (script.py).
        rivals: how the cars without a plan are called; None for `reactive` where the record has the figures, else `plans`.
        as_dry: run a wet race as if it had been dry.
        threads: how many; None for one a core. Never changes the result.

    Raises:
        RsrlError: no races, a wet race, a plan that breaks the rules, a script that does not fit.
    """
    if races < 1:
        raise RsrlError(f"races is {races}; ask for one at least")
    figures = compile_figures(record, script=script, as_dry=as_dry)
    table, callers = line_of_callers(figures, all_plans(record, plans, script), rivals=rivals)
    numbers = np.arange(first_race, first_race + races, dtype=np.int64)
    return run_rows(figures, table, seed, numbers, callers, threads=threads, progress=progress)


def all_plans(record: RaceRecord, plans: Mapping[int, Plan] | None, script: Script | None) -> dict[int, Plan]:
    """The script's plans, which are history, and over them those asked for, which must keep the rules (RsrlError)."""
    for plan in (plans or {}).values():
        check_plan(plan, record)
    return {**(script.plans if script else {}), **(plans or {})}


def simulate_plans(
    figures: Figures, car: int, plans: Sequence[Plan], seed: int, races: NDArray[np.int64], *, threads: int | None = None
) -> tuple[NDArray[np.int8], NDArray[np.float32]]:
    """Every plan for one car on the same races: positions int8 and race times float32, both [plans, races]. Plans are not checked."""
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
    results = RaceResults.empty(n)
    edges = np.linspace(0, n, min(CHUNKS, n) + 1).astype(int)
    done = 0

    def run(part: slice) -> int:
        run_races(figures, table, seed, races[part], callers.copy(), focus, rows[part], *working_memory(), *results.part(part))
        return part.stop - part.start

    begun = time.perf_counter()
    parts = [slice(int(a), int(b)) for a, b in zip(edges, edges[1:], strict=False)]
    with ThreadPoolExecutor(threads or available_cores()) as pool:
        for size in pool.map(run, parts):
            done += size
            if progress:
                progress(done, n)
    return replace(results, seconds=time.perf_counter() - begun)


def working_memory() -> tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.int32], NDArray[np.int8]]:
    """State arrays f, k, r and the actions of one race; one set a running thread."""
    f, k = np.empty((at.F_ROWS, at.CARS), np.float32), np.empty((at.K_ROWS, at.CARS), np.int32)
    return f, k, np.empty(at.R_SIZE, np.int32), np.zeros(at.CARS, np.int8)


def available_cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
