"""`rsrl calibrate`: season files fitted to real laps."""

import re
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rsrl.cli.files import make_folder, refuse_overwrite
from rsrl.cli.options import ForceOption, JsonOption, LapsOption, WideOption, parse_seasons
from rsrl.cli.output import Column, FittedTable, Output, table
from rsrl.cli.progress import progress
from rsrl.cli.provenance import cores, provenance
from rsrl.cli.season_files import Together
from rsrl.errors import RsrlError
from rsrl.season import RaceRecord, grand_prix_of, race_hash, resolve_race
from rsrl.season.circuits import GRANDS_PRIX

if TYPE_CHECKING:
    from rsrl.calibration import Calibration, Diagnosis

NameArgument = Annotated[
    str | None,
    typer.Argument(metavar="[RACE]", help="Write this race only, by Grand Prix and season, such as bahrain-2023; else every race."),
]
FactsOption = Annotated[
    Path | None,
    typer.Option(
        "--facts", metavar="FOLDER", help="Folder with results, nominations and safety cars; without it, grids are those of lap 1."
    ),
]
SeasonsOption = Annotated[
    str | None,
    typer.Option(
        "--seasons",
        metavar="YEARS",
        help="Seasons to fit to, such as 2022,2023. Default: the race's season, and the one before where there is a lap file of it.",
    ),
]
OnlyOption = Annotated[
    str | None, typer.Option("--only", metavar="YEARS", help="Write only races of these seasons, out of --seasons. Default: all.")
]
OutOption = Annotated[
    Path | None,
    typer.Option("--out", metavar="PATH", help="Folder to write to; for one race also a .toml file, or nothing: the current folder."),
]


def command(
    laps: LapsOption,
    race: NameArgument = None,
    facts: FactsOption = None,
    seasons: SeasonsOption = None,
    only: OnlyOption = None,
    out: OutOption = None,
    force: ForceOption = False,
    wide: WideOption = False,
    json: JsonOption = False,
) -> None:
    """Fit the figures of races to real laps and write season files.

    Every race is analysed by itself. Its figures (fuel, tyre wear, pace, noise,
    starts, pit stops, traffic, safety cars, retirements) are then pooled over
    tracks, seasons, teams and compounds: a track with few laps leans on the
    others and has larger standard errors. A wet race is written with the
    figures of a dry race there, and marked as wet. Other commands take the
    path of a season file in place of a race's name.

    One race is enough to fit to, and a track, team or driver need not be known:
    what the laps do not tell is taken from how such figures differ elsewhere,
    with standard errors as wide. Files are written together or not at all.

    [bold]Examples[/bold]

    rsrl calibrate --laps data/laps --facts data/facts --seasons 2022,2023 --out my-races
    rsrl calibrate bahrain-2023 --laps data/laps --facts data/facts
    rsrl calibrate --laps data/laps --seasons 2022,2023,2024 --only 2024 --out my-races --json
    """
    from rsrl.calibration import calibrate

    output = Output(json, wide)
    race = _race_name(race, laps) if race is not None else None
    years = _years(race, seasons, laps)
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
    with Together(path) as files, progress(output, "Writing season files") as report:
        for i, name in enumerate(names):
            record = _scaled(found.record(name))
            files.write(record, f"{name}.toml")
            rows.append((found.diagnosis(record), race_hash(record)))
            report(i + 1, len(names))
    output.result(_as_json(found, path, rows, years), overview_table([d for d, _ in rows]))
    output.note(f"{len(rows)} season files written to {path}")


