"""A simulated season beside the real one: stops, safety cars, passes and retirements by track, with intervals.

python benchmarks/season_table.py 2023 --laps LAPS_FOLDER --facts FACTS_FOLDER [--replay]
"""

import argparse
import sys
from pathlib import Path

import numpy as np
import polars as pl

from rsrl.calibration import race_facts
from rsrl.cli.files import write_json
from rsrl.cli.provenance import provenance
from rsrl.errors import RsrlError
from rsrl.evaluation.backtest import replay_script
from rsrl.evaluation.season_statistics import STATISTICS, count, real_race_arrays, simulated_counts, spread
from rsrl.laps import read_seasons
from rsrl.results import SeasonRow, SeasonTable
from rsrl.season import load_race, race_names
from rsrl.statistics import bootstrap_over_races


def main() -> int:
    """Simulate every dry race of the season's files and count; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("season", type=int)
    parser.add_argument("--laps", type=Path, required=True)
    parser.add_argument("--facts", type=Path, required=True)
    parser.add_argument("--races", type=int, default=400)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--replay", action="store_true", help="with the race's own stops, retirements and safety cars")
    options = parser.parse_args()
    try:
        rows = season_rows(options)
    except RsrlError as error:
        print(f"season_table: {error}", file=sys.stderr)
        return 2
    command = f"python benchmarks/season_table.py {options.season} --laps LAPS_FOLDER --facts FACTS_FOLDER --races {options.races}"
    command += " --replay" if options.replay else ""
    result = SeasonTable(options.season, tuple(rows), provenance(options.seed, command=command))
    name = f"season-{options.season}-replay.json" if options.replay else f"season-{options.season}.json"
    write_json(Path("benchmarks/results") / name, result)
    print_table(rows)
    return 0


def season_rows(options: argparse.Namespace) -> list[SeasonRow]:
    """One row per dry race: real counts, simulated means, standard errors and 90 % range of one race."""
    laps = read_seasons(options.laps, (options.season,))
    rows: list[SeasonRow] = []
    for name in race_names():
        if not name.endswith(str(options.season)):
            continue
        record = load_race(name)
        if record.wet:
            continue
        race = laps.filter(pl.col("round") == record.round)
        facts = race_facts(race, options.facts, record.season, record.round)
        real = count(real_race_arrays(race, facts))
        script = replay_script(race, facts) if options.replay else None
        rows.append(SeasonRow(name, real, spread(simulated_counts(record, options.races, options.seed, script))))
        print(f"{name} ...", file=sys.stderr)
    return rows


def print_table(rows: list[SeasonRow]) -> None:
    """Markdown: real, then simulated mean and 90 % range of one race; last the mean over the races with its interval."""
    print("| race | " + " | ".join(STATISTICS) + " |")
    print("|---|" + "---|" * len(STATISTICS))
    for row in rows:
        real, simulated = row.real, row.simulated
        cells = [_cell(real[n], *simulated[n]) for n in STATISTICS]
        print(f"| {row.race} | " + " | ".join(cells) + " |")
    cells = []
    for name in STATISTICS:
        observed = np.array([row.real[name] for row in rows])
        means = np.array([row.simulated[name][0] for row in rows])
        low, high = bootstrap_over_races(means - observed, np.nanmean, resamples=4000)
        cells.append(f"{np.nanmean(observed):.2f} / {means.mean():.2f}, {np.nanmean(means - observed):+.2f} [{low:+.2f}, {high:+.2f}]")
    print("| mean, real / simulated, difference | " + " | ".join(cells) + " |")


def _cell(real: float, mean: float, _se: float, low: float, high: float) -> str:
    return f"{real:.2f} / {mean:.2f} ({low:.2f} to {high:.2f})"


if __name__ == "__main__":
    raise SystemExit(main())
