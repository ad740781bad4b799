"""Reader of lap files, `.csv`, `.csv.gz` and `.parquet`: one row per driver and lap, of a race or of every Grand Prix of a season."""

import gzip
import hashlib
import zlib
from pathlib import Path
from typing import Final

import polars as pl

from rsrl.errors import RsrlError
from rsrl.laps.cleaning import BROKEN_RACES
from rsrl.laps.schema import LAP_SCHEMA, RACE, check_table, compound_letters
from rsrl.laps.shapes import BLANK, RaceHead, documented

_RENAMED: Final = {"tyre_life_laps": "tyre_life", "pit_in_s": "pit_in", "pit_out_s": "pit_out"}
_WORDS: Final = {"S": "SOFT", "M": "MEDIUM", "H": "HARD", "I": "INTERMEDIATE", "W": "WET"}
SUFFIXES: Final = (".csv.gz", ".csv", ".parquet")
"""Of lap files."""

FEWEST_LAPS: Final = 10
"""With fewer, the file holds a piece of a race, or a race that was abandoned."""

_FIRST_ROW: Final = 2  # row 1 of the file is its header


def read_lap_csv(path: Path, head: RaceHead | None = None) -> pl.DataFrame:
    """Read a lap file into the lap table (`LAP_SCHEMA`), of any shape that `rsrl.laps.shapes` knows.

    Args:
        head: which race it is, for a file that does not say.

    Raises:
        RsrlError: the file is missing, truncated, empty, lacks a column that cannot be derived, or holds a value of the
            wrong type; the message names file, row, column and remedy.
    """
    text = documented(_read_table(path), head)
    wanted = [_RENAMED.get(name, name) for name in LAP_SCHEMA]
    missing = [name for name in wanted if name not in text.columns]
    if missing:
        raise RsrlError(f"{path}: column {', '.join(missing)} is missing; a lap file has the columns {', '.join(wanted)}")
    columns = [_typed(text, name, kind, path) for name, kind in LAP_SCHEMA.items()]
    return check_table(pl.DataFrame(columns), str(path), _FIRST_ROW)


def write_lap_csv(table: pl.DataFrame, path: Path) -> None:
    """Write a lap table, such as `read_fastf1_session` gives, as a lap file that `read_lap_csv` and `rsrl calibrate` read.

    Args:
        path: `.csv` or `.csv.gz`.

    Raises:
        RsrlError: the table lacks a column, or the file cannot be written.
    """
    laps = check_table(table, "lap table", 0).with_columns(pl.col("compound").replace(_WORDS)).rename(_RENAMED)
    content = laps.write_csv().encode()
    try:
        path.write_bytes(gzip.compress(content, mtime=0) if path.suffix == ".gz" else content)
    except OSError as error:
        raise RsrlError(f"{path}: cannot be written ({error.strerror})") from None


def _read_table(path: Path) -> pl.DataFrame:
    """All columns of a file as text; time spans of a Parquet file in seconds."""
    raw = _read_text(path)
    try:
        if path.suffix == ".parquet":
            table = pl.read_parquet(raw)
            spans = pl.selectors.duration()
            return table.with_columns(spans.dt.total_microseconds() / 1e6).with_columns(pl.all().cast(pl.String))
        header = raw[: raw.find(b"\n")] if b"\n" in raw else raw
        separator = max((",", ";", "\t"), key=lambda sign: header.count(sign.encode()))
        text = pl.read_csv(raw, infer_schema=False, separator=separator)
    except pl.exceptions.PolarsError as error:
        reason = str(error).splitlines()[0]
        raise RsrlError(f"{path}: is not a readable lap file ({reason}); give a laps_<season>.csv.gz file") from None
    if separator != ";":
        return text
    return text.with_columns(pl.all().str.replace(r"^(-?\d+),(\d+)$", "$1.$2"))  # decimal commas


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
            rounds = documented(_read_table(path), None)["round"].cast(pl.Float64, strict=False)
            row = int((rounds == number).arg_true()[0]) + _FIRST_ROW
            raise RsrlError(
                f"{path}: row {row}: round {number} ({event}) ends after lap {laps}, with {rows} rows;"
                " give the whole race, or take its rows out"
            )


def events_of_season(folder: Path, season: int) -> list[str]:
    """Names of the Grands Prix in the lap file of a season, in order; none where the file is not there or cannot be read."""
    try:
        events = documented(_read_table(season_file(folder, season)), None)["event"]
    except (RsrlError, pl.exceptions.ColumnNotFoundError):
        return []
    return events.drop_nulls().unique(maintain_order=True).to_list()


def _read_season(folder: Path, season: int) -> pl.DataFrame:
    path = season_file(folder, season)
    table = read_lap_csv(path)
    foreign = table.filter(pl.col("season") != season)
    if foreign.height:
        found = documented(_read_table(path), None)["season"].cast(pl.Float64, strict=False)
        row = int((found != season).arg_true()[0]) + _FIRST_ROW
        raise RsrlError(f"{path}: row {row}, column season: {foreign['season'][0]} in the file of {season}; keep one season in each file")
    return table


def season_file(folder: Path, season: int) -> Path:
    """Where the laps of a season are kept: the first of its files there is, `laps_<season>` with `SUFFIXES`."""
    files = [folder / f"laps_{season}{suffix}" for suffix in SUFFIXES]
    return next((path for path in files if path.is_file()), files[0])


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
    column = column.replace(dict.fromkeys(BLANK))
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
