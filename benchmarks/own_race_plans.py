"""Would the pit walls of a race have decided as they did in its simulated race? The best plans by its season file beside the field's.

    python benchmarks/own_race_plans.py 2022 2023 2024 --laps LAPS_FOLDER --facts FACTS_FOLDER

Every dry race without a red flag, with its season file as shipped, which may know the race. For three cars of those that ran the
commonest sequence (at the quarters of their grid places) the best plan of every sequence is found in the race, with rivals, traffic and
luck; what the commonest sequence then loses is measured on races that nothing was chosen on. `rsrl.evaluation.backtest.own_race` has the
measures. A race in which fewer than five cars ran a plan of their own counts for its starting tyre and the order of its compounds alone.
"""

import argparse

from season_runs import options_of, races_of, run
from season_tables import own_plans_tables

from rsrl.errors import RsrlError
from rsrl.evaluation.backtest.over_races import over_races
from rsrl.evaluation.backtest.own_race import GOALS, MEDIANS, own_race
from rsrl.results import OwnPlansResult, Provenance

SCRIPT = "own_race_plans"


def measure(options: argparse.Namespace, about: Provenance) -> OwnPlansResult:
    """Every race of the seasons that ran as its field had planned, and the measures over all of them."""
    found = tuple(own_race(race, options.races, options.seed) for race in races_of(options) if race.teaches)
    if not found:
        raise RsrlError("no dry race without a red flag among those asked for; name another")
    overall = over_races([race.scores for race in found], MEDIANS, options.seed)
    return OwnPlansResult(options.races, overall, GOALS, found, about)


if __name__ == "__main__":
    raise SystemExit(run(SCRIPT, options_of(SCRIPT, __doc__, 400), measure, own_plans_tables))
