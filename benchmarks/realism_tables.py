"""Comparisons of docs/realism.md that are between result files: forecast against regression, ablations, what an oracle of stops would have.

python benchmarks/realism_tables.py

Reads benchmarks/results/backtest-*.json, which `benchmarks/backtest.sh` makes; intervals are 95 % of a bootstrap over dry races.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from rsrl.evaluation.backtest import ABLATIONS
from rsrl.evaluation.backtest.scores import differences

RESULTS = Path("benchmarks/results")
SHOWN = ("mae_position", "mae_rank_classified", "spearman", "brier_points", "logloss_winner", "mae_green_lap_s", "mae_lap_position")


def dry_races(name: str) -> list[dict[str, Any]]:
    """The dry races of a result file, null as nan."""
    races = json.loads((RESULTS / f"backtest-{name}.json").read_text(encoding="utf-8"))["races"]
    return [_with_nan(race) for race in races if not race["wet"]]


def _with_nan(item: dict[str, Any]) -> dict[str, Any]:
    filled = {key: _with_nan(value) if isinstance(value, dict) else value for key, value in item.items()}
    return {key: float("nan") if value is None else value for key, value in filled.items()}


def show(name: str, races: list[dict[str, Any]], base: list[dict[str, Any]]) -> None:
    """One line: each measure less the base's, with its interval."""
    gaps = differences(races, base)
    cells = [f"{m} {gaps[m]['mean']:+.3f} [{gaps[m]['low']:+.3f}, {gaps[m]['high']:+.3f}]" for m in SHOWN if m in gaps]
    print(f"{name}: " + "; ".join(cells))


def show_stop_oracle(name: str) -> None:
    """Errors of one who knew every race's own mean of stops and median first stop, and what the forecast and the races had on average."""
    rows = []
    for race in dry_races(name):
        cars = [c for c in race["cars"] if c["stops"] is not None and c["stops_predicted"] is not None]
        stops, said = (np.array([c[k] for c in cars]) for k in ("stops", "stops_predicted"))
        first = np.array([c["first_stop"] for c in race["cars"] if c["first_stop"] is not None])
        within = np.mean(np.abs(first - np.median(first)) <= 3)
        rows.append((np.abs(stops - stops.mean()).mean(), within, stops.mean(), said.mean()))
    error, within, real, predicted = np.mean(rows, axis=0)
    print(f"{name}, oracle: stops error {error:.2f}, first stops within 3 laps {within:.0%}; real {real:.2f}, forecast {predicted:.2f}")


def main() -> int:
    """Print everything; returns the exit code."""
    for season in (2023, 2024):
        forecast = dry_races(f"{season}-forecast")
        show(f"{season} forecast less regression", forecast, [race["regression"] for race in forecast])
        show_stop_oracle(f"{season}-forecast")
    for mode in ("replay", "hindsight"):
        whole = dry_races(f"2024-{mode}")
        for part in ABLATIONS:
            show(f"2024 {mode} without {part} less the whole", dry_races(f"2024-{mode}-without-{part}"), whole)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
