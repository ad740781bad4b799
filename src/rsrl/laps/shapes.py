"""Lap files as people have them, brought to the documented columns as text: FastF1's `to_csv`, OpenF1's columns, the lap table's own names.

What each missing column is derived from stands in docs/how-to/lap-file.md; one that cannot be derived stays missing and is refused by name.
"""

from collections.abc import Mapping
from typing import Final, NamedTuple

import polars as pl

_TABLE: Final = {"tyre_life_laps": "tyre_life", "pit_in_s": "pit_in", "pit_out_s": "pit_out"}
_FASTF1: Final = {
    "Driver": "driver", "Team": "team", "LapNumber": "lap", "LapTime": "lap_time_s", "Compound": "compound", "TyreLife": "tyre_life",
    "Stint": "stint", "Position": "position", "TrackStatus": "track_status", "PitInTime": "pit_in", "PitOutTime": "pit_out",
    "Time": "session_time_s", "FreshTyre": "fresh_tyre",
}  # fmt: skip
_OPENF1: Final = {
    "name_acronym": "driver", "team_name": "team", "lap_number": "lap", "lap_duration": "lap_time_s", "stint_number": "stint",
    "meeting_name": "event", "year": "season",
}  # fmt: skip
_SPANS: Final = ("lap_time_s", "pit_in", "pit_out", "session_time_s")
_SPAN: Final = r"^(?:(\d+) days?,? ?)?(?:\+?(\d+):)?(\d+):(\d+(?:\.\d+)?)$"
"""`0 days 01:02:43.123000`, `1:02:43.1`, `1:32.608`; groups are days, hours, minutes, seconds."""

BLANK: Final = ("", "nan", "NaN", "NaT", "None", "null")
"""Ways to write that there is nothing."""

_CAR: Final = ("season", "round", "driver")


class RaceHead(NamedTuple):
    """Which race a file without such columns holds."""

    season: int
    round: int
    event: str


def documented(text: pl.DataFrame, head: RaceHead | None) -> pl.DataFrame:
    """A file's columns, all text, under the documented names and in their units, with what can be derived of those that are missing.

    Args:
        head: fills in season, round and event where the file has none.
    """
    names = set(text.columns)
    found = _renamed(text, _TABLE)
    if {"LapNumber", "LapTime"} <= names:
        found = _year(_renamed(found, _FASTF1), "LapStartDate")
    elif {"lap_number", "lap_duration"} <= names:
        found = _from_openf1(_year(_renamed(found, _OPENF1), "date_start"))
    if not {"driver", "lap"} <= set(found.columns):
        return found
    found = found.with_columns(pl.all().str.strip_chars().replace(dict.fromkeys(BLANK)))
    found = found.with_columns(_seconds(name) for name in _SPANS if name in found.columns)
    return _with_blanks(_derived(_with_head(found, head)))


def _renamed(text: pl.DataFrame, names: Mapping[str, str]) -> pl.DataFrame:
    """With other names; a documented column that is there already stays what it is."""
    return text.rename({old: new for old, new in names.items() if old in text.columns and new not in text.columns})


def _year(text: pl.DataFrame, dates: str) -> pl.DataFrame:
    """With the season from a column of dates, where that is all there is."""
    if "season" in text.columns or dates not in text.columns:
        return text
    years = text[dates].str.extract(r"^(\d{4})-").drop_nulls()
    return text.with_columns(season=pl.lit(years.mode().min() if len(years) else None, pl.String))


def _seconds(name: str) -> pl.Expr:
    """Time spans in seconds; what is no time span stays as it is, and is read as a number or refused."""
    column = pl.col(name)
    days, hours, minutes, seconds = (column.str.extract(_SPAN, i).cast(pl.Float64) for i in range(1, 5))
    total = 86_400 * days.fill_null(0) + 3600 * hours.fill_null(0) + 60 * minutes + seconds
    return pl.coalesce(total.round(6).cast(pl.String), column).alias(name)


def _with_head(text: pl.DataFrame, head: RaceHead | None) -> pl.DataFrame:
    known = {} if head is None else {"season": str(head.season), "round": str(head.round), "event": head.event}
    missing = {name: pl.lit(value) for name, value in known.items() if name not in text.columns}
    found = text.with_columns(**missing)
    alone = "round" not in found.columns and "event" in found.columns and found["event"].n_unique() == 1
    return found.with_columns(round=pl.lit("1")) if alone else found


