"""Options that `rsrl replay` and `rsrl live` share."""

from typing import Annotated

import typer

DriverOption = Annotated[
    str | None,
    typer.Option("--driver", metavar="NAME", help="The driver whose car is called: HAM, 44, hamilton. Default: the race's default driver."),
]
ModelOption = Annotated[
    str | None,
    typer.Option("--model", metavar="MODEL", help="The policy: a shipped one, a run folder, model.zip or module:function. Default: all."),
]
SeasonFromOption = Annotated[
    str | None,
    typer.Option("--season-from", metavar="RACE", help="A race or season file whose figures stand for those of a race that has none."),
]
