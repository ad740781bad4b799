"""`rsrl study robustness`: a policy against other rivals, and in seasons that are not what their figures say."""

from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

from rsrl.cli.files import make_folder, refuse_overwrite, write_json
from rsrl.cli.options import DriverOption, ForceOption, JsonOption, ModelArgument, OutFolderOption, RaceOption, SeedOption
from rsrl.cli.output import Output, table
from rsrl.cli.progress import progress
from rsrl.cli.provenance import provenance
from rsrl.cli.seeds import Model, load_models
from rsrl.errors import RsrlError
from rsrl.season import RaceRecord, find_car, load_race

if TYPE_CHECKING:
    from rich.table import Table

    from rsrl.evaluation import RobustnessRow
    from rsrl.strategists import Strategist

FILE = "robustness.json"

RacesOption = Annotated[int, typer.Option("--races", metavar="N", min=4, max=1_000_000, help="Races in each setting, over all draws.")]
DrawsOption = Annotated[int, typer.Option("--draws", metavar="N", min=2, max=1000, help="How many times the figures are drawn.")]
ScalesOption = Annotated[str, typer.Option("--scales", metavar="A,B", help="Scales of the errors in the figures; 0 is none.")]
RivalsOption = Annotated[str, typer.Option("--rivals", metavar="A,B", help="Who calls the others: reactive, plans, itself.")]
StrategistsOption = Annotated[str, typer.Option("--strategists", metavar="A,B", help="Whom to compare with, as for `rsrl evaluate`.")]
InformedOption = Annotated[bool, typer.Option("--informed", help="Pit walls know the figures drawn, and search their plans on them.")]


def command(
    model: ModelArgument,
    race: RaceOption = None,
    driver: DriverOption = None,
    races: RacesOption = 960,
    draws: DrawsOption = 8,
    scales: ScalesOption = "0,1,2,3",
    rivals: RivalsOption = "reactive,plans,itself",
    strategists: StrategistsOption = "heuristic,best-plan-sc",
    informed: InformedOption = False,
    seed: SeedOption = 7,
    out: OutFolderOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Test a model against other rivals and in other seasons than it knows.

    Rivals are called as teams call (reactive), by plans alone (plans), or
    all by the model itself (itself). The season's figures are drawn anew
    within a scale of their errors: 1 is what they are known to, 2 and 3 lie
    beyond. The pit walls, the model's and the others', go on believing in
    the figures as fitted, unless --informed says otherwise. A difference is
    a strategist's position less the model's on the same race.

    [bold]Examples[/bold]

    rsrl study robustness bahrain-2023
    rsrl study robustness runs/x --rivals itself --scales 0 --races 1920
    rsrl study robustness runs/x --informed --strategists heuristic --json
    """
    from rsrl.cli.evaluate import first_race_of, race_to_call, strategist_names
    from rsrl.evaluation import RobustnessPlan, robustness

    output = Output(json)
    names = strategist_names(strategists)
    trained = _one_model(model)
    record = load_race(race_to_call(race, trained.about.race, model))
    car = find_car(record, driver or (trained.about.driver if race is None else None) or None)
    ways = tuple(word.strip() for word in rivals.split(",") if word.strip())
    first = first_race_of(seed, [trained], names, record, output)
    plan = RobustnessPlan(rivals=ways, scales=_scales(scales), draws=draws, races=races, first_race=first, informed=informed)
    if out:
        make_folder(out)
        refuse_overwrite(out / FILE, force)
    make = partial(_strategists, trained, names, car)
    with progress(output, f"{len(plan.rivals) * len(plan.scales)} settings of {races:,} races") as report:
        rows = robustness(trained.agent, make, record, car, seed, plan, progress=report)
    about = {"race": record.name, "driver": record.cars[car].driver, "model": model, "seed": seed, "plan": asdict(plan)}
    result = about | {"rows": [asdict(row) for row in rows], "provenance": provenance(seed)}
    if out:
        write_json(out / FILE, result)
    output.result(result, _table(record, record.cars[car].driver, names, rows))


def _one_model(text: str) -> Model:
    """The model of a folder or name; raises RsrlError where several are given."""
    first, *more = load_models(text)
    if more:
        raise RsrlError(f"{text}: several models; the study takes one")
    return first


def _scales(text: str) -> tuple[float, ...]:
    try:
        values = tuple(float(word) for word in text.split(",") if word.strip())
    except ValueError:
        raise RsrlError(f"--scales {text!r} does not parse; write numbers with commas between them, such as 0,1,2") from None
    if not all(0 <= value <= 10 for value in values):
        raise RsrlError(f"--scales {text!r}: a scale lies between 0 and 10")
    return values


def _strategists(own: Model, names: list[str], car: int, record: RaceRecord) -> "list[Strategist]":
    """The model and those it is compared with, for figures that are believed in."""
    from rsrl.strategists import STRATEGISTS, PolicyStrategist, Strategist, make_strategist

    found: list[Strategist] = [PolicyStrategist(own.agent, record, own.name)]
    for name in names:
        if name in STRATEGISTS:
            found.append(make_strategist(name, record, car))
        else:
            found.append(PolicyStrategist(_one_model(name).agent, record, name))
    return found


def _table(record: RaceRecord, driver: str, names: list[str], rows: "list[RobustnessRow]") -> "Table":
    columns = ["rivals", "scale", "races", "position", "+-"]
    for name in names:
        columns += [name, "behind", "ahead %"]
    cells = []
    for row in rows:
        line = [row.rivals, f"{row.scale:g}", f"{row.races:,}", f"{row.mean_position:.2f}", f"{row.ci95[1] - row.mean_position:.2f}"]
        for other in row.against:
            half = other.difference_ci95[1] - other.difference
            line += [f"{other.mean_position:.2f}", f"{other.difference:+.2f} +-{half:.2f}", f"{100 * other.p_better:.0f}"]
        cells.append(line)
    built = table(f"{driver}, {record.event} {record.season}: other rivals, and figures off by so many standard errors", columns, cells)
    built.caption = "behind: places behind the model on the same race; +-: 95 % interval, over draws of the figures where there are several"
    built.caption_justify = "left"
    return built
