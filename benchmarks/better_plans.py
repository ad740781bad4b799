"""Races in which the season file says that another sequence would have been better than the one most of the field ran, and why.

    python benchmarks/better_plans.py 2022 2023 2024 --laps LAPS_FOLDER --facts FACTS_FOLDER

Every dry race without a red flag in which five cars or more ran a plan of their own, with its season file as shipped. Gains are in the
simulated race, with rivals, traffic and luck, for the car in the middle of those that ran the commonest sequence; their intervals hold
the errors of the file's figures. Of so many races one in forty would be clear of zero by chance alone.
"""

import argparse

from season_runs import options_of, races_of, run
from season_tables import better_plans

from rsrl.errors import RsrlError
from rsrl.evaluation.backtest.better_plans import DRAWS, better_plan
from rsrl.results import BetterPlan, BetterPlansResult, Provenance

SCRIPT = "better_plans"


def measure(options: argparse.Namespace, about: Provenance) -> BetterPlansResult:
    """Every race that can be asked about."""
    asked = {race.record.name: better_plan(race, options.races, options.seed, DRAWS) for race in races_of(options) if race.teaches}
    if not asked:
        raise RsrlError("no dry race without a red flag among those asked for; name another")
    found = tuple(answer for answer in asked.values() if isinstance(answer, BetterPlan))
    left_out = {name: answer for name, answer in asked.items() if isinstance(answer, str)}
    return BetterPlansResult(options.races, DRAWS, found, left_out, about)


if __name__ == "__main__":
    raise SystemExit(run(SCRIPT, options_of(SCRIPT, __doc__, 400), measure, better_plans))
