"""`rsrl train`: an agent learns to call a race."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rsrl.cli.options import DriverOption, ForceOption, JsonOption, RaceArgument
from rsrl.cli.output import Output, table
from rsrl.cli.progress import Report, progress
from rsrl.cli.provenance import command_line, provenance
from rsrl.errors import RsrlError
from rsrl.season import RaceRecord, find_car, load_race, race_hash

if TYPE_CHECKING:
    from rsrl.agents import Budget, EnvironmentFactory, Progress, TrainingResult

AgentOption = Annotated[str, typer.Option("--agent", metavar="NAME", help="rsrl, or the paper's drqn or dqn.")]
SecondsOption = Annotated[float | None, typer.Option("--seconds", metavar="S", help="Time to train for; 60 where nothing is said.")]
IterationsOption = Annotated[
    int | None,
    typer.Option("--iterations", metavar="N", help="Instead of --seconds: iterations of rsrl, races of dqn and drqn. Repeats bit for bit."),
]
TrainingSeedOption = Annotated[int, typer.Option("--seed", metavar="N", min=0, max=100_000, help="Names everything random in the run.")]
OutOption = Annotated[Path, typer.Option("--out", metavar="FOLDER", help="Run folder for model, log and checkpoints.")]
ResumeOption = Annotated[bool, typer.Option("--resume", help="Go on with the interrupted run in --out, with its own settings.")]


def command(
    race: RaceArgument,
    out: OutOption,
    driver: DriverOption = None,
    agent: AgentOption = "rsrl",
    seconds: SecondsOption = None,
    iterations: IterationsOption = None,
    seed: TrainingSeedOption = 0,
    resume: ResumeOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Train an agent to call a race for one driver.

    The run folder gets the model (model.safetensors, model.json), a log
    of the learning curve (log.jsonl) and what a later --resume needs.
    Ctrl-C stops cleanly: the model so far is kept. Training races are
    never those of an evaluation: their seeds begin at a million.

    [bold]Examples[/bold]

    rsrl train bahrain-2023 --seconds 60 --out runs/ham
    rsrl train bahrain-2023 --agent drqn --iterations 5000 --out runs/drqn
    rsrl train bahrain-2023 --resume --out runs/drqn
    """
    from rsrl.agents import ModelMetadata, default_config, train
    from rsrl.agents import resume as resume_run

    output = Output(json)
    record = load_race(race)
    car = find_car(record, driver)
    config = default_config(agent)
    make = environment_factory(record, car)
    with progress(output, f"Training {agent} at {record.event} {record.season} for {record.cars[car].driver}") as report:
        if resume:
            result = resume_run(make, out, progress=training_progress(report))
        else:
            about = ModelMetadata(race=record.name, season_hash=race_hash(record), driver=record.cars[car].driver, command=command_line())
            result = train(
                make, config, budget(seconds, iterations), seed, folder=out, about=about, force=force, progress=training_progress(report)
            )
    _tell(output, result, record, record.cars[car].driver, out, seed)


def budget(seconds: float | None, iterations: int | None) -> "Budget":
    """The training budget asked for; a minute where nothing was said."""
    from rsrl.agents import Budget

    if seconds is not None and iterations is not None:
        raise RsrlError("give either --seconds or --iterations, not both")
    return Budget(iterations=iterations) if iterations is not None else Budget(seconds=60.0 if seconds is None else seconds)


def environment_factory(record: RaceRecord, car: int) -> "EnvironmentFactory":
    """Environments of a race for a learner: feature set and races side by side are its choice."""
    from rsrl.environment import RaceEnvironment

    def make(feature_set: str, batch: int) -> RaceEnvironment:
        return RaceEnvironment(record, car, feature_set=feature_set, batch=batch)

    return make


def training_progress(report: Report) -> Callable[["Progress"], None]:
    """A learner's progress as a bar's."""

    def update(step: "Progress") -> None:
        report(round(1000 * step.fraction), 1000)

    return update


def _tell(output: Output, result: "TrainingResult", record: RaceRecord, driver: str, out: Path, seed: int) -> None:
    last = result.curve[-1] if result.curve else {}
    content = {
        "race": record.name,
        "driver": driver,
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
    rows = [
        ("laps driven", f"{result.steps:,}"),
        ("iterations", f"{result.iterations:,}"),
        ("laps a second", f"{result.steps_per_s:,.0f}"),
        *((key.replace("_", " "), f"{value:.2f}") for key, value in last.items() if key.startswith("mean_")),
    ]
    state = "" if result.finished else " (interrupted: go on with --resume)"
    output.result(content, table(f"{result.agent.kind} for {driver} at {record.name}, {result.seconds:.0f} s{state}", ("", ""), rows))
    if not output.as_json:
        output.note(f"Model in {out}; compare it: rsrl evaluate {out}")
