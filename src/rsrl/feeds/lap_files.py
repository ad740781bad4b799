"""A recorded race as a lap table, told again as events in the order in which a pit wall knew them.

Crossings of the line and passages of the pit lane have their own times in the table. Three things have none and are placed:
a change of track status between the two crossings that the laps' digits leave for it (`lap_status`); new tyres at the exit of the pit
lane; a retirement where the car's last, unfinished lap ends, or half a lap after the car was due at the line.
"""

import re
from collections.abc import Iterator
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import polars as pl

from rsrl.errors import RsrlError
from rsrl.feeds.events import (
    Entry,
    Event,
    LapCompleted,
    LapCount,
    PitIn,
    PitOut,
    Position,
    Retired,
    Session,
    SessionOver,
    TyreFitted,
)
from rsrl.feeds.lap_status import Lap, status_changes
from rsrl.laps import RACE, RaceHead, read_lap_csv, with_tyre_stops
from rsrl.season import grand_prix_of, load_race, race_names, resolve_race

OVERDUE_LAPS: Final = 1.5
"""A car that has not completed a lap after so many laps of the others is out."""

FORMATION_S: Final = 60.0
"""Entries and starting tyres are told so long before the start."""

START_S: Final = 5.0
"""What a standing start adds to a racing lap, where no car has a time for lap 1."""

Rows = list[dict[str, Any]]


def read_lap_file(path: Path, race: str | None) -> tuple[str, pl.DataFrame]:
    """Name and lap table of one race of a lap file.

    Args:
        race: its name in any form that `rsrl.season.resolve_race` reads; None where the file holds one race only.

    Raises:
        RsrlError: the file is no lap file, or does not hold the race.
    """
    table = read_lap_csv(path, None if race is None else _head(race))
    heads = table.select(*RACE, "event").unique(maintain_order=True).sort(*RACE)
    names = {f"{grand_prix_of(event)}-{season}": (season, number) for season, number, event in heads.iter_rows()}
    if race is None and len(names) > 1:
        raise RsrlError(f"{path}: holds {len(names)} races; name one with --race, such as {next(iter(names))}")
    name = next(iter(names)) if race is None else resolve_race(race, sorted(names))
    season, number = names[name]
    return name, table.filter((pl.col("season") == season) & (pl.col("round") == number))


def _head(race: str) -> RaceHead | None:
    """What a file of one race need not say where the race is named."""
    with suppress(RsrlError):
        record = load_race(resolve_race(race, race_names()))
        return RaceHead(record.season, record.round, record.event)
    named = re.fullmatch(r"(.+)[- ](\d{4})", race.strip())
    return RaceHead(int(named[2]), 1, named[1]) if named else None


def lap_events(laps: pl.DataFrame) -> list[Event]:
    """The events of one race from its lap table (`rsrl.laps.LAP_SCHEMA`), in order of time.

    Car numbers are the drivers' places in the alphabet from 1, since the table names drivers.

    Raises:
        RsrlError: no lap has a session time.
    """
    table = with_tyre_stops(laps).sort("driver", "lap")
    if table["session_time_s"].drop_nulls().is_empty():
        raise RsrlError("the laps have no session_time_s, so their order in time is unknown; give a lap file with that column")
    cars = {car: _with_times(rows) for car, rows in enumerate(_by_driver(table), 1)}
    total = max(int(rows[-1]["lap"]) for rows in cars.values())
    start_s = _start_s(cars)
    green = [Lap(*_span(rows, i, start_s), row["track_status"]) for rows in cars.values() for i, row in enumerate(rows)]
    events: list[Event] = [*_opening(cars, start_s, total), *_lap_counts(cars, start_s, total)]
    end_s = max(row["session_time_s"] for rows in cars.values() for row in rows)
    for car, rows in cars.items():
        events += _car_events(car, rows)
        events += _retirement(car, rows, cars, total)
    # last, since a safety car that comes in as the leader crosses the line was out on the lap that ends there
    events += [*status_changes(green, _passages(cars)), SessionOver(end_s + 1.0)]
    return sorted(events, key=lambda event: event.time_s)


def _passages(cars: dict[int, Rows]) -> list[tuple[float, float]]:
    """Entry and exit of each passage of the pit lane that has both."""
    pairs = ((row["pit_in_s"], after["pit_out_s"]) for rows in cars.values() for row, after in pairwise(rows))
    return [(in_s, out_s) for in_s, out_s in pairs if in_s is not None and out_s is not None]


def _by_driver(table: pl.DataFrame) -> Iterator[Rows]:
    for _, rows in table.group_by("driver", maintain_order=True):
        yield rows.to_dicts()


