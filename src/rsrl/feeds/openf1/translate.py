"""Rows of OpenF1 to canonical events, in the order in which they became known."""

from collections.abc import Iterable, Iterator, Mapping
from datetime import UTC, datetime
from typing import Final, Literal

from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.events import (
    Entry,
    Event,
    Gap,
    LapCompleted,
    LapCount,
    PitIn,
    PitOut,
    Position,
    Session,
    SessionOver,
    StatusChanged,
    TyreFitted,
    Weather,
)
from rsrl.feeds.live_timing.race_control import race_control_events
from rsrl.feeds.live_timing.values import decimal, parse_gap, whole
from rsrl.feeds.openf1.client import Row
from rsrl.feeds.openf1.track_status import status_after
from rsrl.laps.schema import COMPOUND_LETTERS, MOST_LAPS
from rsrl.season import GREEN, MAX_CARS

__all__ = ["ENDPOINTS", "events_of_rows"]

ENDPOINTS: Final = ("drivers", "laps", "stints", "pit", "position", "intervals", "race_control", "weather", "starting_grid")
"""What a session is made of; the grid is there since 2025, before it the first positions are it."""

HIGHEST_NUMBER: Final = 99
Kind = Literal["race", "sprint", "qualifying", "practice"]


class _Reader:
    """Turns the rows of one session into events, each endpoint by itself."""

    def __init__(self, session: Row, tables: Mapping[str, list[Row]], anomalies: Anomalies) -> None:
        self.session, self.tables, self.anomalies = session, tables, anomalies
        begin = _seconds(session.get("date_start"))
        self.begin_s = begin if begin is not None else 0.0
        self.ends: dict[tuple[int, int], float] = {}  # when each car ended each lap
        self.cars: set[int] = set()
        self.cars = {car for car, _ in self._of_cars("drivers")}
        self._lap_ends()

    def time_s(self, date: object) -> float | None:
        """Seconds from the session's start; None where the row has no date."""
        moment = _seconds(date)
        return None if moment is None else round(moment - self.begin_s, 3)

    def _of_cars(self, endpoint: str) -> Iterator[tuple[int, Row]]:
        for row in self.tables.get(endpoint, ()):
            car = whole(row.get("driver_number"), HIGHEST_NUMBER)
            if car is None:
                self.anomalies.add(f"row of {endpoint} without a car")
            elif endpoint != "drivers" and car not in self.cars:
                self.anomalies.add("car that is not in the list of drivers", f"{car} in {endpoint}")
            else:
                yield car, row

    def _laps(self) -> dict[tuple[int, int], Row]:
        laps = ((car, whole(row.get("lap_number"), MOST_LAPS), row) for car, row in self._of_cars("laps"))
        return {(car, lap): row for car, lap, row in laps if lap}

    def _lap_ends(self) -> None:
        """A lap ends when the next one begins or, where that has no row, its duration after its own beginning."""
        rows = self._laps()
        for (car, lap), row in rows.items():
            end = self.time_s(rows.get((car, lap + 1), {}).get("date_start"))
            begin, lap_time_s = self.time_s(row.get("date_start")), decimal(row.get("lap_duration"))
            if end is None and begin is not None and lap_time_s is not None:
                end = begin + lap_time_s
            if end is not None:
                self.ends[car, lap] = end

    def opening(self, time_s: float) -> Iterator[Event]:
        """The session and its cars, told at `time_s`."""
        name, kind = str(self.session.get("session_name")), str(self.session.get("session_type"))
        kinds: dict[str, Kind] = {"Race": "race", "Qualifying": "qualifying"}
        told: Kind = "sprint" if kind == "Race" and "sprint" in name.lower() else kinds.get(kind, "practice")
        event = self.session.get("meeting_name") or f"{self.session.get('country_name', '')} Grand Prix"
        yield Session(time_s, told, str(event).strip(), whole(self.session.get("year"), 2999) or 0)
        grid = {car: row.get("position") for car, row in self._of_cars("starting_grid")}
        if not grid:
            for car, row in sorted(self._of_cars("position"), key=lambda one: str(one[1].get("date"))):
                grid.setdefault(car, row.get("position"))
        for car, row in self._of_cars("drivers"):
            code, team = row.get("name_acronym"), row.get("team_name")
            yield Entry(time_s, car, code if isinstance(code, str) else str(car), team, whole(grid.get(car), MAX_CARS) or None)

    def laps(self) -> Iterator[Event]:
        """Laps, and the leader's."""
        first: dict[int, float] = {}
        for (car, lap), row in self._laps().items():
            end = self.ends.get((car, lap))
            if end is not None:
                first[lap] = min(first.get(lap, end), end)
                yield LapCompleted(end, car, lap, decimal(row.get("lap_duration")))
        if first:
            yield LapCount(0.0, 1)
        for lap, time_s in first.items():
            if lap + 1 in first:
                yield LapCount(time_s, lap + 1)

    def stops(self) -> Iterator[Event]:
        """Visits to the pit lane: a row is dated when the car has left it."""
        for car, row in self._of_cars("pit"):
            left, lap = self.time_s(row.get("date")), whole(row.get("lap_number"), MOST_LAPS)
            lane_s = decimal(row.get("lane_duration"))
            lane_s = decimal(row.get("pit_duration")) if lane_s is None else lane_s
            if left is not None:
                yield PitIn(left - (lane_s or 0.0), car, lap)
                yield PitOut(left, car, None if lap is None else lap + 1)

    def stints(self) -> Iterator[Event]:
        """Sets of tyres, told when the car left the pit lane or, where that has no row, when the lap before them ended."""
        left = {(car, whole(row.get("lap_number"), MOST_LAPS)): self.time_s(row.get("date")) for car, row in self._of_cars("pit")}
        for car, row in self._of_cars("stints"):
            number, begins = whole(row.get("stint_number"), MOST_LAPS), whole(row.get("lap_start"), MOST_LAPS)
            before = car, (begins or 1) - 1
            time_s = left.get(before) or self.ends.get(before, 0.0 if begins in (None, 0, 1) else None)
            if not number or time_s is None:
                self.anomalies.add("stint without a beginning", f"car {car}, stint {number}")
                continue
            name, age = row.get("compound"), whole(row.get("tyre_age_at_start"), MOST_LAPS)
            letter = COMPOUND_LETTERS.get(name.upper()) if isinstance(name, str) else None
            fitted = None if begins is None else max(begins - 1, 0)
            yield TyreFitted(time_s, car, number, letter, None if age is None else age == 0, age, fitted)

    def places(self) -> Iterator[Event]:
        """Positions and gaps."""
        for car, row in self._of_cars("position"):
            time_s, position = self.time_s(row.get("date")), whole(row.get("position"), MAX_CARS)
            if time_s is not None and position:
                yield Position(time_s, car, position)
        for car, row in self._of_cars("intervals"):
            time_s = self.time_s(row.get("date"))
            if time_s is not None:
                gap_s, laps_down = _gap(row.get("gap_to_leader"))
                yield Gap(time_s, car, gap_s, laps_down, _gap(row.get("interval"))[0] if gap_s != 0 else None)

    def control(self) -> Iterator[Event]:
        """Race control's messages, and the track status that they mean."""
        status = GREEN
        for row in sorted(self.tables.get("race_control", ()), key=lambda row: str(row.get("date"))):
            time_s, text = self.time_s(row.get("date")), row.get("message")
            if time_s is None or not isinstance(text, str):
                continue
            yield from race_control_events(text, time_s)
            after = status_after(row, status)
            if after != status:
                status = after
                yield StatusChanged(time_s, status)

    def weather(self) -> Iterator[Event]:
        """Weather, once a minute."""
        for row in self.tables.get("weather", ()):
            time_s, rain = self.time_s(row.get("date")), row.get("rainfall")
            if time_s is not None:
                is_wet = None if not isinstance(rain, int | float) else rain > 0
                yield Weather(time_s, decimal(row.get("air_temperature")), decimal(row.get("track_temperature")), is_wet)


