"""`rsrl evaluate`: a model against other strategists on the same races."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from rsrl.cli.leaderboard import (
    DEFAULT_STRATEGISTS,
    leaderboard_table,
    result_files,
    run_all,
    write_results,
)
from rsrl.cli.options import CalledRacesOption, DriverOption, ForceOption, JsonOption, OutFolderOption, RaceOption, SeedOption
from rsrl.cli.output import Output
from rsrl.cli.provenance import provenance
from rsrl.cli.seeds import Model, load_models, seeds_document, seeds_table
from rsrl.errors import RsrlError
from rsrl.season import GROUPS, RaceRecord, find_car, load_race, race_hash

if TYPE_CHECKING:
    from rsrl.evaluation import Row, SeedsResult

DEFAULT_MODEL = "all"
DEFAULT_RACE = "bahrain-2023"
"""Called by a model that was trained on several races, where none is named."""

ModelArgument = Annotated[
    str,
    typer.Argument(
        metavar="MODEL",
        help="A run folder, a shipped policy (all: any race and car, or bahrain-2023), or several with commas: other seeds.",
    ),
]
StrategistsOption = Annotated[
    str,
    typer.Option(
        "--strategists",
        metavar="A,B",
        help="fixed, heuristic, imitation, best-plan, best-plan-sc, dp, tree, search, planner, planner-1s, hindsight, or model folders.",
    ),
]


def command(
    model: ModelArgument = DEFAULT_MODEL,
    races: CalledRacesOption = 1920,
    seed: SeedOption = 7,
    race: RaceOption = None,
    driver: DriverOption = None,
    strategists: StrategistsOption = DEFAULT_STRATEGISTS,
    out: OutFolderOption = None,
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
    dp           dynamic programming: least expected time, with safety cars
    tree         the decision tree that explains the policy `all`
    search       the policy `all`, and the race run on where its call is not clear
    hindsight    the best plan for each very race, its luck known: a bound
                 nobody can reach; with fixed, rows show the gap closed
    planner      runs the race on from each lap by Monte Carlo, 20 ms a decision
    planner-1s   the same with a second a decision: hours for 1,920 races

    Several run folders of one model, trained from other seeds, get a row
    each, and an aggregate whose intervals hold the luck of training.

    [bold]Examples[/bold]

    rsrl evaluate --race spain-2024 --driver NOR
    rsrl evaluate runs/x
    rsrl evaluate bahrain-2023 --races 1920 --seed 7 --out results
    rsrl evaluate runs/x --strategists fixed,best-plan-sc --json
    rsrl evaluate runs/a,runs/b,runs/c
    """
    from rsrl.evaluation import leaderboard, over_seeds
    from rsrl.strategists import PolicyStrategist

    output = Output(json)
    names = strategist_names(strategists)
    models = load_models(model)
    about = models[0].about
    record = load_race(race_to_call(race, about.race, model))
    car = find_car(record, driver or (about.driver if race is None else None) or None)
    policies = [PolicyStrategist(m.agent, record, m.name) for m in models]
    warnings = training_warnings(models, record, car, output)
    paths = result_files(out, force)
    first = first_race_of(seed, models, names, record, output)
    logs = run_all(output, policies, names, record, car, seed, races, first)
    together = over_seeds(logs[: len(models)], logs[len(models) :]) if len(models) > 1 else None
    rows = together.rows if together else leaderboard(logs[0], logs[1:])
    called = record.cars[car].driver
    asked: dict[str, object] = {"race": record.name, "driver": called, "races": races, "seed": seed, "first_race": first, "model": model}
    result = asked | {"warnings": warnings} | _figures(rows, together) | {"provenance": provenance(seed)}
    if paths:
        write_results(paths, result, logs, rows, record)
    against = f"the mean of {len(models)} seeds" if together else models[0].name
    board = leaderboard_table(record, called, races, seed, against, rows)
    output.result(result, board, *([seeds_table(together)] if together else []))


def _figures(rows: "Sequence[Row]", together: "SeedsResult | None") -> dict[str, object]:
    """Rows of the leaderboard, and the aggregate where there are several seeds."""
    return {"rows": [asdict(row) for row in rows]} | ({"aggregate": seeds_document(together)} if together else {})


def strategist_names(strategists: str) -> list[str]:
    """Names of a list such as `fixed,runs/x`, each once; raises RsrlError for what is neither a strategist nor a folder."""
    from rsrl.strategists import STRATEGISTS, is_model

    names = list(dict.fromkeys(word.strip() for word in strategists.split(",") if word.strip()))
    for name in names:
        if name not in STRATEGISTS and not is_model(name):
            raise RsrlError(
                f"unknown strategist {name!r}; there are {', '.join(STRATEGISTS)}, shipped policies and folders of trained models"
            )
    return names


def race_to_call(race: str | None, trained_on: str, model: str) -> str:
    """Name of the race to call: the one asked for, else the one the model was trained on; raises RsrlError where there is neither."""
    if race is None and not trained_on:
        raise RsrlError(f"{model}: the model does not say which race it was trained on; name one with --race")
    several = trained_on in GROUPS or "," in trained_on
    return race or (DEFAULT_RACE if several else trained_on)


def training_warnings(models: list[Model], record: RaceRecord, car: int, output: Output) -> list[str]:
    """Say where a race lies outside what a model was trained on; the lines that stand in the result."""
    from rsrl.strategists import outside_training

    lines = [f"{m.name}: {line}" for m in models for line in outside_training(m.about, record, car)]
    for line in lines:
        output.note(f"Warning: {line}")
    return lines


def first_race_of(seed: int, models: list[Model], names: list[str], record: RaceRecord, output: Output) -> int:
    """Number of the first race: 0, but where a model trained on races of this very seed."""
    from rsrl.agents import TRAINING_SEED, load_agent
    from rsrl.evaluation import APART
    from rsrl.strategists import STRATEGISTS, find_model

    for name, _, about in models:
        if about.season_hash and about.race == record.name and about.season_hash != race_hash(record):
            output.note(f"Note: this {name} model was trained on other figures for {record.name} than those it is evaluated on.")
    trained = [*(m.about.seed for m in models), *(load_agent(find_model(name))[1].seed for name in names if name not in STRATEGISTS)]
    if seed - TRAINING_SEED not in trained:
        return 0
    output.note(f"Note: seed {seed} is that of a model's training; races from number {APART} on are taken, which training never saw.")
    return APART
