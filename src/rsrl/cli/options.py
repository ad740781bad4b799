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


def parse_seasons(text: str) -> tuple[int, ...]:
    """Seasons of a list such as `2022,2023`, in order; raises RsrlError for what is no year."""
    words = [word.strip() for word in text.split(",") if word.strip()]
    wrong = [word for word in words if not (word.isdigit() and 1950 <= int(word) <= 2100)]
    if wrong or not words:
        raise RsrlError(f"seasons {text!r}: {wrong[0] if wrong else 'nothing'!r} is no season; give years such as 2022,2023")
    return tuple(sorted({int(word) for word in words}))
