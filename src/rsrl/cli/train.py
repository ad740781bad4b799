"""`rsrl train`: trains an agent to call races."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rsrl.cli.entries import Entries, environment_factory, read_entries
from rsrl.cli.options import ForceOption, JsonOption, SetOption, SetsOption
from rsrl.cli.output import Output, table
from rsrl.cli.progress import Report, progress
from rsrl.cli.provenance import command_line, provenance
from rsrl.errors import RsrlError

if TYPE_CHECKING:
    from rsrl.agents import Budget, LearnerConfig, Progress, TrainingResult

RacesArgument = Annotated[
    str,
    typer.Argument(
        metavar="RACES",
        help="A race such as bahrain-2023, a season file, several of them separated by commas, or a group: rsrl-1, rsrl-2, rsrl-9, all.",
    ),
]
CarsOption = Annotated[
    str | None,
    typer.Option(
        "--driver",
        metavar="NAME",
        help="The driver to train for, by code, number or surname, or all. Default: that of the race, or all of several races.",
    ),
]
FeaturesOption = Annotated[
    str | None,
    typer.Option(
        "--features",
        metavar="SET",
        help="For the agent rsrl: full (a track is described by its figures) or named (by its name, as in the paper).",
    ),
]

GoalOption = Annotated[
    str | None,
    typer.Option(
        "--goal",
        metavar="GOAL",
        help="For the agent rsrl, what is to be as good as it can be in the mean: position, points or paper-reward. Default: position.",
    ),
]
AgentOption = Annotated[str, typer.Option("--agent", metavar="NAME", help="rsrl, or one of the paper's agents, dqn and drqn.")]
SecondsOption = Annotated[float | None, typer.Option("--seconds", metavar="S", help="Training time. Default: 60.")]
IterationsOption = Annotated[
    int | None,
    typer.Option(
        "--iterations",
        metavar="N",
        help="Instead of --seconds: iterations of rsrl, or races of dqn and drqn, rounded up to fifties. Such a run repeats bit for bit.",
    ),
]
TrainingSeedOption = Annotated[
    int, typer.Option("--seed", metavar="N", min=0, max=100_000, help="Seed of the training run: initial weights, exploration and races.")
]
OutOption = Annotated[Path, typer.Option("--out", metavar="FOLDER", help="Folder for the model, its log and its checkpoints.")]
ResumeOption = Annotated[bool, typer.Option("--resume", help="Continue the interrupted run in --out with its own settings.")]


def command(
    races: RacesArgument,
    out: OutOption,
    driver: CarsOption = None,
    agent: AgentOption = "rsrl",
    features: FeaturesOption = None,
    goal: GoalOption = None,
    seconds: SecondsOption = None,
    iterations: IterationsOption = None,
    seed: TrainingSeedOption = 0,
    changes: SetOption = None,
    sets: SetsOption = None,
    resume: ResumeOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Train an agent to call races.

    The agent rsrl starts from the calls with the least expected race time,
    those of the strategist dp, and learns to improve on them. The paper's
    agents, dqn and drqn, start from random weights.

    The folder --out receives the model (model.safetensors, model.json), its
    learning curve (log.jsonl) and the state that --resume continues from.
    They are written at the start and every 15 s, so that a run that was
    killed can be resumed. Ctrl-C stops training and keeps the model so far.
    Training seeds start at a million, so no training race is a race of an
    evaluation.

    With several races, every car is trained for, and for each batch the
    figures of the races are drawn anew within their standard errors.

    [bold]Examples[/bold]

    rsrl train bahrain-2023 --seconds 60 --out runs/ham
    rsrl train all --iterations 2000 --out runs/all
    rsrl train bahrain-2023 --agent drqn --iterations 50000 --out runs/drqn
    rsrl train bahrain-2023 --resume --out runs/drqn
    rsrl train bahrain-2023 --goal points --out runs/points
    """
    from rsrl.agents import resume as resume_run
    from rsrl.agents import train

    output = Output(json)
    entries = read_entries(races, driver, changes, sets)
    config = learner_config(agent, features, goal)
    make = environment_factory(entries)
    with progress(output, f"Training {agent} at {entries.name} for {entries.driver or 'every car'}") as report:
        if resume:
            _check_resumed(out, entries, config)
            result = resume_run(make, out, progress=training_progress(report))
        else:
            about = entries.about(command_line(), config)
            result = train(
                make, config, budget(seconds, iterations), seed, folder=out, about=about, force=force, progress=training_progress(report)
            )
    _tell(output, result, entries, out, seed)


