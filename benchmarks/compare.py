"""Two revisions side by side, in one run: what each computes a second on one core, and the ratios.

    python benchmarks/compare.py OLD NEW [--rounds 9] [--race bahrain-2023] [--only NAME ...] [--out FILE]

OLD and NEW are anything git can name, or the folder of a checkout; `.` is the working tree as it stands. Each runs its own code in a
process of its own, in this Python environment, and measures each figure in turn, OLD NEW OLD NEW ..., so that a drift of the machine's
speed meets both. Times are the CPU time of the process; printed are medians over rounds, and of the ratio within a round.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
FIGURES = {
    "races": "races simulated",
    "steps": "environment steps, 256 races side by side",
    "steps-alone": "environment steps, one race",
    "branches": "branches in training",
    "calls": "calls of a policy, one race",
    "planner": "decisions of the planner",
    "search": "rollouts under a policy",
    "what-if": "what-if lanes",
}
WORKER = """
import sys, time
import numpy as np
from rsrl.agents import load_agent
from rsrl.environment import RaceEnvironment
from rsrl.explanation import load_explained, reach
from rsrl.explanation.what_if import Continuation, Option
from rsrl.rollouts import Branching, BranchingRaces, PaceFilter
from rsrl.season import load_race
from rsrl.simulator import compile_figures, simulate
from rsrl.strategists import PlannerStrategist, find_model, make_strategist

RACE = 1  # of seed 0, the first that is measured
record, number = load_race(sys.argv[1]), np.array([RACE])
car, agent = record.car_index(record.default_driver), load_agent(find_model("all"))[0]

def stepped(batch, laps=None):
    environment = RaceEnvironment(record, car, batch=batch)
    races = RACE + np.arange(batch, dtype=np.int64)
    calls = np.zeros((record.laps, batch), np.int8)
    calls[record.laps // 3] = calls[2 * record.laps // 3] = 3
    def run():
        environment.reset(0, races)
        for row in calls[:laps]:
            environment.step(row)
        return batch * len(calls[:laps])
    return environment, run

def branches():
    settings = Branching(
        decisions=6, most=0.8, least=0.2, scale=0.5, all_calls=0.4, plan_share=0.3, pit_chance=0.05, delay_chance=0.3)
    races = BranchingRaces([(record, car)])
    return lambda: int(np.isfinite(races.branch(agent.params, settings, 0, 0, 24).positions).sum())

def calls():
    environment, drive = stepped(1, 10)
    drive()
    features, memory = environment.encoder(environment.raw), agent.initial_memory(1)
    def run():
        for _ in range(500):
            agent.act(features, environment.legal, memory)
        return 500
    return run

def planner():
    environment, drive = stepped(1, 10)
    strategist = PlannerStrategist(record, car, 0)
    environment.reset(0, number)
    strategist.begin(environment, 0, number)
    drive()
    def run():
        for _ in range(10):
            strategist.decide(environment)
        return 10
    return run

def search():
    environment, drive = stepped(1, 10)
    drive()
    rollouts, b = make_strategist("search", record, car).rollouts(), environment.races
    belief, legal = PaceFilter(compile_figures(record), 1).belief[0], np.flatnonzero(environment.legal[0])
    def run():
        rollouts.run((b.f[0], b.k[0], b.r[0]), belief, legal, seed=4, first=0, futures=96)
        return 96 * len(legal)
    return run

def what_if():
    policy = load_explained("all")
    continuation = Continuation(policy, [reach(policy.strategist(record), record, car, 12, race=RACE)])
    options = (Option(0, 0), Option(0, 2), Option(0, 3), Option(2, 3), Option(4, 3))
    def run():
        continuation.run(options, 96, 0, threads=1)
        return 96 * len(options)
    return run

def races():
    def run():
        simulate(record, 1000, 0, threads=1)
        return 1000
    return run

MAKE = {"races": races, "steps": lambda: stepped(256)[1], "steps-alone": lambda: stepped(1)[1], "branches": branches, "calls": calls,
        "planner": planner, "search": search, "what-if": what_if}
runs = {name: MAKE[name]() for name in sys.argv[2:]}
for run in runs.values():
    run()  # compiles
print("ready", flush=True)
for line in sys.stdin:
    begun = time.process_time()
    done = runs[line.strip()]()
    print(done / (time.process_time() - begun), flush=True)
"""


def checkout(revision: str, folder: Path) -> Path:
    """Sources of a revision: the working tree for `.`, a folder as it is, else an archive of the revision in `folder`."""
    if revision == ".":
        return ROOT
    if Path(revision).is_dir():
        return Path(revision)
    folder.mkdir()
    archive = subprocess.run(["git", "archive", revision], cwd=ROOT, check=True, capture_output=True).stdout
    subprocess.run(["tar", "-x", "-C", str(folder)], input=archive, check=True)
    return folder


class Worker:
    """A process that runs one revision's code and measures a figure whenever it is asked to."""

    def __init__(self, source: Path, race: str, names: list[str]) -> None:
        environment = os.environ | {"PYTHONPATH": str(source / "src"), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        command = [sys.executable, "-c", WORKER, race, *names]
        self.process = subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def answer(self) -> str:
        """Next line of the process."""
        assert self.process.stdout
        line = self.process.stdout.readline().strip()
        if not line:
            raise SystemExit("a measuring process has ended early; its error stands above")
        return line

    def measure(self, name: str) -> float:
        """One measurement of a figure, a second."""
        assert self.process.stdin
        self.process.stdin.write(name + "\n")
        self.process.stdin.flush()
        return float(self.answer())

    def close(self) -> None:
        """End the process."""
        self.process.communicate()


def summary(name: str, old: list[float], new: list[float]) -> dict[str, Any]:
    """Medians of a figure, and the ratio within a round."""
    ratios = sorted(b / a for a, b in zip(old, new, strict=True))
    low, _, high = statistics.quantiles(ratios, n=4)
    return {
        "figure": name, "old": statistics.median(old), "new": statistics.median(new), "ratio": statistics.median(ratios),
        "ratio_quartiles": [low, high],
    }  # fmt: skip


def main() -> int:
    """Measure both, print medians and ratios; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--race", default="bahrain-2023")
    parser.add_argument("--only", nargs="+", choices=list(FIGURES), default=list(FIGURES))
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    if options.rounds < 2:
        parser.error("--rounds: 2 at least")
    names = (options.old, options.new)
    with tempfile.TemporaryDirectory() as folder:
        sources = [checkout(name, Path(folder) / str(i)) for i, name in enumerate(names)]
        workers = [Worker(source, options.race, options.only) for source in sources]
        for worker in workers:
            worker.answer()
        rows = []
        for figure in options.only:
            values = [[worker.measure(figure) for worker in workers] for _ in range(options.rounds)]
            rows.append(summary(figure, *(list(side) for side in zip(*values, strict=True))))
            row = rows[-1]
            print(f"{FIGURES[figure] + ' a second':52} {row['old']:12,.1f} {row['new']:12,.1f}   new/old {row['ratio']:.3f}", flush=True)
        for worker in workers:
            worker.close()
    if options.out:
        import msgspec

        from rsrl.cli.provenance import provenance

        content = {"old": names[0], "new": names[1], "race": options.race, "rounds": options.rounds, "rows": rows}
        options.out.write_text(json.dumps(content | {"provenance": msgspec.to_builtins(provenance(0))}, indent=2) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
