"""`rsrl evaluate`: a model against other strategists on the same races."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rsrl.cli.leaderboard import (
    DEFAULT_STRATEGISTS,
    OutOption,
    RacesOption,
    leaderboard_table,
    result_files,
    run_all,
    write_results,
)
from rsrl.cli.options import DriverOption, ForceOption, JsonOption, SeedOption
from rsrl.cli.output import Output
from rsrl.cli.provenance import provenance
from rsrl.errors import RsrlError
from rsrl.season import RaceRecord, find_car, load_race, race_hash

if TYPE_CHECKING:
    from rsrl.agents import ModelMetadata, NetworkAgent

APART = 2**32
"""First race number where the seed asked for is that of the model's training; training counts its races from 0."""

ModelArgument = Annotated[str, typer.Argument(metavar="MODEL", help="A run folder, or the name of a shipped policy such as bahrain-2023.")]
RaceOption = Annotated[
    str | None, typer.Option("--race", metavar="RACE", help="The race to call, or a season file, file.toml; else the one trained on.")
]
StrategistsOption = Annotated[
    str,
    typer.Option(
        "--strategists",
        metavar="A,B",
        help="Whom to compare with: fixed, heuristic, best-plan, best-plan-sc, imitation, planner, planner-1s, or folders of models.",
    ),
]


def command(
    model: ModelArgument,
    races: RacesOption = 1920,
    seed: SeedOption = 7,
    race: RaceOption = None,
    driver: DriverOption = None,
    strategists: StrategistsOption = DEFAULT_STRATEGISTS,
    out: OutOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Compare a trained model with other strategists on the same races.

    Each race is called by all of them: the same starting tyre, safety cars,
    rivals and luck. A difference is that row's position less the model's on
    the same race: above zero the model finishes ahead. Neither training nor
    plan searches ever saw these races.

    fixed        one of the published strategies, at random
    heuristic    rules of the pit wall: wear, undercut, traffic, safety car
    best-plan    the best fixed plan there is, by brute force
    best-plan-sc the same with the best rule for stopping under safety cars
    imitation    what a team would do: a model of real calls
    planner      runs the race on from each lap by Monte Carlo, 20 ms a decision
    planner-1s   the same with a second a decision: hours for 1,920 races

    [bold]Examples[/bold]

    rsrl evaluate runs/x
    rsrl evaluate bahrain-2023 --races 1920 --seed 7 --out results
    rsrl evaluate runs/x --strategists fixed,best-plan-sc --json
    """
    from rsrl.agents import load_agent
    from rsrl.evaluation import leaderboard
    from rsrl.strategists import PolicyStrategist, find_model

    output = Output(json)
    names = _names(strategists)
    agent, about = load_agent(find_model(model))
    record = load_race(_race_name(race, about.race, model))
    car = find_car(record, driver or (about.driver if race is None else None) or None)
    policy = PolicyStrategist(agent, record, agent.kind)
    paths = result_files(out, force)
    first = _first_race(seed, agent, about, names, record, output)
    logs = run_all(output, policy, names, record, car, seed, races, first)
    rows = leaderboard(logs[0], logs[1:])
    result = {
        "race": record.name,
        "driver": record.cars[car].driver,
        "races": races,
        "seed": seed,
        "first_race": first,
        "model": model,
        "rows": [asdict(row) for row in rows],
        "provenance": provenance(seed),
    }
    if paths:
        write_results(paths, result, logs, rows, record)
    output.result(result, leaderboard_table(record, str(result["driver"]), races, seed, policy.name, rows))


def _names(strategists: str) -> list[str]:
    from rsrl.strategists import STRATEGISTS

    names = list(dict.fromkeys(word.strip() for word in strategists.split(",") if word.strip()))
    for name in names:
        if name not in STRATEGISTS and not Path(name).is_dir():
            raise RsrlError(f"unknown strategist {name!r}; there are {', '.join(STRATEGISTS)}, and folders of trained models")
    return names


def _race_name(race: str | None, trained_on: str, model: str) -> str:
    if race is None and not trained_on:
        raise RsrlError(f"{model}: the model does not say which race it was trained on; name one with --race")
    return race or trained_on


def _first_race(seed: int, agent: "NetworkAgent", about: "ModelMetadata", names: list[str], record: RaceRecord, output: Output) -> int:
    """Number of the first race: 0, but where a model trained on races of this very seed."""
    from rsrl.agents import TRAINING_SEED, load_agent
    from rsrl.strategists import STRATEGISTS

    if about.season_hash and about.race == record.name and about.season_hash != race_hash(record):
        output.note(f"Note: this {agent.kind} model was trained on other figures for {record.name} than those it is evaluated on.")
    trained = [about.seed, *(load_agent(Path(name))[1].seed for name in names if name not in STRATEGISTS)]
    if seed - TRAINING_SEED not in trained:
        return 0
    output.note(f"Note: seed {seed} is that of a model's training; races from number {APART} on are taken, which training never saw.")
    return APART
