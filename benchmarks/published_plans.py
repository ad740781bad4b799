"""The best plan of `rsrl plan` as a pit wall would read it, beside the strategies published before the race and what the top ten ran.

    python benchmarks/published_plans.py 2023 --laps LAPS_FOLDER --facts FACTS_FOLDER

Every dry race without a red flag whose season file has published strategies; the plan is that of its default driver. Published strategies
do not know a safety car either, the top ten's stops do: those made behind one are counted.
"""

import argparse

from season_runs import options_of, races_of, run
from season_tables import published_tables

from rsrl.cli.plan import MIN_WINDOW_RACES, WINDOW_SHARE
from rsrl.errors import RsrlError
from rsrl.evaluation.backtest.over_races import over_races
from rsrl.evaluation.backtest.published_plans import published_race
from rsrl.results import Provenance, PublishedResult

SCRIPT = "published_plans"


def measure(options: argparse.Namespace, about: Provenance) -> PublishedResult:
    """Every race that has published strategies, and how often plans agree with the top ten's."""
    windows = max(round(options.races * WINDOW_SHARE), MIN_WINDOW_RACES)
    asked = (race for race in races_of(options) if race.teaches and race.record.published)
    found = tuple(published_race(race, options.races, windows, options.seed) for race in asked)
    if not found:
        raise RsrlError("no dry race with published strategies among those asked for; 2023 has some")
    return PublishedResult(options.races, over_races([race.agrees for race in found], seed=options.seed), found, about)


if __name__ == "__main__":
    raise SystemExit(run(SCRIPT, options_of(SCRIPT, __doc__, 200_000), measure, published_tables))
