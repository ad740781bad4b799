"""`rsrl evaluate`: a model against other strategists on the same races."""

from typing import TYPE_CHECKING, Annotated

import typer

from rsrl.cli.leaderboard import (
    DEFAULT_STRATEGISTS,
    CalledRaces,
    leaderboard_table,
    result_files,
    run_all,
    write_results,
)
from rsrl.cli.options import (
    CalledRacesOption,
    DriverOption,
    ForceOption,
    JsonOption,
    OutFolderOption,
    RaceOption,
    SeedOption,
    SetOption,
    SetsOption,
    WideOption,
    assumed,
)
from rsrl.cli.output import Output
from rsrl.cli.provenance import provenance
from rsrl.cli.seeds import Model, load_models, seeds_table
from rsrl.errors import RsrlError
from rsrl.results import Evaluation
from rsrl.season import GROUPS, RaceRecord, find_car, load_race, race_hash

if TYPE_CHECKING:
    from rsrl.evaluation import RaceLog

DEFAULT_MODEL = "all"
DEFAULT_RACE = "bahrain-2023"
"""Called by a model that was trained on several races, where none is named."""

ModelArgument = Annotated[
    str,
    typer.Argument(
        metavar="MODEL",
        help="A shipped policy (all: any race and car, bahrain-2023, drqn-bahrain-2023), a run folder, several with commas (other seeds), "
        "a file of Stable-Baselines3 (model.zip), or module:function of (observation, mask).",
    ),
]
StrategistsOption = Annotated[
    str,
    typer.Option(
        "--strategists",
        metavar="A,B",
        help="fixed, heuristic, imitation, best-plan, best-plan-sc, dp, tree, search, planner, planner-1s, hindsight, or models.",
    ),
]


def command(
    model: ModelArgument = DEFAULT_MODEL,
    races: CalledRacesOption = 1920,
    seed: SeedOption = 7,
    race: RaceOption = None,
    driver: DriverOption = None,
    strategists: StrategistsOption = DEFAULT_STRATEGISTS,
    changes: SetOption = None,
    sets: SetsOption = None,
    out: OutFolderOption = None,
    force: ForceOption = False,
    wide: WideOption = False,
    json: JsonOption = False,
) -> None:
    """Compare a trained model with other strategists on the same races.

    All of them call the same races, with the same starting tyres, safety cars
    and random numbers. A difference is a strategist's position less the
    model's in the same race: above zero the model finishes ahead. Neither
    training nor plan searches have used these races.

    fixed        one of the published strategies, at random
    heuristic    rules of the pit wall: wear, undercut, traffic, safety car
    best-plan    the best fixed plan, by exhaustive search
    best-plan-sc the same with the best rule for stopping under safety cars
    imitation    a model of real teams' calls
    dp           dynamic programming: least expected time, with safety cars
    tree         the decision tree that explains the policy `all`
    search       the policy `all`, with rollouts where its call is not clear
    planner      Monte Carlo rollouts of plans on each lap, 20 ms a decision
    planner-1s   the same with a second a decision: hours for 1,920 races
    hindsight    the best plan for each race, known in advance: a bound

    With fixed and hindsight, rows show the gap closed. Run folders of one
    model trained with different seeds get a row each, and an aggregate.

    [bold]Examples[/bold]

    rsrl evaluate --race spain-2024 --driver NOR
    rsrl evaluate bahrain-2023 --strategists fixed,best-plan-sc --out results
    rsrl evaluate runs/a,runs/b,runs/c
    rsrl evaluate my_policy:call --race bahrain-2023 --strategists all,dp
    """
    from rsrl.strategists import strategist_names

    output, names, models = Output(json, wide), strategist_names(strategists), load_models(model)
    about = models[0].about
    record = assumed(load_race(race_to_call(race, about.race, model)), changes, sets)
    car = find_car(record, driver or (about.driver if race is None else None) or None)
    warnings = training_warnings(models, record, car, output)
    paths = result_files(out, force)
    called = CalledRaces(record, car, seed, races, first_race_of(seed, models, names, record, output))
    logs = run_all(output, [m.strategist(record) for m in models], names, called)
    result = _evaluation(logs, len(models), called, model, warnings)
    result = write_results(paths, result, logs, record) if paths else result
    together = result.aggregate
    board = leaderboard_table(record, result, f"the mean of {together.seeds} seeds" if together else models[0].name)
    output.result(result, board, *([seeds_table(together)] if together else []))


def _evaluation(logs: "list[RaceLog]", seeds: int, called: CalledRaces, model: str, warnings: tuple[str, ...]) -> Evaluation:
    """The result of the races; the first logs are those of the model's seeds."""
    from rsrl.evaluation import leaderboard, over_seeds

    together = over_seeds(logs[:seeds], logs[seeds:]) if seeds > 1 else None
    return Evaluation(
        race=called.record.name,
        driver=called.record.cars[called.car].driver,
        races=called.races,
        seed=called.seed,
        first_race=called.first,
        model=model,
        warnings=warnings,
        rows=together.rows if together else tuple(leaderboard(logs[0], logs[1:])),
        aggregate=together.aggregate if together else None,
        provenance=provenance(called.seed),
    )


def race_to_call(race: str | None, trained_on: str, model: str) -> str:
    """Name of the race to call: the one asked for, else the one the model was trained on; raises RsrlError where there is neither."""
    if race is None and not trained_on:
        raise RsrlError(f"{model}: the model does not say which race it was trained on; name one with --race")
    several = trained_on in GROUPS or "," in trained_on
    return race or (DEFAULT_RACE if several else trained_on)


def training_warnings(models: list[Model], record: RaceRecord, car: int, output: Output) -> tuple[str, ...]:
    """Say where a race lies outside what a model was trained on; the lines that stand in the result."""
    from rsrl.strategists import outside_training

    lines = tuple(f"{m.name}: {line}" for m in models for line in outside_training(m.about, record, car))
    for line in lines:
        output.note(f"Warning: {line}")
    return lines


def first_race_of(seed: int, models: list[Model], names: list[str], record: RaceRecord, output: Output) -> int:
    """Number of the first race: 0, but where a model trained on races of this very seed."""
    from rsrl.evaluation import first_unseen_race
    from rsrl.strategists import STRATEGISTS, load_policy

    for name, _, about in models:
        if about.season_hash and about.race == record.name and about.season_hash != race_hash(record):
            output.note(f"Note: this {name} model was trained on other figures for {record.name} than those it is evaluated on.")
    called = [(m.agent, m.about) for m in models] + [load_policy(name) for name in names if name not in STRATEGISTS]
    first = first_unseen_race(seed, called)
    if first:
        output.note(f"Note: seed {seed} is that of a model's training; races from number {first} on are taken, which training never saw.")
    return first