def _write_one(output: Output, found: "Calibration", race: str, path: Path) -> None:
    """Write one race and list all its figures."""
    from rsrl.calibration import figure_table

    record = _scaled(found.record(race))
    with Together(path.parent) as files:
        files.write(record, path.name)
    figures = figure_table(record)
    analysis = found.find(race)
    diagnosis = found.diagnosis(record)
    shared = [row for row in figures.iter_rows() if not row[0].startswith("cars.")]
    result = _as_json(found, path, [(diagnosis, race_hash(record))], tuple(sorted({a.entry.season for a in found.analyses})))
    output.result(
        {**result, "race": record.name, "file": path, "attrition": analysis.attrition.to_dicts(), "figures": figures.to_dicts()},
        table("Laps of this race: what each filter removed", analysis.attrition.columns, analysis.attrition.iter_rows()),
        table("Figures", ("figure", "value", "+-", "n"), [(n, f"{v:.4g}", f"{se:.2g}", size) for n, v, se, size, _ in shared]),
        table(
            "Pace against the average car",
            ("driver", "team", "grid", "s a lap", "+-", "races"),
            [(c.driver, c.team, c.grid, f"{c.pace_s.value:+.3f}", f"{c.pace_s.se:.3f}", c.pace_s.n) for c in record.cars],
            left=2,
        ),
    )
    output.note("\n".join((*(f"{record.name}: {warning}" for warning in diagnosis.warnings), f"Written to {path}")))


def _scaled(record: RaceRecord) -> RaceRecord:
    """With the scaling of features, from simulated races; a wet race cannot be simulated and has none."""
    from rsrl.environment import with_scaling

    return record if record.wet else with_scaling(record)


def _years(race: str | None, seasons: str | None, laps: Path) -> tuple[int, ...]:
    """The seasons given, else that of the race, and the one before where the folder has it."""
    from rsrl.laps import season_file

    if seasons is not None:
        return parse_seasons("--seasons", seasons)
    if race is None:
        raise RsrlError("no season given; name some with --seasons, such as 2022,2023, or one race, such as bahrain-2023")
    year = int(race.rpartition("-")[2])
    return (year - 1, year) if season_file(laps, year - 1).is_file() else (year,)


def _race_name(text: str, laps: Path) -> str:
    """Name of the race that a text means: of any Grand Prix and season in the table of circuits, or in the lap file of its season.

    Raises:
        RsrlError: it means none, or several.
    """
    from rsrl.laps import events_of_season

    seasons = [int(year) for year in dict.fromkeys(re.findall(r"(?<!\d)\d{4}(?!\d)", text))]
    if not seasons:
        raise RsrlError(f"race {text!r} has no season; name it by Grand Prix and season, such as bahrain-2023")
    run = {f"{grand_prix_of(event)}-{season}": None for season in seasons for event in events_of_season(laps, season)}
    return resolve_race(text, list(run or {f"{grand_prix}-{season}": None for season in seasons for grand_prix in GRANDS_PRIX}))


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
            raise RsrlError("no folder given for the season files; name one with --out")
        return out
    name = f"{race}.toml"
    if out is None:
        return Path(name)
    return out if out.suffix == ".toml" and not out.is_dir() else out / name


def _remake(laps: Path, facts: Path | None, years: tuple[int, ...]) -> str:
    """The command that makes the same figures again; where it writes them is left out."""
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


def overview_table(rows: "list[Diagnosis]") -> FittedTable:
    """Diagnostics and main figures, a line for each race written."""
    columns = (
        "race", Column("warnings", words=True), "laps", Column("residual", 2), Column("worst", 4), Column("base lap", 3), "wear S",
        "wear M", "wear H", Column("pit loss", 1), Column("SC a race", 5),
    )  # fmt: skip
    return table("Races (seconds; pooled figures)", columns, [_row(d) for d in rows], left=2)


def _row(d: "Diagnosis") -> tuple[object, ...]:
    def shown(value: float | None) -> str:
        return "-" if value is None else f"{value:.2f}"

    wear = tuple(f"{w:.3f}" for w in d.wear_s)
    return (
        d.race,
        ", ".join(d.warnings),
        d.laps_used or "-",
        shown(d.residual_sd_s),
        shown(d.worst_s),
        f"{d.base_lap_s:.2f}",
        *wear,
        f"{d.pit_loss_s:.1f}",
        shown(d.sc_per_race),
    )
