"""Errors of laps late in their stints, forecast from earlier seasons and rounds, with the tyres of laps and choices and of lap times alone.

    python benchmarks/late_laps.py 2024 --fit 2022 2023 --laps LAPS_FOLDER --facts FACTS_FOLDER

`rsrl.evaluation.backtest.late_laps` says which laps are late and what counts as an error. Intervals are over races.
"""

import argparse
import sys

from season_runs import folder_options, run
from season_tables import late_laps_table

from rsrl.errors import RsrlError
from rsrl.evaluation.backtest import read_season
from rsrl.evaluation.backtest.late_laps import GOALS, LATE_SHARE, late_laps, over_laps
from rsrl.results import LateLapsResult, Provenance

SCRIPT = "late_laps"


def parser() -> argparse.ArgumentParser:
    """The test season and those it is forecast from."""
    found = folder_options(SCRIPT, __doc__)
    found.add_argument("test", type=int, metavar="SEASON")
    found.add_argument("--fit", type=int, nargs="+", required=True, metavar="SEASON")
    return found


def measure(options: argparse.Namespace, about: Provenance) -> LateLapsResult:
    """Every dry race of the test season."""
    if late := [s for s in options.fit if s >= options.test]:
        raise RsrlError(f"--fit {late[0]} is not before {options.test}; earlier rounds of {options.test} are used anyway")
    season = read_season(options.laps, options.facts, tuple(options.fit), options.test)
    found = []
    for index in season.test_indices:
        print(f"{season.name(index)} ...", file=sys.stderr)
        found.append(late_laps(season, index))
    races = tuple(race for race in found if race is not None)
    if not races:
        raise RsrlError(f"no dry race of {options.test} has late laps")
    return LateLapsResult(season.fit, season.test, LATE_SHARE, over_laps(races), GOALS, races, about)


if __name__ == "__main__":
    raise SystemExit(run(SCRIPT, parser(), measure, late_laps_table))