def _with_times(rows: Rows) -> Rows:
    """A car's rows with a session time each. A lap that has none, or is missing, gets it from the next lap's time and duration.

    Last rows without a position are of a lap that the car began and did not end. They are left out; their time, which is that of the
    car's standstill, is kept as `stopped_s` of the row before.
    """
    while len(rows) > 1 and rows[-1]["position"] is None and rows[0]["position"] is not None:
        rows[-2]["stopped_s"] = rows[-1]["session_time_s"]
        rows = rows[:-1]
    missing = rows[0]["lap"] == 2 and rows[0]["lap_time_s"] is not None
    rows = [{**rows[0], "lap": 1, "lap_time_s": None, "session_time_s": None, "tyre_stop": False}, *rows] if missing else rows
    for row, after in zip(rows[-2::-1], rows[:0:-1], strict=True):
        if row["session_time_s"] is None and after["session_time_s"] is not None and after["lap_time_s"] is not None:
            row["session_time_s"] = after["session_time_s"] - after["lap_time_s"]
    return [row for row in rows if row["session_time_s"] is not None]


def _start_s(cars: dict[int, Rows]) -> float:
    """Session time of the start."""
    first = [rows[0] for rows in cars.values() if rows and rows[0]["lap"] == 1]
    starts = sorted(row["session_time_s"] - row["lap_time_s"] for row in first if row["lap_time_s"] is not None)
    if starts:
        return float(starts[len(starts) // 2])
    times = sorted(row["lap_time_s"] for rows in cars.values() for row in rows if row["lap_time_s"] is not None)
    return float(min(rows[0]["session_time_s"] for rows in cars.values()) - times[len(times) // 2] - START_S)


def _span(rows: Rows, i: int, start_s: float) -> tuple[float, float]:
    """Session times between which a car drove a lap."""
    return (rows[i - 1]["session_time_s"] if i else start_s), rows[i]["session_time_s"]


def _opening(cars: dict[int, Rows], start_s: float, total: int) -> Iterator[Event]:
    first = next(iter(cars.values()))[0]
    yield Session(start_s - FORMATION_S, "race", first["event"], first["season"], total)
    for car, rows in cars.items():
        yield Entry(start_s - FORMATION_S, car, rows[0]["driver"], rows[0]["team"])
        yield _fitted(start_s - FORMATION_S, car, 1, rows[0])


def _fitted(time_s: float, car: int, stint: int, row: dict[str, Any], old_life: float | None = None) -> TyreFitted:
    """The set on which a car begins the lap of `row`. An age that goes on from that of the old set is no age of this one."""
    life = row["tyre_life_laps"]
    life = None if life is None or (old_life is not None and life == old_life + 1) else life
    return TyreFitted(time_s, car, stint, row["compound"], row["fresh_tyre"], None if life is None else max(round(life) - 1, 0))


def _lap_counts(cars: dict[int, Rows], start_s: float, total: int) -> Iterator[Event]:
    yield LapCount(start_s, 1, total)
    first: dict[int, float] = {}
    for rows in cars.values():
        for row in rows:
            first[row["lap"]] = min(first.get(row["lap"], row["session_time_s"]), row["session_time_s"])
    yield from (LapCount(time_s, lap + 1, total) for lap, time_s in first.items() if lap < total)


def _car_events(car: int, rows: Rows) -> Iterator[Event]:
    stint = 1
    for i, row in enumerate(rows):
        lap, time_s = row["lap"], row["session_time_s"]
        after = rows[i + 1] if i + 1 < len(rows) else None
        if row["pit_in_s"] is not None:
            yield PitIn(row["pit_in_s"], car, lap)
        yield LapCompleted(time_s, car, lap, row["lap_time_s"])
        if row["position"] is not None:
            yield Position(time_s, car, row["position"])
        if after is None:
            continue
        if after["pit_out_s"] is not None:
            yield PitOut(after["pit_out_s"], car, after["lap"])
        if row["tyre_stop"]:
            stint += 1
            yield _fitted(after["pit_out_s"] or time_s, car, stint, after, row["tyre_life_laps"])


def _retirement(car: int, rows: Rows, cars: dict[int, Rows], total: int) -> Iterator[Event]:
    """That a car is out, where it came to a standstill or half a lap after it was due; nothing for a car that took the flag."""
    last = rows[-1]
    flag_s = min(r[-1]["session_time_s"] for r in cars.values() if r[-1]["lap"] == total)
    if last["lap"] < total and last["session_time_s"] < flag_s:
        times = sorted(
            after["session_time_s"] - row["session_time_s"]
            for others in cars.values()
            for row, after in zip(others, others[1:], strict=False)
            if after["lap"] == last["lap"] + 1
        )
        due_s = last["session_time_s"] + OVERDUE_LAPS * (times[len(times) // 2] if times else 0.0)
        yield Retired(min(due_s, last.get("stopped_s") or due_s), car)
