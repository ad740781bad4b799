"""`rsrl calibrate`: real laps in, season files out."""

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rsrl.cli.files import make_folder, refuse_overwrite
from rsrl.cli.options import ForceOption, JsonOption, LapsOption, parse_seasons
from rsrl.cli.output import Output, table
from rsrl.cli.progress import progress
from rsrl.cli.provenance import cores, provenance
from rsrl.errors import RsrlError
from rsrl.season import RaceRecord, race_hash, write_race

if TYPE_CHECKING:
    from rich.table import Table

    from rsrl.calibration import Calibration, Diagnosis

NameArgument = Annotated[
    str | None,
    typer.Argument(metavar="[RACE]", help="The one race to write, Grand Prix and season, such as bahrain-2023; else every race."),
]
FactsOption = Annotated[
    Path | None,
    typer.Option("--facts", metavar="FOLDER", help="Folder of results, nominations and safety cars; else grids are taken from lap 1."),
]
SeasonsOption = Annotated[
    str | None,
    typer.Option("--seasons", metavar="YEARS", help="Seasons whose laps are used, such as 2022,2023; else the race's and the one before."),
]
OnlyOption = Annotated[
    str | None, typer.Option("--only", metavar="YEARS", help="Of these, the seasons whose races are written; else all of them.")
]
OutOption = Annotated[
    Path | None, typer.Option("--out", metavar="PATH", help="The folder to write to, or for one race file.toml; else this folder.")
]


def command(
    laps: LapsOption,
    race: NameArgument = None,
    facts: FactsOption = None,
    seasons: SeasonsOption = None,
    only: OnlyOption = None,
    out: OutOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Fit the figures of whole seasons to real laps and write their season files.

    Every race is analysed by itself; what they say of fuel, tyre wear, pace,
    noise, starts, pit stops, traffic, safety cars and retirements is then
    pooled over tracks, seasons, teams and compounds, so that a track with
    few laps leans on the others and says so in its standard errors. Wet
    races are written with what a dry one would be there, and marked. Other
    commands take a file's path in place of a race's name.

    [bold]Examples[/bold]

    rsrl calibrate --laps data/laps --facts data/facts --seasons 2022,2023 --out my-races
    rsrl calibrate bahrain-2023 --laps data/laps --facts data/facts
    rsrl calibrate --laps data/laps --seasons 2022,2023,2024 --only 2024 --out my-races --json
    """
    from rsrl.calibration import calibrate

    output = Output(json)
    years = _years(race, seasons)
    written = _only(only, years)
    path = _target(race, out)
    refuse_overwrite(path, force)
    make_folder(path if race is None else path.parent)
    with progress(output, f"Analysing {' and '.join(map(str, years))}") as report:
        found = calibrate(laps, facts, years, _remake(laps, facts, years), report, workers=min(cores(), 4))
    if race is not None:
        _write_one(output, found, race, path)
        return
    rows = []
    names = found.names(written)
    with progress(output, "Writing season files") as report:
        for i, name in enumerate(names):
            record = _scaled(found.record(name))
            write_race(record, path / f"{name}.toml")
            rows.append((found.diagnosis(record), race_hash(record)))
            report(i + 1, len(names))
    output.result(_as_json(found, path, rows, years), _overview([d for d, _ in rows]))
    output.note(f"{len(rows)} season files written to {path}")


def _write_one(output: Output, found: "Calibration", race: str, path: Path) -> None:
    """One race, every figure told."""
    from rsrl.calibration import figure_table

    record = _scaled(found.record(race))
    write_race(record, path)
    figures = figure_table(record)
    analysis = found.find(race)
    of_field = [row for row in figures.iter_rows() if not row[0].startswith("cars.")]
    result = _as_json(found, path, [(found.diagnosis(record), race_hash(record))], tuple(sorted({a.entry.season for a in found.analyses})))
    output.result(
        {**result, "race": record.name, "file": path, "attrition": analysis.attrition.to_dicts(), "figures": figures.to_dicts()},
        table("Laps of this race: what each filter removed", analysis.attrition.columns, analysis.attrition.iter_rows()),
        table("Figures", ("figure", "value", "+-", "n"), [(n, f"{v:.4g}", f"{se:.2g}", size) for n, v, se, size, _ in of_field]),
        table(
            "Pace against the average car",
            ("driver", "team", "grid", "s a lap", "+-", "races"),
            [(c.driver, c.team, c.grid, f"{c.pace_s.value:+.3f}", f"{c.pace_s.se:.3f}", c.pace_s.n) for c in record.cars],
            left=2,
        ),
    )
    output.note(f"Written to {path}")


def _scaled(record: RaceRecord) -> RaceRecord:
    """With the working ranges of the features, which come from simulated races; a wet race cannot be simulated and has none."""
    from rsrl.environment import with_scaling

    return record if record.wet else with_scaling(record)


def _years(race: str | None, seasons: str | None) -> tuple[int, ...]:
    """The seasons typed, or that of the race and the one before."""
    if seasons is not None:
        return parse_seasons("--seasons", seasons)
    if race is None:
        raise RsrlError("no season given; name some with --seasons, such as 2022,2023, or one race, such as bahrain-2023")
    year = race.rpartition("-")[2]
    if not year.isdecimal():
        raise RsrlError(f"race {race!r} has no season; name it by Grand Prix and season, such as bahrain-2023")
    return int(year) - 1, int(year)


def _only(only: str | None, years: tuple[int, ...]) -> tuple[int, ...]:
    if only is None:
        return years
    wanted = parse_seasons("--only", only)
    if not set(wanted) <= set(years):
        raise RsrlError(f"--only {only!r}: races can be written of the seasons {', '.join(map(str, years))}; add others with --seasons")
    return wanted


def _target(race: str | None, out: Path | None) -> Path:
    if race is None:
        if out is None:
            raise RsrlError("no place given for the season files; name a folder with --out")
        return out
    name = f"{race}.toml"
    if out is None:
        return Path(name)
    return out if out.suffix == ".toml" and not out.is_dir() else out / name


def _remake(laps: Path, facts: Path | None, years: tuple[int, ...]) -> str:
    """The command that makes the same figures again, wherever they go."""
    words = ["rsrl", "calibrate", "--seasons", ",".join(map(str, years)), "--laps", str(laps)]
    return shlex.join(words if facts is None else [*words, "--facts", str(facts)])


def _as_json(found: "Calibration", path: Path, rows: "list[tuple[Diagnosis, str]]", years: tuple[int, ...]) -> dict[str, Any]:
    return {
        "folder": path,
        "seasons": years,
        "laps_read": found.provenance.laps_read,
        "laps_used": found.provenance.laps_used,
        "races": [{**d._asdict(), "season_hash": digest} for d, digest in rows],
        "provenance": provenance(None),
    }


def _overview(rows: "list[Diagnosis]") -> "Table":
    columns = ("race", "warnings", "laps", "residual", "worst", "base lap", "wear S", "M", "H", "pit loss", "SC a race")
    return table("Races (seconds; pooled figures)", columns, [_row(d) for d in rows], left=2)


def _row(d: "Diagnosis") -> tuple[object, ...]:
    def told(value: float | None) -> str:
        return "-" if value is None else f"{value:.2f}"

    wear = tuple(f"{w:.3f}" for w in d.wear_s)
    said = ", ".join(d.warnings)
    return (
        d.race,
        said,
        d.laps_used or "-",
        told(d.residual_sd_s),
        told(d.worst_s),
        f"{d.base_lap_s:.2f}",
        *wear,
        f"{d.pit_loss_s:.1f}",
        told(d.sc_per_race),
    )
