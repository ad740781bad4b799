"""What the paper leaves open, tried one at a time on the paper's agents: positions on races set aside, as training goes on.

    python benchmarks/paper_agents.py [--agent drqn] [--trials "as shipped,replay of 50 races"] [--races 14000] [--seed 0] [--out FILE]

Every trial trains anew with one setting changed and notes the mean position of its averaged weights on the validation races of that seed,
on which `fixed` and `best-plan` drive too. One seed each: differences below a tenth of a place say nothing. Without --trials, all are made.
The file is written after each trial.
"""

import argparse
import shlex
import sys
import time
from pathlib import Path
from typing import Any, Final

from rsrl.agents import TRAINING_SEED, LearnerConfig, PaperConfig, changed, default_config, make_learner
from rsrl.agents.paper_learner import FIRST_VALIDATION_RACE
from rsrl.cli.entries import environment_factory, read_entries
from rsrl.cli.files import write_json
from rsrl.cli.provenance import provenance
from rsrl.evaluation import run_races
from rsrl.results import PaperAgents, PaperAgentTrial
from rsrl.strategists import make_strategist

RACE: Final = "bahrain-2023"
REFERENCES: Final = ("fixed", "best-plan")
TRIALS: Final[dict[str, dict[str, Any]]] = {
    "as shipped": {},
    "replay of 50 races": {"replay_episodes": 50},
    "rewards not scaled": {"reward_scale": 1.0},
    "half the gradient steps": {"update_laps": 80},
    "twice the gradient steps": {"update_laps": 20},
    "weights not averaged": {"average_steps": 1},
    "128 units": {"width": 128},
}
"""Settings changed, by name of the trial. Gradient steps of the DRQN."""


def trial(name: str, config: PaperConfig, races: int, seed: int) -> PaperAgentTrial:
    """Train with these settings; positions on the validation races every `validation_episodes` races."""
    learner: Any = make_learner(config, environment_factory(read_entries(RACE, None))(config), seed)
    began, tried = time.process_time(), {}
    while learner.iteration < races:
        metrics = learner.advance(0.0)
        if learner.iteration % config.validation_episodes == 0:
            tried[learner.iteration] = metrics["mean_validation_position"]
            print(f"{name:26s} {learner.iteration:7,d} races  P{tried[learner.iteration]:.3f}", flush=True)
    return PaperAgentTrial(
        agent=config.kind,
        trial=name,
        seed=seed,
        cpu_s=round(time.process_time() - began, 1),
        gradient_steps=learner.updates,
        races=tuple(tried),
        mean_position=tuple(tried.values()),
    )


def references(config: PaperConfig, seed: int) -> dict[str, float]:
    """Mean positions of `REFERENCES` on the validation races of a seed."""
    entries = read_entries(RACE, None)
    record, car = entries.pairs[0]
    makers = {name: make_strategist(name, record, car) for name in REFERENCES}
    logs = {
        n: run_races(s, record, car, TRAINING_SEED + seed, config.validation_races, first_race=FIRST_VALIDATION_RACE)
        for n, s in makers.items()
    }
    return {name: float(log.position.mean()) for name, log in logs.items()}


def paper_config(agent: str, changes: dict[str, Any]) -> PaperConfig:
    """Default settings of an agent of the paper with some changed."""
    config: LearnerConfig = changed(default_config(agent), **changes)
    assert isinstance(config, PaperConfig)
    return config


def main() -> None:
    """Make the trials and write their results."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--agent", choices=("dqn", "drqn"), default="drqn")
    parser.add_argument("--trials", default=",".join(TRIALS))
    parser.add_argument("--races", type=int, default=14_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    names = options.trials.split(",")
    if unknown := [name for name in names if name not in TRIALS]:
        parser.error(f"no trial {unknown[0]!r}; there are {', '.join(TRIALS)}")
    known = references(paper_config(options.agent, {}), options.seed)
    print("  ".join(f"{name} P{position:.3f}" for name, position in known.items()), flush=True)
    command = shlex.join(["python", "benchmarks/paper_agents.py", *sys.argv[1:]])
    rows: list[PaperAgentTrial] = []
    for name in names:
        rows.append(trial(name, paper_config(options.agent, TRIALS[name]), options.races, options.seed))
        if options.out:
            write_json(options.out, PaperAgents(RACE, known, tuple(rows), provenance(options.seed, command=command)))


if __name__ == "__main__":
    main()
