"""The compiled race against an older revision's, on one core: rivals that react and rivals with plans, measured in the same run.

    python benchmarks/engine_ratio.py [--old 93a9ca5] [--race bahrain-2023] [--rounds 40] [--out benchmarks/results/engine-ratio.json]

The working tree and an archive of OLD each run in a process of their own, round after round in turn, so that a drift of the machine's
speed meets both. Times are CPU time of the one thread that races, microseconds a race; medians over rounds and their lower quartiles.
OLD is from before rivals reacted, so its races are those with plans.
"""

import argparse
import json
import os
import shlex
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from compare import ROOT, checkout

from rsrl.cli.files import write_json
from rsrl.cli.provenance import provenance
from rsrl.results import EngineRatio

SEED, RACES = 5, 700
WORKER = """
import sys, time
import numpy as np
from rsrl.season import load_race
from rsrl.simulator import compile_figures
from rsrl.simulator import layout as at
from rsrl.simulator.race import run_races
from rsrl.simulator.results import RaceResults

CODES = {"old": -1, "plans": -1, "reactive": -3}  # RIVAL and IMITATION of layout.py, which OLD has elsewhere
figures = compile_figures(load_race(sys.argv[1]))
n, seed, modes = int(sys.argv[2]), int(sys.argv[3]), sys.argv[4:]
numbers, rows = np.arange(n, dtype=np.int64), np.zeros(n, np.int32)
results = RaceResults.empty(n).part(slice(0, n))
race = tuple(np.empty(shape, kind) for shape, kind in (
    ((at.F_ROWS, at.CARS), np.float32), ((at.K_ROWS, at.CARS), np.int32), (at.R_SIZE, np.int32)))
actions = np.zeros(at.CARS, np.int8)
if "race" in run_races.py_func.__code__.co_varnames:
    from rsrl.simulator.race_arrays import RaceArrays
    arrays = RaceArrays(*race), actions, results
else:  # older revisions take every array as an argument of its own
    arrays = *race, actions, *results

def measure(mode):
    who = np.full(20, CODES[mode], np.int32)
    begun = time.thread_time()
    run_races(figures, figures.rival_plans, seed, numbers, who, -1, rows, *arrays)
    return (time.thread_time() - begun) / n * 1e6

for mode in modes:
    measure(mode)  # compiles
for _ in sys.stdin:
    print(*(measure(mode) for mode in modes), flush=True)
"""


class Worker:
    """A process that races one revision's code whenever it is asked to."""

    def __init__(self, source: Path, race: str, modes: tuple[str, ...]) -> None:
        self.modes = modes
        command = [sys.executable, "-c", WORKER, race, str(RACES), str(SEED), *modes]
        environment = os.environ | {"PYTHONPATH": str(source / "src")}
        self.process = subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def measure(self) -> dict[str, float]:
        """Microseconds a race of each mode, once."""
        assert self.process.stdin
        assert self.process.stdout
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        values = self.process.stdout.readline().split()
        if len(values) != len(self.modes):
            raise SystemExit("a measuring process has ended early; its error stands above")
        return dict(zip(self.modes, map(float, values), strict=True))

    def close(self) -> None:
        """End the process."""
        self.process.communicate()


def rounds_of(workers: list[Worker], rounds: int) -> list[dict[str, float]]:
    """One measurement of every mode a round; the first round, which waits for the compiler, is left out."""
    taken = [{k: v for worker in workers for k, v in worker.measure().items()} for _ in range(rounds + 1)]
    for worker in workers:
        worker.close()
    return taken[1:]


def summary(rounds: list[dict[str, float]]) -> dict[str, Any]:
    """Medians and lower quartiles of the times, and of the ratio to the old revision within a round."""
    modes = list(rounds[0])
    times = {m: [taken[m] for taken in rounds] for m in modes}
    ratios = {m: [taken[m] / taken["old"] for taken in rounds] for m in modes if m != "old"}
    return {
        "us_per_race": {m: round(statistics.median(v), 2) for m, v in times.items()},
        "us_per_race_lower_quartile": {m: round(statistics.quantiles(v, n=4)[0], 2) for m, v in times.items()},
        "time_ratio_to_old": {m: round(statistics.median(v), 3) for m, v in ratios.items()},
    }


def main() -> int:
    """Measure, print and write; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--old", default="93a9ca5")
    parser.add_argument("--race", default="bahrain-2023")
    parser.add_argument("--rounds", type=int, default=40)
    parser.add_argument("--out", type=Path, default=ROOT / "benchmarks" / "results" / "engine-ratio.json")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        old = checkout(options.old, Path(folder) / "old")
        workers = [Worker(ROOT, options.race, ("reactive", "plans")), Worker(old, options.race, ("old",))]
        figures = summary(rounds_of(workers, options.rounds))
    new = subprocess.run(["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, check=True, capture_output=True, text=True).stdout.strip()
    about = provenance(SEED, command=shlex.join(["python", "benchmarks/engine_ratio.py", *sys.argv[1:]]))
    result = EngineRatio(
        race=options.race, old=options.old, new=new, rounds=options.rounds, races_a_round=RACES, **figures, provenance=about
    )
    write_json(options.out, result)
    print(json.dumps(figures, indent=2))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
