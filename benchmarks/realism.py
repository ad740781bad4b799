"""The simulated race beside the real one: `docs/realism.md`'s table and plot, and their figures as JSON.

python benchmarks/realism.py bahrain-2023 --laps LAPS_FOLDER
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from rsrl.cli.provenance import provenance
from rsrl.errors import RsrlError
from rsrl.evaluation.realism import RealRace, compare, plot_traces, real_race
from rsrl.laps import read_seasons
from rsrl.season import RaceRecord, load_race
from rsrl.simulator import CarSummary, RaceResults, simulate, summarise, trace_races


def car_row(record: RaceRecord, real: RealRace, results: RaceResults, i: int, summary: CarSummary) -> dict[str, Any]:
    """One car, real and simulated."""
    return {
        "driver": summary.driver,
        "grid": summary.grid,
        "real": int(real.place[i]),
        "mean_position": summary.mean_position,
        "range": [int(q) for q in np.percentile(results.positions[:, i], (10, 90))],
        "real_stops": int(real.stops[i]),
        "mean_stops": summary.mean_stops,
        "p_retired": summary.p_retired,
        "real_laps": int(real.laps_done[i]),
    }


def main() -> int:
    """Compare and write; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("race")
    parser.add_argument("--laps", type=Path, required=True)
    parser.add_argument("--races", type=int, default=4000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("docs/figures"))
    options = parser.parse_args()
    try:
        record = load_race(options.race)
        real = real_race(read_seasons(options.laps, (record.season,)), record)
        results = simulate(record, options.races, options.seed)
        trace = trace_races(record, 200, options.seed)
        rows = compare(record, real, results, trace)
        shown = plot_traces(record, real, trace, options.out / f"trace-{record.name}.png")
    except RsrlError as error:
        print(f"realism: {error}", file=sys.stderr)
        return 2
    cars = [car_row(record, real, results, i, summary) for i, summary in enumerate(summarise(record, results))]
    miss = float(np.mean([abs(c["mean_position"] - c["real"]) for c in cars]))
    grid = float(np.mean([abs(c["grid"] - c["real"]) for c in cars]))
    for name, was, simulated in rows:
        print(f"| {name} | {was} | {simulated} |")
    for c in cars:
        positions = f"{c['mean_position']:.1f} ({c['range'][0]} to {c['range'][1]})"
        print(f"| {c['driver']} | {c['grid']} | {c['real']} | {positions} | {c['real_stops']} | {c['mean_stops']:.1f} |")
    print(f"mean |simulated mean position - real| {miss:.2f}; grid {grid:.2f}; simulated race drawn: {shown}")
    where = {
        **provenance(options.seed),
        "command": f"python benchmarks/realism.py {record.name} --laps LAPS_FOLDER --races {options.races} --seed {options.seed}",
    }
    target = Path("benchmarks/results") / f"realism-{record.name}.json"
    target.parent.mkdir(exist_ok=True)
    result = {"rows": rows, "cars": cars, "mae_position": miss, "mae_grid": grid, "race_drawn": shown, "provenance": where}
    target.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
