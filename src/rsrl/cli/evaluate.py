"""`rsrl evaluate`: a model against other strategists on the same races."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rsrl.cli.files import make_folder, refuse_overwrite, write_json
from rsrl.cli.options import DriverOption, ForceOption, JsonOption, SeedOption
from rsrl.cli.output import Output, table
from rsrl.cli.progress import progress
from rsrl.cli.provenance import provenance
from rsrl.errors import RsrlError
from rsrl.season import RaceRecord, find_car, load_race, race_hash

if TYPE_CHECKING:
    from rich.table import Table

    from rsrl.agents import ModelMetadata, NetworkAgent
    from rsrl.evaluation import CommonStrategy, RaceLog, Row, StintBar
    from rsrl.strategists import PolicyStrategist

DEFAULT_STRATEGISTS = "fixed,heuristic,best-plan,best-plan-sc"
FILES = ("evaluation.json", "positions.png", "strategies.png")
APART = 2**32
"""First race number where the seed asked for is that of the model's training; training counts its races from 0."""

ModelArgument = Annotated[str, typer.Argument(metavar="MODEL", help="A run folder, or the name of a shipped policy such as bahrain-2023.")]
RacesOption = Annotated[int, typer.Option("--races", metavar="N", min=1, max=1_000_000, help="How many races each strategist calls.")]
RaceOption = Annotated[
    str | None, typer.Option("--race", metavar="RACE", help="The race to call, or a season file, file.toml; else the one trained on.")
]
StrategistsOption = Annotated[
    str,
    typer.Option(
        "--strategists", metavar="A,B", help="Whom to compare with: fixed, heuristic, best-plan, best-plan-sc, or folders of other models."
    ),
]
OutOption = Annotated[Path | None, typer.Option("--out", metavar="FOLDER", help="Folder for evaluation.json and the figures.")]


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


def run_all(
    output: Output, policy: "PolicyStrategist", names: list[str], record: RaceRecord, car: int, seed: int, races: int, first: int
) -> "list[RaceLog]":
    """Call the same races by the policy, then by each strategist named; a name may be a folder of another model."""
    from rsrl.evaluation import run_races
    from rsrl.strategists import STRATEGISTS, Strategist, make_strategist

    models: dict[str, Strategist] = {policy.name: policy}
    for name in names:
        if name not in STRATEGISTS:
            models[name] = _other_model(name, {m.name for m in models.values()}, record)
    logs = []
    for name in (policy.name, *names):
        with progress(output, f"Calling {races:,} races: {name}") as report:
            strategist = models.get(name) or make_strategist(name, record, car, progress=report)
            logs.append(run_races(strategist, record, car, seed, races, first_race=first, progress=report))
    return logs


def _other_model(folder: str, taken: set[str], record: RaceRecord) -> "PolicyStrategist":
    """A model to compare with, named by its kind, and by its folder too where that name is taken."""
    from rsrl.agents import load_agent
    from rsrl.strategists import PolicyStrategist

    agent, _ = load_agent(Path(folder))
    name = f"{agent.kind} {Path(folder).name}" if agent.kind in taken else agent.kind
    return PolicyStrategist(agent, record, folder if name in taken else name)


def result_files(out: Path | None, force: bool) -> dict[str, Path]:
    """Paths of the result files by name, none without a folder; raises RsrlError where one exists or cannot be written."""
    if out is None:
        return {}
    make_folder(out)
    for name in FILES:
        refuse_overwrite(out / name, force)
    return {name: out / name for name in FILES}


def write_results(paths: dict[str, Path], result: dict[str, object], logs: "list[RaceLog]", rows: "list[Row]", record: RaceRecord) -> None:
    """Write the result as JSON, with the strategies driven, and the figures."""
    from rsrl.evaluation import common_strategies, plot_positions, plot_strategies

    result["files"] = [str(path) for path in paths.values()]
    common = [strategy for log in logs for strategy in common_strategies(log)]
    result["strategies"] = [asdict(strategy) | {"plan": strategy.text} for strategy in common]
    write_json(paths["evaluation.json"], result)
    where = f"{record.event} {record.season}, {result['driver']}"
    plot_positions(logs, f"Finishing positions: {where}, {result['races']:,} races", paths["positions.png"])
    plot_strategies(_bars(common), record.laps, f"Strategies driven: {where}", "10-90 % of stops", paths["strategies.png"])


def _bars(common: "list[CommonStrategy]") -> "list[StintBar]":
    from rsrl.evaluation import StintBar

    return [
        StintBar(s.text, f"{100 * s.share:.0f} %  P{s.mean_position:.1f}", s.compounds, s.laps, s.windows, s.strategist) for s in common
    ]


def leaderboard_table(record: RaceRecord, driver: str, races: int, seed: int, model: str, rows: "list[Row]") -> "Table":
    """The leaderboard as people read it; the model is marked."""
    columns = ("strategist", "position", "+-", "behind", "+-", "ahead %", "points", "stops", "invalid %", "out %", "ms")
    cells = [
        (
            f"[bold]{row.strategist} <[/bold]" if row.strategist == model else row.strategist,
            f"{row.mean_position:.2f}",
            f"{row.ci95[1] - row.mean_position:.2f}",
            *(("", "", "") if row.strategist == model else _difference(row)),
            f"{row.mean_points:.2f}",
            f"{row.mean_stops:.2f}",
            f"{100 * row.invalid_share:.1f}",
            f"{100 * row.retired_share:.1f}",
            f"{row.decision_ms:.3f}",
        )
        for row in rows
    ]
    built = table(f"{driver}, {record.event} {record.season}: {races:,} races of seed {seed}, the same for all", columns, cells)
    built.caption = f"behind: places behind {model} on the same race; ahead: races {model} finishes ahead, ties half; +-: 95 % interval"
    built.caption_justify = "left"
    return built


def _difference(row: "Row") -> tuple[str, str, str]:
    return f"{row.difference:+.2f}", f"{row.difference_ci95[1] - row.difference:.2f}", f"{100 * row.p_better:.0f}"
