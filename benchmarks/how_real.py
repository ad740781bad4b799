"""Pictures and tables of docs/realism.md from the backtest's result files, and race traces of three races.

python benchmarks/how_real.py --laps LAPS_FOLDER --facts FACTS_FOLDER

Reads benchmarks/results/backtest-2024-{forecast,replay,hindsight}.json, which `benchmarks/backtest.sh` makes.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rsrl.drawing import TracePanel, plot_race_trace
from rsrl.errors import RsrlError
from rsrl.evaluation.backtest import MODES, prepare_race, race_times_s, read_season, replay_script
from rsrl.evaluation.backtest.plots import plot_errors, plot_positions, plot_reliability, plot_stops
from rsrl.results import BacktestRace, BacktestResult, plain, read_result
from rsrl.simulator import trace_races

RESULTS = Path("benchmarks/results")
FIGURES = Path("docs/figures")


def load(mode: str) -> BacktestResult:
    """A result file of the backtest."""
    return read_result(RESULTS / f"backtest-2024-{mode}.json", BacktestResult, "benchmarks/backtest.sh")


def three_races(races: Sequence[BacktestRace]) -> list[str]:
    """The dry races with the least, the median and the largest error of the forecast."""
    dry = sorted((r for r in races if not r.wet), key=lambda r: (r.mae_position, r.race))
    return [dry[0].race, dry[len(dry) // 2].race, dry[-1].race]


def draw_traces(names: list[str], laps: Path, facts: Path, fit: tuple[int, ...], test: int) -> None:
    """Each race as it was beside the first race simulated from what was known before it."""
    season = read_season(laps, facts, fit, test)
    for index in season.test_indices:
        if season.name(index) not in names:
            continue
        record, _ = prepare_race(season, index, "forecast")
        trace = trace_races(record, 1, 0)
        cars = len(record.cars)
        simulated = np.where(trace.running[0, :, :cars], trace.race_time_s[0, :, :cars], np.nan)
        real = race_times_s(season.laps_of(index), season.book.races[index].facts)
        drivers, teams = [car.driver for car in record.cars], [car.team for car in record.cars]
        status = np.array(replay_script(season.laps_of(index), season.book.races[index].facts).status)
        panels = [
            TracePanel("as it was", drivers, teams, real, status),
            TracePanel("one simulated race", drivers, teams, simulated, trace.track_status[0].astype(np.int64)),
        ]
        plot_race_trace(panels, f"{record.event} {record.season}", FIGURES / f"trace-{record.name}.png")


def main() -> int:
    """Draw everything; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--laps", type=Path, required=True)
    parser.add_argument("--facts", type=Path, required=True)
    options = parser.parse_args()
    try:
        results = {mode: load(mode) for mode in MODES}
        dry = {mode: [plain(r) for r in result.races if not r.wet] for mode, result in results.items()}
        forecast = results["forecast"]
        plot_reliability(dry["forecast"], "Forecast of 2024's dry races: are stated chances kept?", FIGURES / "backtest-reliability.png")
        plot_positions(dry["forecast"], "Forecast of 2024's dry races", FIGURES / "backtest-positions.png")
        plot_stops(dry["forecast"], "Forecast of 2024's dry races: stops", FIGURES / "backtest-stops.png")
        plot_errors(dry, "Error by race, 2024", FIGURES / "backtest-errors.png")
        draw_traces(three_races(forecast.races), options.laps, options.facts, forecast.fit, forecast.test)
    except RsrlError as error:
        print(f"how_real: {error}", file=sys.stderr)
        return 2
    print("drawn:", ", ".join(three_races(forecast.races)))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
