"""Arguments and options that several commands share, declared once so that they read and behave the same everywhere."""

from pathlib import Path
from typing import Annotated

import typer

from rsrl.cli.provenance import remember_assumptions
from rsrl.errors import RsrlError
from rsrl.season import RaceRecord, assume, parse_sets

MAX_RACES = 1_000_000

RaceArgument = Annotated[
    str,
    typer.Argument(
        metavar="RACE",
        help="A race by Grand Prix, circuit or country, such as bahrain-2023, monza-2023 or uk (rsrl races lists them), or a season file.",
    ),
]
ModelArgument = Annotated[
    str,
    typer.Argument(
        metavar="MODEL", help="A policy shipped with RSRL (all for any race, or bahrain-2023), or the folder of a training run."
    ),
]
AnyPolicyArgument = Annotated[
    str,
    typer.Argument(
        metavar="MODEL",
        help="A shipped policy such as all, the folder of a training run, a file of Stable-Baselines3 (model.zip), or module:function.",
    ),
]
RaceOption = Annotated[
    str | None,
    typer.Option(
        "--race",
        metavar="RACE",
        help="The race, or the path of a season file. Default: the race of training, or bahrain-2023 for a model of several races.",
    ),
]
DriverOption = Annotated[
    str | None,
    typer.Option(
        "--driver",
        metavar="NAME",
        help="The driver whose car is called, by code, number or surname: HAM, 44, hamilton. Default: the race's default driver.",
    ),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help="Change an assumption: pit_loss_s=+1, wear.S=x1.2, sc_chance=0, grid.HAM=3. Repeatable; an unknown name lists all.",
    ),
]
SetsOption = Annotated[
    list[str] | None,
    typer.Option(
        "--sets",
        metavar="S3M2H2",
        help="Sets of soft, medium and hard, of all cars or of one: HAM=S1M2H2. S1S2u3: a new soft, two used 3 laps. Repeatable.",
    ),
]
CalledRacesOption = Annotated[
    int, typer.Option("--races", metavar="N", min=1, max=MAX_RACES, help="Number of races that each strategist calls.")
]
SeedOption = Annotated[
    int,
    typer.Option(
        "--seed", metavar="N", min=0, max=2**32 - 1, help="Seed of the simulated races. The same seed gives the same races, bit for bit."
    ),
]
ThreadsOption = Annotated[
    int | None,
    typer.Option("--threads", metavar="N", min=1, help="Number of threads; it does not change the results. Default: one for each core."),
]
LapsOption = Annotated[Path, typer.Option("--laps", metavar="FOLDER", help="Folder with the lap files, laps_<season>.csv.gz.")]
OutFolderOption = Annotated[
    Path | None, typer.Option("--out", metavar="FOLDER", help="Folder for the result files. Default: nothing is written.")
]
ForceOption = Annotated[bool, typer.Option("--force", help="Overwrite existing files.")]
WideOption = Annotated[bool, typer.Option("--wide", help="Show every column of the tables, however narrow the terminal is.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the result as JSON on standard output, and nothing else.")]


def assumed(record: RaceRecord, changes: list[str] | None, sets: list[str] | None) -> RaceRecord:
    """The record as --set and --sets change it; the result's provenance and tables will say so. Raises RsrlError as `season.assume`."""
    every = (*(changes or ()), *parse_sets(sets or ()))
    changed = assume(record, every)
    remember_assumptions(every)
    return changed


def parse_seasons(option: str, text: str) -> tuple[int, ...]:
    """Seasons from a list such as `2022,2023`, in ascending order; raises RsrlError where the text is not a list of years."""
    years = [word.strip() for word in text.split(",")]
    if not all(len(year) == 4 and year.isdecimal() for year in years):
        raise RsrlError(f"{option} {text!r} does not parse; write years with commas between them, such as 2022,2023")
    return tuple(sorted({int(year) for year in years}))
