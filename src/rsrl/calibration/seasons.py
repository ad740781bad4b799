"""Stage one of calibration, race by race over whole seasons, in several processes."""

from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Final

import polars as pl
from threadpoolctl import threadpool_limits

from rsrl.calibration.entry import nominated
from rsrl.calibration.race.analysis import RaceAnalysis, analyse_race
from rsrl.calibration.race_facts import RaceFacts, published_strategies, race_facts, starters_only
from rsrl.laps import BROKEN_RACES, RACE

Report = Callable[[int, int], None]
FEW_RACES: Final = 6  # with fewer, starting processes takes longer than it saves

_Job = tuple[pl.DataFrame, RaceFacts, dict[str, str], tuple[str, ...]]


def analyse_seasons(table: pl.DataFrame, facts_folder: Path | None, progress: Report | None = None, workers: int = 2) -> list[RaceAnalysis]:
    """Analyse every race of a lap table, in order of season and round; races known to be broken are left out.

    Args:
        table: laps of any number of seasons.
        facts_folder: holds the results; None: grids come from lap 1.
        progress: called with races done and races in all.
        workers: processes; the result does not depend on it.
    """
    jobs = list(_jobs(table, facts_folder))
    found = []
    for analysis in _run(jobs, workers):
        found.append(analysis)
        if progress is not None:
            progress(len(found), len(jobs))
    return found


def _run(jobs: list[_Job], workers: int) -> Iterator[RaceAnalysis]:
    if workers < 2 or len(jobs) < FEW_RACES:
        yield from map(_one, jobs)
        return
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:  # spawned: threads of polars do not survive a fork
        yield from pool.map(_one, jobs)


def _jobs(table: pl.DataFrame, facts_folder: Path | None) -> Iterator[_Job]:
    for season, number in table.select(*RACE).unique().sort(*RACE).iter_rows():
        if (season, number) in BROKEN_RACES:
            continue
        race = table.filter((pl.col("season") == season) & (pl.col("round") == number))
        facts = race_facts(race, facts_folder, season, number)
        race = starters_only(race, facts)
        yield race, facts, nominated(race, facts_folder), published_strategies(facts_folder, season, number, facts.laps)


def _one(job: _Job) -> RaceAnalysis:
    with threadpool_limits(1):  # small matrices: more threads of linear algebra only slow each other down
        return analyse_race(*job)