def events_of_rows(session: Row, tables: Mapping[str, list[Row]], anomalies: Anomalies) -> list[Event]:
    """The events of a session.

    Args:
        session: its row of `sessions`, with `meeting_name` of its meeting where it is known.
        tables: rows by endpoint of `ENDPOINTS`; any may be missing.

    Events of cars that the drivers' list lacks are left out: that list may be short, never long, for a race.
    """
    reader = _Reader(session, tables, anomalies)
    parts: tuple[Iterable[Event], ...] = (
        reader.laps(),
        reader.stops(),
        reader.stints(),
        reader.places(),
        reader.control(),
        reader.weather(),
    )
    later = sorted((event for part in parts for event in part), key=lambda event: event.time_s)
    if not later:
        return list(reader.opening(0.0))
    return [*reader.opening(later[0].time_s), *later, SessionOver(later[-1].time_s)]


def _seconds(date: object) -> float | None:
    """Seconds since 1970 of an ISO date, in UTC where it names no zone; None for none."""
    try:
        moment = datetime.fromisoformat(date) if isinstance(date, str) else None
    except ValueError:
        return None
    if moment is None:
        return None
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()


def _gap(value: object) -> tuple[float | None, int | None]:
    """A gap: a number of seconds, "+1 LAP", or null."""
    if isinstance(value, str):
        return parse_gap(value)
    seconds = decimal(value)
    return seconds, None if seconds is None else 0
