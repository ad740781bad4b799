"""`rsrl races`: the races that RSRL has season files for."""

from rsrl.cli.options import JsonOption, WideOption
from rsrl.cli.output import Column, Output, table
from rsrl.season import race_heads


def command(wide: WideOption = False, json: JsonOption = False) -> None:
    """List the races that RSRL has season files for, by season and round.

    The first column is the name that other commands take. The default driver
    is the driver that other commands call for unless --driver names another.
    Wet races are listed too, but cannot be simulated: there is no model of
    wet weather.

    [bold]Examples[/bold]

    rsrl races
    rsrl races --json
    """
    heads = race_heads()
    columns = ("race", "event", Column("season", 3), Column("round", 2), "laps", Column("weather", 1), "default driver")
    cells = [(h.name, h.event, h.season, h.round, h.laps, "wet" if h.wet else "dry", h.default_driver) for h in heads]
    rows = [{"race": h.name, **{k: v for k, v in h._asdict().items() if k != "name"}} for h in heads]
    Output(json, wide).result({"races": rows}, table("Races", columns, cells, left=2))