def _from_openf1(text: pl.DataFrame) -> pl.DataFrame:
    """OpenF1's laps joined with what its other tables say of them: crossings of the line, tyre ages, passages of the pit lane."""
    car = "driver" if "driver" in text.columns else "driver_number"
    if not {car, "lap", "date_start"} <= set(text.columns):
        return text
    began = pl.col("date_start").str.to_datetime(time_unit="us", time_zone="UTC", strict=False).dt.timestamp("us") / 1e6
    lap, duration = pl.col("lap").cast(pl.Int64, strict=False), pl.col("lap_time_s").cast(pl.Float64, strict=False)
    found = text.with_columns(_lap=lap, _began=began - began.min(), _row=pl.int_range(pl.len())).sort(car, "_lap")
    ended = pl.coalesce(pl.col("_began").shift(-1).over(car), pl.col("_began") + duration)
    found = found.with_columns(session_time_s=ended.round(3).cast(pl.String))
    if {"tyre_age_at_start", "stint"} <= set(text.columns) and "tyre_life" not in text.columns:
        fresh = pl.col("tyre_age_at_start").cast(pl.Float64, strict=False)
        on_set = pl.col("_lap") - pl.col("_lap").min().over(car, "stint") + 1
        found = found.with_columns(tyre_life=(fresh + on_set).cast(pl.String))
    if "is_pit_out_lap" in text.columns and not {"pit_in", "pit_out"} & set(text.columns):
        out_lap = (pl.col("is_pit_out_lap").str.to_lowercase() == "true") & (pl.col("_lap") > 1)
        line_s = pl.col("session_time_s").cast(pl.Float64)
        lane = next((name for name in ("lane_duration", "pit_duration") if name in text.columns), None)
        lane_s = pl.lit(None, pl.Float64) if lane is None else pl.col(lane).cast(pl.Float64, strict=False).shift(-1).over(car)
        boxes = out_lap.shift(-1).over(car).fill_null(False)
        found = found.with_columns(pit_in=pl.when(boxes).then(line_s), _out=pl.when(boxes).then(line_s + lane_s))
        found = found.with_columns(pit_in=pl.col("pit_in").cast(pl.String), pit_out=pl.col("_out").shift(1).over(car).cast(pl.String))
    return found.sort("_row").drop("_row", "_lap", "_began", *(["_out"] if "_out" in found.columns else []))


def _derived(text: pl.DataFrame) -> pl.DataFrame:
    """With the columns that follow from others: crossings, lap times, places, stints."""
    names = set(text.columns)
    if not set(_CAR) <= names:
        return text
    lap = pl.col("lap").cast(pl.Float64, strict=False)
    found = text.with_columns(_row=pl.int_range(pl.len()), _lap=lap).sort(*_CAR, "_lap")
    time, line = (pl.col(name).cast(pl.Float64, strict=False) for name in ("lap_time_s", "session_time_s"))
    if "session_time_s" not in names and "lap_time_s" in names and found.select(time.is_not_null().all()).item():
        found = found.with_columns(session_time_s=time.cum_sum().over(*_CAR).round(3).cast(pl.String))
    elif "lap_time_s" not in names and "session_time_s" in names:
        found = found.with_columns(lap_time_s=(line - line.shift(1)).over(*_CAR).round(3).cast(pl.String))
    names = set(found.columns)
    if "position" not in names and "session_time_s" in names:
        found = found.with_columns(position=line.rank("ordinal").over("season", "round", "_lap").cast(pl.String))
    if "stint" not in names and {"compound", "tyre_life"} <= names:
        age = pl.col("tyre_life").cast(pl.Float64, strict=False)
        other = (pl.col("compound") != pl.col("compound").shift(1)).fill_null(False) | (age != age.shift(1) + 1).fill_null(False)
        found = found.with_columns(stint=(1 + other.cast(pl.Int64).cum_sum()).over(*_CAR).cast(pl.String))
    return found.sort("_row").drop("_row", "_lap")


def _with_blanks(text: pl.DataFrame) -> pl.DataFrame:
    """With the columns that may be blank, and the source of the lap times."""
    blank = [pl.lit(None, pl.String).alias(name) for name in ("fresh_tyre", "compound_c") if name not in text.columns]
    timed = "lap_time_s" in text.columns and "lap_time_source" not in text.columns
    source = [pl.when(pl.col("lap_time_s").is_not_null()).then(pl.lit("timing")).alias("lap_time_source")] if timed else []
    return text.with_columns(*blank, *source)
