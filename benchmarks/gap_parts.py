"""What the gap from fixed strategies to hindsight is made of: how much of it knowing only when the safety cars come would close.

    python benchmarks/gap_parts.py [--race bahrain-2023] [--races 384] [--seed 5] [--out benchmarks/results/gap-parts.json]

For each race the best plan on average over OTHER luck (form, noise, slow stops, retirements, rivals' calls), but with this race's own
safety cars, is looked for and then driven on the race itself: `known safety cars`. What hindsight has beyond it is luck nobody can know,
and a pick among a thousand plans by that luck; a strategist that reacts to traffic may still win some of that part.
"""

import argparse
import shlex
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rsrl.agents import load_agent
from rsrl.cli.files import write_json
from rsrl.cli.provenance import provenance
from rsrl.environment import RaceEnvironment
from rsrl.evaluation import RaceLog, gap_closed, run_races
from rsrl.results import GapPart, GapParts
from rsrl.season import GREEN, RaceRecord, find_car, load_race
from rsrl.simulator import Figures, Plan, RaceBatch, simulate_plans
from rsrl.simulator import layout as at
from rsrl.strategists import CleanAir, PlannedStrategist, PolicyStrategist, find_model, make_strategist
from rsrl.strategists.interface import column
from rsrl.strategists.plan_search.neighbours import grid_of_plans
from rsrl.strategists.plan_search.plan_table import PlanTable

OTHER_LUCK = 2**41
"""Seed of the luck that plans are chosen by: no race anything is evaluated on."""

ROUNDS = ((24, 60), (96, 16), (300, 1))
"""Races of other luck, and how many plans stay."""

PARENTS = 5
NAMES = ("fixed", "heuristic", "dp", "best-plan-sc", "hindsight")


class KnownSafetyCars(PlannedStrategist):
    """Drives each race to the plan that is best on average for that race's safety cars."""

    def __init__(self, record: RaceRecord, car: int) -> None:
        super().__init__("known safety cars")
        self._record, self._car, self._clean_air = record, car, CleanAir(record, car)
        self._found: dict[tuple[int, bytes], Plan] = {}

    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        status = statuses(environment, seed, races)
        starts = column(environment, "tyre").astype(int).tolist()
        plans = []
        for start, row in zip(starts, status, strict=True):
            key = (start, row.tobytes())
            if key not in self._found:
                self._found[key] = self._search(environment.races.figures, start, row)
            plans.append(self._found[key])
        self.assign(plans, np.arange(len(plans)))

    def _search(self, figures: Figures, start: int, status: NDArray[np.int8]) -> Plan:
        # the statuses are given, retirements and everything else are still drawn
        known = figures._replace(script_status=np.concatenate([np.zeros(1, np.int8), status]))
        slow_laps = [int(lap) + 1 for lap in np.flatnonzero(status != GREEN)]
        table = PlanTable(self._record, self._car)
        numbers = table.add(grid_of_plans(self._clean_air.families((start,)), 10.0, 150))
        first, _ = ROUNDS[0]
        ranked = self._ranked(known, table, numbers, first)[:PARENTS]
        near = [n for parent in ranked for n in (*table.neighbours(parent), *table.with_stop_on(parent, slow_laps))]
        numbers = list(dict.fromkeys([*numbers, *near]))
        for races, keep in ROUNDS:
            numbers = self._ranked(known, table, numbers, races)[:keep]
        return table[numbers[0]]

    def _ranked(self, figures: Figures, table: PlanTable, numbers: list[int], races: int) -> list[int]:
        plans = [table[n] for n in numbers]
        positions, _ = simulate_plans(figures, self._car, plans, OTHER_LUCK, np.arange(races, dtype=np.int64))
        means = positions.mean(axis=1)
        return [numbers[i] for i in np.argsort(means, kind="stable")]


def statuses(environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> NDArray[np.int8]:
    """Track status of each lap of each race, int8 [races, laps]: the same whatever anyone does."""
    batch = RaceBatch(environment.races.figures, len(races))
    batch.start(seed, races)
    status = np.zeros((len(races), environment.laps), np.int8)
    for lap in range(environment.laps):
        status[:, lap] = batch.r[:, at.R_STATUS]
        batch.advance()
    return status


def main() -> None:
    """Call the races by everybody and print the shares."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--race", default="bahrain-2023")
    parser.add_argument("--races", type=int, default=384)
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    record = load_race(options.race)
    car = find_car(record, None)
    strategists = [make_strategist(name, record, car) for name in NAMES]
    strategists.append(KnownSafetyCars(record, car))
    if options.race == "bahrain-2023":
        strategists.append(PolicyStrategist(load_agent(find_model(options.race))[0], record, "rsrl"))
    logs: dict[str, RaceLog] = {s.name: run_races(s, record, car, options.seed, options.races) for s in strategists}
    slow = statuses(RaceEnvironment(record, car), options.seed, logs["fixed"].races).any(axis=1)
    rows = [
        GapPart(
            strategist=name,
            mean_position=float(logs[name].position.mean()),
            gap_closed=closed.value,
            gap_closed_ci95=closed.ci95,
            mean_position_with_slow_laps=float(logs[name].position[slow].mean()),
            mean_position_without=float(logs[name].position[~slow].mean()),
            ahead_of_hindsight=float((logs[name].position < logs["hindsight"].position).mean()),
        )
        for name, closed in gap_closed(logs).items()
    ]
    for row in sorted(rows, key=lambda row: row.mean_position):
        print(
            f"{row.strategist:18s} P{row.mean_position:.2f}  gap {100 * row.gap_closed:4.0f} %"
            f"  slow laps P{row.mean_position_with_slow_laps:.2f}, none P{row.mean_position_without:.2f}"
            f"  ahead of hindsight {100 * row.ahead_of_hindsight:.2f} %"
        )
    if options.out:
        command = shlex.join(["python", "benchmarks/gap_parts.py", *sys.argv[1:]])
        about = provenance(options.seed, command=command)
        write_json(options.out, GapParts(options.race, options.races, options.seed, float(slow.mean()), tuple(rows), about))


if __name__ == "__main__":
    main()
