"""Learning curves of the paper's agents: the runs' positions on the races they set aside, as a result file and a figure.

    python benchmarks/paper_agent_curves.py runs/drqn runs/drqn-1 ...

Every run sets races of its own seed aside, tries its averaged weights there every 1,000 races and keeps the best. `fixed` and `best-plan`
drive the same races. The figure is docs/figures/paper-agents-learning.png.
"""

import argparse
import json
import shlex
import sys
from functools import cache
from pathlib import Path
from statistics import fmean
from typing import Final

from rsrl.agents import TRAINING_SEED, load_agent
from rsrl.agents.paper_learner import FIRST_VALIDATION_RACE
from rsrl.agents.run_log import LOG_FILE
from rsrl.cli.files import write_json
from rsrl.cli.provenance import provenance
from rsrl.drawing import SERIES_COLOURS, new_figure, save_figure
from rsrl.evaluation import run_races
from rsrl.results import PaperAgentCurve, PaperAgentCurves
from rsrl.season import find_car, load_race
from rsrl.strategists import make_strategist

RACE: Final = "bahrain-2023"
REFERENCES: Final = ("fixed", "best-plan")
OUT: Final = Path("benchmarks/results/paper-agents-curves.json")
FIGURE: Final = Path("docs/figures/paper-agents-learning.png")
LEARNED: Final = 12_000
"""Races of training from which on the second panel shows the runs."""


def curve(folder: Path) -> PaperAgentCurve:
    """The trials of a run, from its log, and what the references do on the same races."""
    agent, about = load_agent(folder)
    every = int(about.config["validation_episodes"])
    rows = [json.loads(line) for line in (folder / LOG_FILE).read_text(encoding="utf-8").splitlines()]
    tried = {row["iteration"]: row["mean_validation_position"] for row in rows if row["iteration"] % every == 0}
    known = references(about.seed, int(about.config["validation_races"]))
    return PaperAgentCurve(agent.kind, about.seed, about.steps, tuple(tried), tuple(tried.values()), known)


@cache
def references(seed: int, races: int) -> dict[str, float]:
    """Mean position of each of `REFERENCES` on the races that runs of a seed set aside."""
    record = load_race(RACE)
    car = find_car(record, None)
    strategists = [make_strategist(name, record, car) for name in REFERENCES]
    logs = [run_races(one, record, car, TRAINING_SEED + seed, races, first_race=FIRST_VALIDATION_RACE) for one in strategists]
    return {log.strategist: float(log.position.mean()) for log in logs}


def draw(result: PaperAgentCurves) -> None:
    """One line a run: positions, and from when they have learned the rules on, places ahead of `fixed` on the same races."""
    figure, (left, right) = new_figure(11.0, 4.2, 2)
    agents = sorted({one.agent for one in result.curves}, reverse=True)
    for one in result.curves:
        first = one == next(other for other in result.curves if other.agent == one.agent)
        colour, fixed = SERIES_COLOURS[agents.index(one.agent)], one.references["fixed"]
        left.plot(one.races, one.mean_position, color=colour, lw=1.2, alpha=0.8, label=one.agent if first else None)
        right.plot(one.races, [fixed - position for position in one.mean_position], color=colour, lw=1.2, alpha=0.8)
    lead = fmean(one.references["fixed"] - one.references["best-plan"] for one in result.curves)
    for place, name, side in ((0.0, "fixed", "top"), (lead, "best-plan", "bottom")):
        right.axhline(place, color=SERIES_COLOURS[-1], lw=1.1, ls=(0, (4, 3)))
        right.text(LEARNED, place, f" {name}", va=side, fontsize=8, color=SERIES_COLOURS[-1])
    left.set(xlabel="races of training", ylabel="mean position on the races set aside", ylim=(20.5, 5.5), yticks=range(6, 21, 2))
    right.set(xlabel="races of training", ylabel="places ahead of fixed on the same races", xlim=(LEARNED, None), ylim=(-0.5, 0.7))
    left.legend(frameon=False)
    save_figure(figure, f"The paper's agents learn {RACE}: {len(result.curves)} training runs", FIGURE)


def main() -> None:
    """Read the runs, drive the references, write the result and the figure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path)
    options = parser.parse_args()
    curves = tuple(curve(folder) for folder in options.folders)
    command = shlex.join(["python", "benchmarks/paper_agent_curves.py", *sys.argv[1:]])
    result = PaperAgentCurves(RACE, curves, provenance(0, command=command))
    write_json(OUT, result)
    draw(result)
    for one in curves:
        best = min(one.mean_position)
        known = "  ".join(f"{name} P{position:.3f}" for name, position in one.references.items())
        print(f"{one.agent} seed {one.seed}: best P{best:.3f} after {one.races[one.mean_position.index(best)]:,} races  {known}")


if __name__ == "__main__":
    main()