def learner_config(agent: str, features: str | None = None, goal: str | None = None) -> "LearnerConfig":
    """An agent's settings; raises RsrlError for an unknown agent, feature set or goal, or one that is not for the agent."""
    from rsrl.agents import changed, default_config
    from rsrl.state import feature_set

    config = default_config(agent)
    if goal is not None:
        if agent != "rsrl":
            raise RsrlError(f"--goal {goal} with --agent {agent}: the paper's agents learn the paper's reward; leave out --goal")
        config = changed(config, goal=goal)
    if features is None:
        return config
    feature_set(features)
    if agent != "rsrl" or features == "paper":
        raise RsrlError(f"--features {features} with --agent {agent}: rsrl reads full or named, the paper's agents the paper's features")
    return changed(config, feature_set=features)


def budget(seconds: float | None, iterations: int | None) -> "Budget":
    """The training budget; one minute by default. Raises RsrlError where both limits are given."""
    from rsrl.agents import Budget

    if seconds is not None and iterations is not None:
        raise RsrlError("give either --seconds or --iterations, not both")
    return Budget(iterations=iterations) if iterations is not None else Budget(seconds=60.0 if seconds is None else seconds)


def training_progress(report: Report) -> Callable[["Progress"], None]:
    """Reports a learner's progress to a progress bar."""

    def update(step: "Progress") -> None:
        report(round(1000 * step.fraction), 1000)

    return update


def _check_resumed(out: Path, entries: Entries, config: "LearnerConfig") -> None:
    """Raise RsrlError where `out` holds no run, or one for other races, another car or figures that have changed since it began."""
    from rsrl.agents import holds_model, load_agent

    if out.is_dir() and not holds_model(out):
        raise RsrlError(f"{out}: holds no checkpoint to continue from; start the run again without --resume")
    _, about = load_agent(out)
    now = entries.about("", config)
    began, asked = (f"{a.driver or 'every car'} at {a.race}" for a in (about, now))
    if began != asked:
        raise RsrlError(f"{out}: a run for {began}, not for {asked}; name the races and driver it began with")
    if about.season_hash != now.season_hash:
        raise RsrlError(f"{out}: the figures of {about.race} have changed since this run began; train a new one")


def _tell(output: Output, result: "TrainingResult", entries: Entries, out: Path, seed: int) -> None:
    last = result.curve[-1] if result.curve else {}
    content = {
        "race": entries.name,
        "driver": entries.driver,
        "agent": result.agent.kind,
        "out": out,
        "iterations": result.iterations,
        "steps": result.steps,
        "seconds": result.seconds,
        "steps_per_s": result.steps_per_s,
        "finished": result.finished,
        "curve": result.curve,
        "provenance": provenance(seed),
    }
    rsrl = result.agent.kind == "rsrl"
    rows = [
        ("rollouts from decisions" if rsrl else "laps driven", f"{result.steps:,}"),
        ("iterations", f"{result.iterations:,}"),
        ("rollouts a second" if rsrl else "laps a second", f"{result.steps_per_s:,.0f}"),
        *((key.replace("_", " "), f"{value:.2f}") for key, value in last.items() if key.startswith("mean_")),
    ]
    state = "" if result.finished else " (interrupted: continue with --resume)"
    who = f"{result.agent.kind} for {entries.driver or 'every car'} at {entries.name}"
    output.result(content, table(f"{who}, {result.seconds:.0f} s{state}", ("", ""), rows))
    if not output.as_json:
        output.note(f"Model in {out}; compare it: rsrl evaluate {out}")
