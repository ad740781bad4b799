"""The lap table: its columns with types and units, and the checks that every reader applies."""

from collections.abc import Iterable
from typing import Final

import polars as pl

from rsrl.errors import RsrlError

LAP_SCHEMA: Final[dict[str, pl.DataType]] = {
    "season": pl.Int64(),
    "round": pl.Int64(),
    "event": pl.String(),
    "driver": pl.String(),  # three letters
    "team": pl.String(),
    "lap": pl.Int64(),  # 1 is the first racing lap
    "lap_time_s": pl.Float64(),
    "compound": pl.String(),  # S, M, H, I (intermediate), W (wet) or null
    "compound_c": pl.String(),  # Pirelli C0..C6 or null
    "tyre_life_laps": pl.Float64(),  # laps on the set, used laps included
    "stint": pl.Int64(),
    "position": pl.Int64(),  # at the end of the lap, on the road
    "track_status": pl.String(),  # every FastF1 digit seen in the lap: 1 clear, 2 yellow, 4 SC, 5 red, 6 VSC, 7 VSC ending
    "pit_in_s": pl.Float64(),  # session time of entering the pit lane, in the lap that ends there
    "pit_out_s": pl.Float64(),  # session time of leaving it, in the lap that begins there
    "session_time_s": pl.Float64(),  # at the end of the lap
    "fresh_tyre": pl.Boolean(),
    "lap_time_source": pl.String(),  # timing, derived or null
}
"""Columns of the lap table. One row is one driver's lap."""

KEY: Final = ("season", "round", "driver", "lap")
RACE: Final = ("season", "round")
CAR: Final = ("season", "round", "driver")

COMPOUND_LETTERS: Final = {"SOFT": "S", "MEDIUM": "M", "HARD": "H", "INTERMEDIATE": "I", "INTER": "I", "WET": "W"}
NO_COMPOUND: Final = ("", "UNKNOWN", "TEST_UNKNOWN", "NAN", "NONE")
DRY: Final = ("S", "M", "H")
WET: Final = ("I", "W")

MOST_LAPS: Final = 100
"""No Grand Prix of this century had more than 78 laps."""

LONGEST_LAP_S: Final = 9000.0
"""A lap with a red flag can last long: 7,754 s in Japan 2022, the longest of 2018-2024."""


def compound_letters(names: Iterable[str | None], where: str, first_row: int) -> list[str | None]:
    """Letters of compound names; raises RsrlError naming the row of one that is not known.

    Args:
        names: names or letters as in the source, any case; blank and `UNKNOWN` give null.
        where: file or session for the complaint.
        first_row: number that a user would give the first of them.
    """
    letters: list[str | None] = []
    for i, name in enumerate(names):
        text = str(name).strip().upper() if name is not None else ""
        if text in NO_COMPOUND:
            letters.append(None)
        elif text in (*DRY, *WET):
            letters.append(text)
        elif text in COMPOUND_LETTERS:
            letters.append(COMPOUND_LETTERS[text])
        else:
            known = ", ".join(COMPOUND_LETTERS)
            raise RsrlError(f"{where}: row {first_row + i}, column compound: unknown compound {name!r}; known are {known}")
    return letters


def check_table(table: pl.DataFrame, where: str, first_row: int) -> pl.DataFrame:
    """The table in the declared column order, sorted by race, driver and lap.

    Raises:
        RsrlError: a column is missing or of another type, a key is null, a time is negative or too long for a lap, a lap
            number is too high, a C-number unknown, or one driver has the same lap twice.

    Rows may come in any order. A lap time of 0 is read as a missing time once in a race, and refused more often.
    """
    missing = [name for name in LAP_SCHEMA if name not in table.columns]
    if missing:
        raise RsrlError(f"{where}: column {', '.join(missing)} is missing; a lap table needs {', '.join(LAP_SCHEMA)}")
    for name, kind in LAP_SCHEMA.items():
        if table.schema[name] != kind:
            raise RsrlError(f"{where}: column {name} is {table.schema[name]}, must be {kind}")
    if table.height == 0:
        raise RsrlError(f"{where}: holds no laps; give a file with one row per driver and lap")
    numbered = table.select(*LAP_SCHEMA).with_row_index("_row", offset=first_row)
    for name in KEY:
        _refuse(numbered.filter(pl.col(name).is_null()), where, name, "is blank; every lap needs it")
    _refuse(numbered.filter(pl.col("lap") < 1), where, "lap", "is below 1; laps count from 1")
    _refuse(numbered.filter(pl.col("lap") > MOST_LAPS), where, "lap", f"is beyond {MOST_LAPS}; laps of each race count from 1")
    for name in ("lap_time_s", "pit_in_s", "pit_out_s", "session_time_s"):
        _refuse(numbered.filter(pl.col(name) < 0), where, name, "is negative; leave it blank where there is no time")
    zero = pl.col("lap_time_s") == 0
    _refuse(numbered.filter(zero & (zero.sum().over(*RACE) > 1)), where, "lap_time_s", "is zero; leave it blank where there is no time")
    too_long = pl.col("lap_time_s") > LONGEST_LAP_S
    _refuse(numbered.filter(too_long), where, "lap_time_s", f"is longer than any race; times are in seconds, {LONGEST_LAP_S:g} at most")
    _refuse(
        numbered.filter(~pl.col("compound_c").str.contains("^C[0-6]$")),
        where,
        "compound_c",
        "is no Pirelli C-number; write C0 to C6 or leave it blank",
    )
    double = numbered.filter(pl.struct(*KEY).is_duplicated()).sort(*KEY, "_row")
    if double.height:
        first, again = double.row(0, named=True), double.row(1, named=True)
        raise RsrlError(
            f"{where}: row {again['_row']}: {again['driver']} has lap {again['lap']} of round {again['round']} more than once, first in row"
            f" {first['_row']}; remove the double row"
        )
    return numbered.drop("_row").with_columns(pl.when(~zero).then(pl.col("lap_time_s")).alias("lap_time_s")).sort(*RACE, "driver", "lap")


def _refuse(bad: pl.DataFrame, where: str, column: str, what: str) -> None:
    if bad.height:
        raise RsrlError(f"{where}: row {bad['_row'][0]}, column {column}: {bad[column][0]!r} {what}")
