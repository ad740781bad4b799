"""Passes on track a race, real and simulated, counted by one rule (`rsrl.evaluation.season_statistics.passes`).

    python benchmarks/passes.py 2022 2023 2024 --laps LAPS_FOLDER --facts FACTS_FOLDER

Every dry race is simulated with its season file as shipped: with the race's own stops, retirements and safety cars, and with rivals that
decide. Ratios are of means over a season's races, with Student's interval over races: races differ far more than their simulations.
"""

import argparse

import numpy as np
from season_runs import options_of, races_of, run
from season_tables import passes_table

from rsrl.errors import RsrlError
from rsrl.evaluation.backtest import replay_script
from rsrl.evaluation.backtest.shipped_races import ShippedRace
from rsrl.evaluation.season_statistics import passes, real_race_arrays, simulated_counts, spread
from rsrl.results import PassesRace, PassesRatio, PassesResult, PassesSeason, Provenance
from rsrl.simulator import Script
from rsrl.statistics import ratio_of_means

SCRIPT = "passes"
ALL = "all"


def measure(options: argparse.Namespace, about: Provenance) -> PassesResult:
    """The dry races of the seasons, race by race and season by season."""
    found = [of_race(race, options.races, options.seed) for race in races_of(options) if not race.record.wet]
    if not found:
        raise RsrlError("no dry race among those asked for; name another")
    seasons = [over(str(s), [r for r in found if r.season == s]) for s in sorted({r.season for r in found})]
    seasons += [over(ALL, found)] if len(seasons) > 1 else []
    return PassesResult(options.races, tuple(seasons), tuple(found), about)


def of_race(race: ShippedRace, races: int, seed: int) -> PassesRace:
    """Real and simulated passes of one race."""
    scripts = (replay_script(race.laps, race.facts), None)
    (replayed, replayed_se), (decided, decided_se) = (_simulated(race, script, races, seed) for script in scripts)
    real = float(passes(real_race_arrays(race.laps, race.facts)))
    return PassesRace(race.record.name, race.record.season, real, replayed, replayed_se, decided, decided_se)


def _simulated(race: ShippedRace, script: Script | None, races: int, seed: int) -> tuple[float, float]:
    mean, error, _, _ = spread(simulated_counts(race.record, races, seed, script))["passes"]
    return mean, error


def over(season: str, races: list[PassesRace]) -> PassesSeason:
    """Means over races, and ratios of simulated to real ones."""
    real, replayed, decided = ([getattr(r, name) for r in races] for name in ("real", "real_stops", "rivals_decide"))
    return PassesSeason(season, len(races), float(np.mean(real)), _ratio(replayed, real), _ratio(decided, real))


def _ratio(simulated: list[float], real: list[float]) -> PassesRatio:
    estimate = ratio_of_means(simulated, real)
    return PassesRatio(float(np.mean(simulated)), estimate.value, estimate.ci95)


if __name__ == "__main__":
    raise SystemExit(run(SCRIPT, options_of(SCRIPT, __doc__, 48), measure, passes_table))
