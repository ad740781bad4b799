"""`rsrl races`: the races that RSRL has season files for."""

from typing import Annotated

import typer

from rsrl.cli.options import JsonOption, WideOption
from rsrl.cli.output import Column, Output, table
from rsrl.errors import RsrlError
from rsrl.season import race_heads

SeasonArgument = Annotated[int | None, typer.Argument(metavar="[SEASON]", help="List the races of this season only, such as 2023.")]


def command(season: SeasonArgument = None, wide: WideOption = False, json: JsonOption = False) -> None:
    """List the races that RSRL has season files for, by season and round.

    The first column is the name that other commands take. The default driver
    is the driver that other commands call for unless --driver names another.
    Wet races are listed too, but cannot be simulated: there is no model of
    wet weather.

    [bold]Examples[/bold]

    rsrl races
    rsrl races 2023
    rsrl races --json
    """
    every = race_heads()
    heads = [head for head in every if season in (None, head.season)]
    if not heads:
        seasons = sorted({head.season for head in every})
        raise RsrlError(f"no races of {season}; there are seasons {', '.join(map(str, seasons))}")
    columns = ("race", "event", Column("season", 3), Column("round", 2), "laps", Column("weather", 1), "default driver")
    cells = [(h.name, h.event, h.season, h.round, h.laps, "wet" if h.wet else "dry", h.default_driver) for h in heads]
    rows = [{"race": h.name, **{k: v for k, v in h._asdict().items() if k != "name"}} for h in heads]
    Output(json, wide).result({"races": rows}, table("Races", columns, cells, left=2))
