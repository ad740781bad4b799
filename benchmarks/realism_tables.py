"""Comparisons of docs/realism.md that are between result files: forecast against regression, ablations, what an oracle of stops would have.

python benchmarks/realism_tables.py

Reads benchmarks/results/backtest-*.json, which `benchmarks/backtest.sh` makes; intervals are 95 %, by a bootstrap over dry races.
"""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rsrl.evaluation.backtest import ABLATIONS
from rsrl.evaluation.backtest.scores import MEASURES, differences
from rsrl.results import BacktestRace, BacktestResult, Measures, read_result

RESULTS = Path("benchmarks/results")
SHOWN = ("mae_position", "mae_rank_classified", "spearman", "brier_points", "logloss_winner", "mae_green_lap_s", "mae_lap_position")


def dry_races(name: str) -> list[BacktestRace]:
    """The dry races of a result file."""
    result = read_result(RESULTS / f"backtest-{name}.json", BacktestResult, "benchmarks/backtest.sh")
    return [race for race in result.races if not race.wet]


def measures(scores: Sequence[Measures]) -> list[dict[str, float]]:
    """Measures by name, NaN where a predictor says nothing."""
    values = [{name: getattr(one, name) for name in MEASURES} for one in scores]
    return [{name: math.nan if value is None else value for name, value in one.items()} for one in values]


def show(name: str, races: Sequence[Measures], base: Sequence[Measures]) -> None:
    """One line: each measure less the base's, with its interval."""
    gaps = differences(measures(races), measures(base))
    cells = [f"{m} {gaps[m].mean:+.3f} [{gaps[m].low:+.3f}, {gaps[m].high:+.3f}]" for m in SHOWN if m in gaps]
    print(f"{name}: " + "; ".join(cells))


def show_stop_oracle(name: str) -> None:
    """Errors of one who knew every race's own mean of stops and median first stop, and what the forecast and the races had on average."""
    rows = []
    for race in dry_races(name):
        cars = [c for c in race.cars if c.stops is not None and c.stops_predicted is not None]
        stops, said = (np.array([getattr(c, k) for c in cars]) for k in ("stops", "stops_predicted"))
        first = np.array([c.first_stop for c in race.cars if c.first_stop is not None])
        within = np.mean(np.abs(first - np.median(first)) <= 3)
        rows.append((np.abs(stops - stops.mean()).mean(), within, stops.mean(), said.mean()))
    error, within, real, predicted = np.mean(rows, axis=0)
    print(f"{name}, oracle: stops error {error:.2f}, first stops within 3 laps {within:.0%}; real {real:.2f}, forecast {predicted:.2f}")


def main() -> int:
    """Print everything; returns the exit code."""
    for season in (2023, 2024):
        forecast = dry_races(f"{season}-forecast")
        show(f"{season} forecast less regression", forecast, [race.regression for race in forecast])
        show_stop_oracle(f"{season}-forecast")
    for mode in ("replay", "hindsight"):
        whole = dry_races(f"2024-{mode}")
        for part in ABLATIONS:
            show(f"2024 {mode} without {part} less the whole", dry_races(f"2024-{mode}-without-{part}"), whole)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
