"""`rsrl study robustness`: a policy against other rivals, and in seasons that are not what their figures say."""

from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

from rsrl.cli.files import make_folder, refuse_overwrite, write_json
from rsrl.cli.options import DriverOption, ForceOption, JsonOption, ModelArgument, OutFolderOption, RaceOption, SeedOption, WideOption
from rsrl.cli.output import Column, FittedTable, Output, table
from rsrl.cli.progress import progress
from rsrl.cli.provenance import provenance
from rsrl.cli.seeds import Model, load_models
from rsrl.errors import RsrlError
from rsrl.results import Robustness, RobustnessRow, half_width
from rsrl.season import RaceRecord, find_car, load_race

if TYPE_CHECKING:
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
    wide: WideOption = False,
    json: JsonOption = False,
) -> None:
    """Test a model against other rivals and with other season figures.

    Rivals are called as real teams call (reactive), follow plans (plans), or
    are all called by the model itself (itself). The season's figures are
    drawn anew, with their standard errors times a scale: 2 and 3 lie beyond
    what the data allow. Pit walls keep believing the fitted figures, unless
    --informed is given. A difference is a strategist's position less the
    model's in the same race.

    [bold]Examples[/bold]

    rsrl study robustness bahrain-2023
    rsrl study robustness runs/x --rivals itself --scales 0 --races 1920
    rsrl study robustness runs/x --informed --strategists heuristic --json
    """
    from rsrl.cli.evaluate import first_race_of, race_to_call
    from rsrl.evaluation import RobustnessPlan, robustness
    from rsrl.strategists import strategist_names

    output = Output(json, wide)
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
        rows = robustness(trained.network, make, record, car, seed, plan, progress=report)
    result = Robustness(record.name, record.cars[car].driver, model, seed, plan, tuple(rows), provenance(seed))
    if out:
        write_json(out / FILE, result)
    output.result(result, robustness_table(record, result.driver, names, rows))


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
    """The model and the strategists it is compared with, for the figures the pit wall believes."""
    from rsrl.strategists import STRATEGISTS, PolicyStrategist, Strategist, make_strategist

    found: list[Strategist] = [PolicyStrategist(own.network, record, own.name)]
    for name in names:
        if name in STRATEGISTS:
            found.append(make_strategist(name, record, car))
        else:
            found.append(PolicyStrategist(_one_model(name).network, record, name))
    return found


def robustness_table(record: RaceRecord, driver: str, names: list[str], rows: list[RobustnessRow]) -> FittedTable:
    """The model in each setting, and how far each strategist is behind it."""
    columns: list[str | Column] = ["rivals", "scale", Column("races", 1), "position", Column("+-", 2)]
    for number, name in enumerate(names):  # of each the difference stays longest, and the first named before the others
        columns += [Column(name, 100 + number), Column(f"behind {name}", number), Column(f"ahead of {name} %", 50 + number)]
    cells = []
    for row in rows:
        line = [
            row.rivals,
            f"{row.scale:g}",
            f"{row.races:,}",
            f"{row.mean_position:.2f}",
            f"{half_width(row.mean_position, row.ci95):.2f}",
        ]
        for other in row.against:
            half = half_width(other.difference, other.difference_ci95)
            line += [f"{other.mean_position:.2f}", f"{other.difference:+.2f} +-{half:.2f}", f"{100 * other.p_better:.0f}"]
        cells.append(line)
    title = f"{driver}, {record.event} {record.season}: other rivals, and figures off by their errors times a scale"
    caption = "behind: places behind the model on the same race; +-: half the 95 % interval, over draws where there are several"
    return table(title, columns, cells, captions=[caption])
