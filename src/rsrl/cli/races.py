"""`rsrl races`: the races there are figures for."""

from rsrl.cli.options import JsonOption
from rsrl.cli.output import Output, table
from rsrl.season import race_heads


def command(json: JsonOption = False) -> None:
    """List the races there are figures for, in order of season and round.

    The first column is the name that every other command takes. The
    default driver is the one a race is called for unless --driver says
    otherwise. Wet races are listed for who started; there is no
    wet-weather model to simulate them with.

    [bold]Examples[/bold]

    rsrl races
    rsrl races --json
    """
    heads = race_heads()
    columns = ("race", "event", "season", "round", "laps", "weather", "default driver")
    cells = [(h.name, h.event, h.season, h.round, h.laps, "wet" if h.wet else "dry", h.default_driver) for h in heads]
    rows = [{"race": h.name, **{k: v for k, v in h._asdict().items() if k != "name"}} for h in heads]
    Output(json).result({"races": rows}, table("Races", columns, cells, left=2))
