"""`rsrl calibrate`: real laps in, a season file out."""

import shlex
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rsrl.cli.files import make_folder, refuse_overwrite
from rsrl.cli.options import ForceOption, JsonOption
from rsrl.cli.output import Output, table
from rsrl.cli.progress import steps
from rsrl.cli.provenance import provenance
from rsrl.errors import RsrlError
from rsrl.season import race_hash, write_race

if TYPE_CHECKING:
    from rich.table import Table

    from rsrl.calibration import CalibrationResult

NameArgument = Annotated[str, typer.Argument(metavar="RACE", help="The race to fit, Grand Prix and season, such as bahrain-2023.")]
LapsOption = Annotated[Path, typer.Option("--laps", metavar="FOLDER", help="Folder of the lap files, laps_<season>.csv.gz.")]
FactsOption = Annotated[
    Path | None,
    typer.Option("--facts", metavar="FOLDER", help="Folder of results and published strategies; else the grid is taken from lap 1."),
]
SeasonsOption = Annotated[
    str | None,
    typer.Option("--seasons", metavar="YEARS", help="Seasons whose laps are used, such as 2022,2023; else the race's and the one before."),
]
OutOption = Annotated[
    Path | None,
    typer.Option("--out", metavar="PATH", help="The file.toml to write, or a folder; else RACE.toml in this folder."),
]


def command(
    race: NameArgument,
    laps: LapsOption,
    facts: FactsOption = None,
    seasons: SeasonsOption = None,
    out: OutOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Fit a race's figures to real laps and write its season file.

    Fuel, tyre wear, pace of cars and drivers, noise, start, pit stops,
    traffic, safety cars, retirements and what teams ran: each an estimate
    with standard error and sample size, in a TOML file that says how it was
    made. Other commands take the file's path in place of a race's name.

    [bold]Examples[/bold]

    rsrl calibrate bahrain-2023 --laps data/laps --facts data/facts
    rsrl calibrate bahrain-2023 --laps data/laps --seasons 2023 --out my-races
    rsrl calibrate bahrain-2023 --laps data/laps --force --json
    """
    from rsrl.calibration import calibrate_race
    from rsrl.environment import with_scaling

    output = Output(json)
    years = _years(race, seasons)
    path = _target(race, out)
    refuse_overwrite(path, force)
    make_folder(path.parent)
    with steps(output, f"Calibrating {race}") as step:
        result = calibrate_race(race, laps, facts, years, _remake(race, laps, facts, years), step)
        step("working ranges of the features, from simulated races")
        result = replace(result, record=with_scaling(result.record))
    write_race(result.record, path)
    output.result(_as_json(result, path, years), *_tables(result))
    if not json:
        output.note(f"Written to {path}")


def _years(race: str, seasons: str | None) -> tuple[int, ...]:
    """The seasons typed, or that of the race and the one before."""
    if seasons is None:
        year = race.rpartition("-")[2]
        if not year.isdecimal():
            raise RsrlError(f"race {race!r} has no season; name it by Grand Prix and season, such as bahrain-2023")
        return int(year) - 1, int(year)
    years = [word.strip() for word in seasons.split(",")]
    if not all(len(year) == 4 and year.isdecimal() for year in years):
        raise RsrlError(f"--seasons {seasons!r} does not parse; write years with commas between them, such as 2022,2023")
    return tuple(sorted({int(year) for year in years}))


def _target(race: str, out: Path | None) -> Path:
    name = f"{race}.toml"
    if out is None:
        return Path(name)
    return out if out.suffix == ".toml" and not out.is_dir() else out / name


def _remake(race: str, laps: Path, facts: Path | None, years: tuple[int, ...]) -> str:
    """The command that makes the same figures again, wherever they go."""
    words = ["rsrl", "calibrate", race, "--seasons", ",".join(map(str, years)), "--laps", str(laps)]
    return shlex.join(words if facts is None else [*words, "--facts", str(facts)])


def _as_json(result: "CalibrationResult", path: Path, years: tuple[int, ...]) -> dict[str, Any]:
    record = result.record
    return {
        "race": record.name,
        "file": path,
        "season_hash": race_hash(record),
        "seasons": years,
        "laps_read": record.provenance.laps_read,
        "laps_used": record.provenance.laps_used,
        "residual_sd_s": result.residual_sd_s,
        "attrition": result.attrition.to_dicts(),
        "figures": result.figures.to_dicts(),
        "provenance": provenance(None),
    }


def _tables(result: "CalibrationResult") -> "list[Table]":
    record = result.record
    of_field = [row for row in result.figures.iter_rows() if not row[0].startswith("cars.")]
    return [
        table("Laps: what each filter removed", result.attrition.columns, result.attrition.iter_rows()),
        table("Figures", ("figure", "value", "+-", "n"), [(n, f"{v:.4g}", f"{se:.2g}", size) for n, v, se, size, _ in of_field]),
        table(
            f"Pace against the average car (residual {result.residual_sd_s:.2f} s)",
            ("driver", "team", "grid", "s a lap", "+-", "laps"),
            [(c.driver, c.team, c.grid, f"{c.pace_s.value:+.3f}", f"{c.pace_s.se:.3f}", c.pace_s.n) for c in record.cars],
            left=2,
        ),
    ]
