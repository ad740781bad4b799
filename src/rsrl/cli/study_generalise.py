"""`rsrl study generalise`: the paper's Table 3 and Figure 3, with intervals, criteria and a held-out season."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer
from msgspec.structs import replace

from rsrl.cli.files import make_folder, refuse_overwrite, write_json, write_text
from rsrl.cli.options import DriverOption, ForceOption, JsonOption, SeedOption, WideOption
from rsrl.cli.output import Output
from rsrl.cli.progress import progress
from rsrl.cli.provenance import provenance
from rsrl.cli.study_tables import markdown, tables
from rsrl.errors import RsrlError
from rsrl.season import GROUPS, STUDY_TRACKS, held_out_races

if TYPE_CHECKING:
    from rsrl.evaluation.study import Study

RESULT_FILE, TABLE_FILE = "generalise.json", "table3.md"
CARS_BY: Final = ("heuristic", "imitation")
"""Strategists that call every car, beside the models, unless told otherwise."""

ModelsOption = Annotated[
    str | None,
    typer.Option("--models", metavar="NAME=FOLDER,..", help="Models: run folders or shipped policies; else the groups' shipped ones."),
]
StrategistsOption = Annotated[
    str | None, typer.Option("--strategists", metavar="A,B", help="Whom to compare with; else fixed, heuristic and the other baselines.")
]
RacesOption = Annotated[int, typer.Option("--races", metavar="N", min=2, max=1_000_000, help="How many races each calls at a track.")]
RacesOfOption = Annotated[
    str, typer.Option("--races-of", metavar="NAME=N,..", help="Fewer races for some, such as planner=96; compared on those in common.")
]
TracksOption = Annotated[str | None, typer.Option("--tracks", metavar="A,B", help="Tracks of 2023, or races; else the paper's 14.")]
CarsOption = Annotated[str, typer.Option("--cars", metavar="A,B", help="Tracks at which all the cars are called, one after the other.")]
CarsByOption = Annotated[
    str | None, typer.Option("--cars-by", metavar="A,B", help="Who calls all the cars; else the models, heuristic and imitation.")
]
HeldOutOption = Annotated[bool, typer.Option("--held-out", help="A second table, of the dry races of 2024.")]
EngineOption = Annotated[str, typer.Option("--engine", metavar="NAME", help="local, or ray for a cluster.")]
AddressOption = Annotated[
    str | None, typer.Option("--address", metavar="HOST:PORT", help="Head of the Ray cluster, or auto; else Ray is started here.")
]
WorkersOption = Annotated[int | None, typer.Option("--workers", metavar="N", min=1, help="Cells at the same time; else one a core.")]
OutOption = Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the result, the figures and the finished cells.")]


def generalise(
    out: OutOption,
    models: ModelsOption = None,
    strategists: StrategistsOption = None,
    races: RacesOption = 960,
    races_of: RacesOfOption = "",
    seed: SeedOption = 7,
    driver: DriverOption = None,
    tracks: TracksOption = None,
    cars: CarsOption = "",
    cars_by: CarsByOption = None,
    held_out: HeldOutOption = False,
    engine: EngineOption = "local",
    address: AddressOption = None,
    workers: WorkersOption = None,
    force: ForceOption = False,
    wide: WideOption = False,
    json: JsonOption = False,
) -> None:
    """Compare models on seen and unseen tracks with other strategists.

    Mean finishing positions by track as in the paper's Table 3, paired
    differences to the model `all`, the three criteria of a reasonable
    strategy, and Figure 3. All strategists call the same races. --out keeps
    every finished cell, so an interrupted command can be repeated to
    continue, and with --force a finished study can be extended.

    [bold]Examples[/bold]

    rsrl study generalise --models rsrl-9=runs/nine,all=runs/all --out runs/g
    rsrl study generalise --models all=runs/all --cars japan,spain --held-out --out runs/g
    rsrl study generalise --models all=runs/all --races-of planner=96 --engine ray --address head:6379 --out runs/g
    """
    from rsrl.evaluation.study import Store, check_engine, generalise, plan_cells, plot_figure3, run_cells

    output = Output(json, wide)
    check_engine(engine, address, workers)
    study = _study(models, strategists, races, races_of, seed, driver, tracks, cars, cars_by, held_out)
    if study.first_race:
        output.note(f"Note: seed {seed} is that of a model's training; races from number {study.first_race} on are taken.")
    cells = plan_cells(study)
    for name in (RESULT_FILE, TABLE_FILE):
        refuse_overwrite(out / name, force)
    store = Store(make_folder(out), {"study": "generalise", "seed": seed, "races": races, "driver": driver}, force=force)
    with progress(output, f"Running {len(set(cells.values()))} cells") as report:
        ordered = list(cells.values())
        done = run_cells(ordered, store, engine=engine, address=address, workers=workers, progress=report)
    result = generalise(study, cells, dict(zip(ordered, done, strict=True)), provenance(seed, engine=engine))
    figures = plot_figure3(result.tracks, out)
    result = replace(result, files=tuple(str(path) for path in (out / RESULT_FILE, out / TABLE_FILE, *figures)))
    write_text(out / TABLE_FILE, markdown(result))
    write_json(out / RESULT_FILE, result)
    output.result(result, *tables(result))


def _study(
    models: str | None,
    strategists: str | None,
    races: int,
    races_of: str,
    seed: int,
    driver: str | None,
    tracks: str | None,
    cars: str,
    cars_by: str | None,
    held_out: bool,
) -> "Study":
    from rsrl.evaluation.study import Study, default_strategists, first_race_apart, make_entrants, race_of_track

    fewer = {name: _count(name, text) for name, text in _pairs("--races-of", races_of)}
    wanted = default_strategists() if strategists is None else _words(strategists)
    entrants = make_entrants(_models(models), wanted, races, fewer)
    called = tuple(dict.fromkeys(race_of_track(track) for track in (STUDY_TRACKS if tracks is None else _words(tracks))))
    cars_at = tuple(race_of_track(track) for track in _words(cars))
    names = [entrant.name for entrant in entrants]
    by = [e.name for e in entrants if e.is_model or e.name in CARS_BY] if cars_by is None else _words(cars_by)
    for name in by:
        if name not in names:
            raise RsrlError(f"--cars-by {name}: takes no part in the study; there are {', '.join(names)}")
    for race in cars_at:
        if race not in called:
            raise RsrlError(f"--cars {race}: not among the study's races; add it to --tracks")
    if not called:
        raise RsrlError("--tracks names no track; leave it out for the paper's 14")
    return Study(
        entrants=entrants,
        races=called,
        driver=driver,
        seed=seed,
        first_race=first_race_apart(entrants, seed),
        cars_at=cars_at,
        cars_by=tuple(by),
        held_out=held_out_races() if held_out else (),
    )


def _models(text: str | None) -> dict[str, str]:
    """Places of models by name. None: the policies shipped under the names of groups."""
    if text is not None:
        return dict(_pairs("--models", text, alone=True))
    from rsrl.strategists.policy import policies_folder

    shipped = {name: name for name in GROUPS if (policies_folder() / name).is_dir()}
    if not shipped:
        raise RsrlError("no model is shipped for a group of races; name models with --models NAME=FOLDER, or none with --models ''")
    return shipped


def _pairs(option: str, text: str, *, alone: bool = False) -> list[tuple[str, str]]:
    """`a=b,c=d`; with `alone`, `a` is short for `a=a`. Raises RsrlError where it does not parse or a name comes twice."""
    pairs: list[tuple[str, str]] = []
    for word in _words(text):
        name, sign, value = (part.strip() for part in word.partition("="))
        if not name or (sign and not value) or not (sign or alone):
            raise RsrlError(f"{option} {word!r} does not parse; write {'NAME=FOLDER' if alone else 'NAME=N'}, several with commas between")
        if name in dict(pairs):
            raise RsrlError(f"{option}: {name} is there twice; give each a name of its own")
        pairs.append((name, value or name))
    return pairs


def _count(name: str, text: str) -> int:
    if not text.isdecimal() or int(text) < 2:
        raise RsrlError(f"--races-of {name}={text}: write a number of races, two at least")
    return int(text)


def _words(text: str) -> list[str]:
    return list(dict.fromkeys(word.strip() for word in text.split(",") if word.strip()))
