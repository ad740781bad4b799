"""Reader of `laps_<season>.csv` and `.csv.gz`: one row per driver and lap of every Grand Prix of a season."""

import gzip
import hashlib
import zlib
from pathlib import Path
from typing import Final

import polars as pl

from rsrl.errors import RsrlError
from rsrl.laps.cleaning import BROKEN_RACES
from rsrl.laps.schema import LAP_SCHEMA, RACE, check_table, compound_letters

_RENAMED: Final = {"tyre_life_laps": "tyre_life", "pit_in_s": "pit_in", "pit_out_s": "pit_out"}
FEWEST_LAPS: Final = 10
"""With fewer, the file holds a piece of a race, or a race that was abandoned."""

_FIRST_ROW: Final = 2  # row 1 of the file is its header


def read_lap_csv(path: Path) -> pl.DataFrame:
    """Read a lap file into the lap table (`LAP_SCHEMA`).

    Raises:
        RsrlError: the file is missing, truncated, empty, lacks a column, or holds a value of the
            wrong type; the message names file, row, column and remedy.
    """
    raw = _read_text(path)
    try:
        text = pl.read_csv(raw, infer_schema=False)
    except pl.exceptions.PolarsError as error:
        reason = str(error).splitlines()[0]
        raise RsrlError(f"{path}: is not a readable CSV ({reason}); give a laps_<season>.csv.gz file") from None
    wanted = [_RENAMED.get(name, name) for name in LAP_SCHEMA]
    missing = [name for name in wanted if name not in text.columns]
    if missing:
        raise RsrlError(f"{path}: column {', '.join(missing)} is missing; a lap file has the columns {', '.join(wanted)}")
    columns = [_typed(text, name, kind, path) for name, kind in LAP_SCHEMA.items()]
    return check_table(pl.DataFrame(columns), str(path), _FIRST_ROW)


def read_seasons(folder: Path, seasons: tuple[int, ...]) -> pl.DataFrame:
    """The lap tables of several seasons from `folder`, stacked; raises RsrlError as `read_lap_csv` does."""
    if not seasons:
        raise RsrlError("no season given; name at least one, for instance 2023")
    return pl.concat([_read_season(folder, s) for s in seasons])


def refuse_hardly_run(table: pl.DataFrame, folder: Path) -> None:
    """Raise RsrlError where a race of the table, read by `read_seasons`, is too short to be one; known broken races may be."""
    runs = table.group_by(*RACE).agg(pl.col("lap").max(), pl.len(), pl.col("event").first()).sort(*RACE)
    for season, number, laps, rows, event in runs.iter_rows():
        if laps < FEWEST_LAPS and (season, number) not in BROKEN_RACES:
            path = season_file(folder, season)
            rounds = pl.read_csv(_read_text(path), columns=["round"], infer_schema=False)["round"].cast(pl.Float64, strict=False)
            row = int((rounds == number).arg_true()[0]) + _FIRST_ROW
            raise RsrlError(
                f"{path}: row {row}: round {number} ({event}) ends after lap {laps}, with {rows} rows;"
                " give the whole race, or take its rows out"
            )


def events_of_season(folder: Path, season: int) -> list[str]:
    """Names of the Grands Prix in the lap file of a season, in order; none where the file is not there or cannot be read."""
    try:
        events = pl.read_csv(_read_text(season_file(folder, season)), columns=["event"], infer_schema=False)["event"]
    except (RsrlError, pl.exceptions.PolarsError):
        return []
    return events.drop_nulls().unique(maintain_order=True).to_list()


def _read_season(folder: Path, season: int) -> pl.DataFrame:
    path = season_file(folder, season)
    table = read_lap_csv(path)
    foreign = table.filter(pl.col("season") != season)
    if foreign.height:
        found = pl.read_csv(_read_text(path), columns=["season"], infer_schema=False)["season"].cast(pl.Float64, strict=False)
        row = int((found != season).arg_true()[0]) + _FIRST_ROW
        raise RsrlError(f"{path}: row {row}, column season: {foreign['season'][0]} in the file of {season}; keep one season in each file")
    return table


def season_file(folder: Path, season: int) -> Path:
    """Where the laps of a season are kept."""
    return folder / f"laps_{season}.csv.gz"


def file_fingerprint(path: Path) -> str:
    """Name and first 12 digits of the SHA-256 of a file, for provenance."""
    return f"{path.name} {hashlib.sha256(path.read_bytes()).hexdigest()[:12]}"


def _read_text(path: Path) -> bytes:
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise RsrlError(f"{path}: cannot be read ({error.strerror}); give the folder of the lap files with --laps") from None
    if path.suffix == ".gz":
        try:
            raw = gzip.decompress(raw)
        except (OSError, EOFError, zlib.error) as error:
            raise RsrlError(f"{path}: is no whole gzip file ({error}); copy it again") from None
    if not raw.strip():
        raise RsrlError(f"{path}: is empty; copy it again")
    return raw


def _typed(text: pl.DataFrame, name: str, kind: pl.DataType, path: Path) -> pl.Series:
    """One column of the file as `kind`; raises RsrlError naming the first row that cannot be read as that."""
    source = _RENAMED.get(name, name)
    column = text[source].str.strip_chars()
    if name == "compound":
        return pl.Series(name, compound_letters(column, str(path), _FIRST_ROW), dtype=pl.String)
    column = column.replace({"": None, "nan": None, "NaN": None})
    if kind == pl.String():
        return column.alias(name)
    if kind == pl.Boolean():
        typed = column.str.to_lowercase().replace_strict({"true": True, "false": False}, default=None, return_dtype=pl.Boolean)
    else:
        typed = column.cast(pl.Float64, strict=False)
        typed = typed.set(typed.is_infinite(), None)
        if kind == pl.Int64():
            typed = typed.set(typed != typed.round(), None).cast(pl.Int64)
    wrong = (column.is_not_null() & typed.is_null()).arg_true()
    if len(wrong):
        row = int(wrong[0])
        raise RsrlError(f"{path}: row {row + _FIRST_ROW}, column {source}: {column[row]!r} is not {_KIND_WORDS[str(kind)]}")
    return typed.alias(name)


_KIND_WORDS: Final = {"Int64": "a whole number", "Float64": "a number", "Boolean": "True or False"}
