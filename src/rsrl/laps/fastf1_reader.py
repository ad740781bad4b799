"""Reader of a FastF1 session: makes the lap table from its `Session.laps` without importing FastF1."""

import math
from datetime import timedelta
from typing import Any, Final, Protocol

import polars as pl

from rsrl.errors import RsrlError
from rsrl.laps.schema import LAP_SCHEMA, check_table, compound_letters


class LapsFrame(Protocol):
    """The part of a pandas frame that is used: `columns` and `to_dict("list")`."""

    columns: Any

    def to_dict(self, orient: str) -> dict[str, list[Any]]:
        """Column name to the list of its values."""


_NUMBERS: Final = {"lap": "LapNumber", "tyre_life_laps": "TyreLife", "stint": "Stint", "position": "Position"}
_TIMES: Final = {"lap_time_s": "LapTime", "pit_in_s": "PitInTime", "pit_out_s": "PitOutTime", "session_time_s": "Time"}
_WORDS: Final = {"driver": "Driver", "team": "Team", "track_status": "TrackStatus"}
_OTHERS: Final = ("Compound", "FreshTyre")


def read_fastf1_session(
    session_laps: LapsFrame, season: int, round_number: int, event: str, nominations: dict[str, str] | None = None
) -> pl.DataFrame:
    """The lap table of one race loaded with FastF1 (`session.laps`).

    Args:
        session_laps: `session.laps`, or any frame with its columns.
        season: year of the race.
        round_number: round in that season.
        event: name such as `Bahrain Grand Prix`.
        nominations: C-number per compound letter, such as `{"S": "C3", "M": "C2", "H": "C1"}`; FastF1 has none.

    Raises:
        RsrlError: a column is missing, or a value is not of the type of its column; the message names row and column.
    """
    where = f"FastF1 laps of {season} round {round_number}"
    needed = (*_NUMBERS.values(), *_TIMES.values(), *_WORDS.values(), *_OTHERS)
    missing = [name for name in needed if name not in list(session_laps.columns)]
    if missing:
        raise RsrlError(f"{where}: column {', '.join(missing)} is missing; load the session with laps=True")
    data = session_laps.to_dict("list")
    rows = len(data["Driver"])
    letters = compound_letters((None if _blank(v) else str(v) for v in data["Compound"]), where, 0)
    made: dict[str, list[Any]] = {"season": [season] * rows, "round": [round_number] * rows, "event": [event] * rows}
    made |= {name: [_number(v, where, i, source) for i, v in enumerate(data[source])] for name, source in _NUMBERS.items()}
    made |= {name: [_seconds(v, where, i, source) for i, v in enumerate(data[source])] for name, source in _TIMES.items()}
    made |= {name: [None if _blank(v) else str(v) for v in data[source]] for name, source in _WORDS.items()}
    made["compound"] = list(letters)
    made["compound_c"] = [(nominations or {}).get(letter or "") for letter in letters]
    made["fresh_tyre"] = [None if _blank(v) else bool(v) for v in data["FreshTyre"]]
    made["lap_time_source"] = [None if t is None else "timing" for t in made["lap_time_s"]]
    for name, kind in LAP_SCHEMA.items():
        if kind == pl.Int64():
            made[name] = [None if v is None else int(v) for v in made[name]]
    return check_table(pl.DataFrame(made, schema=LAP_SCHEMA), where, 0)


def _blank(value: Any) -> bool:
    """None, NaN or NaT; the latter two are unequal to themselves."""
    return value is None or bool(value != value)


def _number(value: Any, where: str, row: int, column: str) -> float | None:
    if _blank(value):
        return None
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise RsrlError(f"{where}: row {row}, column {column}: {value!r} is not a number") from None
    return number if math.isfinite(number) else None


def _seconds(value: Any, where: str, row: int, column: str) -> float | None:
    if _blank(value):
        return None
    if isinstance(value, timedelta):
        return value.total_seconds()
    raise RsrlError(f"{where}: row {row}, column {column}: {value!r} is not a time span; load the session with FastF1 3")
