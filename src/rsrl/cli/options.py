"""Arguments and options that several commands share, declared once so that they read and behave the same everywhere."""

from pathlib import Path
from typing import Annotated

import typer

from rsrl.errors import RsrlError

MAX_RACES = 1_000_000

RaceArgument = Annotated[
    str, typer.Argument(metavar="RACE", help="A race such as bahrain-2023 (rsrl races lists them), or the path of a season file.")
]
ModelArgument = Annotated[
    str,
    typer.Argument(
        metavar="MODEL", help="A policy shipped with RSRL (all for any race, or bahrain-2023), or the folder of a training run."
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
    typer.Option("--driver", metavar="CODE", help="The driver whose car is called, such as HAM. Default: the race's default driver."),
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


def parse_seasons(option: str, text: str) -> tuple[int, ...]:
    """Seasons from a list such as `2022,2023`, in ascending order; raises RsrlError where the text is not a list of years."""
    years = [word.strip() for word in text.split(",")]
    if not all(len(year) == 4 and year.isdecimal() for year in years):
        raise RsrlError(f"{option} {text!r} does not parse; write years with commas between them, such as 2022,2023")
    return tuple(sorted({int(year) for year in years}))
