"""Options that mean the same in every command."""

from typing import Annotated

import typer

from rsrl.errors import RsrlError

RaceArgument = Annotated[
    str,
    typer.Argument(metavar="RACE", help="A race such as bahrain-2023 (rsrl races lists them), or the path of a season file, file.toml."),
]
DriverOption = Annotated[
    str | None,
    typer.Option("--driver", metavar="CODE", help="The driver we call the race for, such as HAM; else the race's default driver."),
]
SeedOption = Annotated[
    int,
    typer.Option(
        "--seed", metavar="N", min=0, max=2**32 - 1, help="Names the races drawn: the same seed gives the same races, bit for bit."
    ),
]
ThreadsOption = Annotated[
    int | None,
    typer.Option("--threads", metavar="N", min=1, help="Threads to use; else one for each core. Results do not depend on it."),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the result as JSON, alone on standard output.")]
ForceOption = Annotated[bool, typer.Option("--force", help="Overwrite what is already there.")]


def parse_seasons(option: str, text: str) -> tuple[int, ...]:
    """Seasons of a list such as `2022,2023`, in order; raises RsrlError naming the option for what is no list of years."""
    years = [word.strip() for word in text.split(",")]
    if not all(len(year) == 4 and year.isdecimal() for year in years):
        raise RsrlError(f"{option} {text!r} does not parse; write years with commas between them, such as 2022,2023")
    return tuple(sorted({int(year) for year in years}))
