"""`rsrl races`: the races there are figures for."""

from rsrl.cli.options import JsonOption
from rsrl.cli.output import Output, table
from rsrl.season import RaceRecord, load_race, race_names


def command(json: JsonOption = False) -> None:
    """List the races there are figures for, in order of season and round.

    The first column is the name that every other command takes. The
    default driver is the one a race is called for unless --driver says
    otherwise.

    [bold]Examples[/bold]

    rsrl races
    rsrl races --json
    """
    rows = [_row(load_race(name)) for name in race_names()]
    columns = ("race", "event", "season", "round", "laps", "weather", "default driver")
    cells = [(r["race"], r["event"], r["season"], r["round"], r["laps"], "wet" if r["wet"] else "dry", r["default_driver"]) for r in rows]
    Output(json).result({"races": rows}, table("Races", columns, cells, left=2))


def _row(record: RaceRecord) -> dict[str, object]:
    return {
        "race": record.name,
        "season": record.season,
        "round": record.round,
        "event": record.event,
        "laps": record.laps,
        "wet": record.wet,
        "default_driver": record.default_driver,
    }
