"""`rsrl races`: the races that RSRL has season files for."""

from rsrl.cli.options import JsonOption
from rsrl.cli.output import Output, table
from rsrl.season import race_heads


def command(json: JsonOption = False) -> None:
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
    columns = ("race", "event", "season", "round", "laps", "weather", "default driver")
    cells = [(h.name, h.event, h.season, h.round, h.laps, "wet" if h.wet else "dry", h.default_driver) for h in heads]
    rows = [{"race": h.name, **{k: v for k, v in h._asdict().items() if k != "name"}} for h in heads]
    Output(json).result({"races": rows}, table("Races", columns, cells, left=2))
