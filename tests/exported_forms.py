"""Canonical events of a race told in the form of each source: live timing, rows of OpenF1, packets of a game."""

from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from game_race import blank

from rsrl.feeds import (
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
    StatusChanged,
    TyreFitted,
)
from rsrl.feeds.games import formats
from rsrl.feeds.live_timing.messages import own_line
from rsrl.season import GREEN, RED, SC, VSC
from rsrl.season.drivers import drivers_called

BEGIN = datetime(2023, 3, 5, 14, 0, tzinfo=UTC)
NAMES = {"S": "SOFT", "M": "MEDIUM", "H": "HARD", "I": "INTERMEDIATE", "W": "WET"}
DIGITS = {GREEN: "1", SC: "4", RED: "5", VSC: "6"}


def at(time_s: float) -> str:
    """A time of the session as a time of day."""
    return (BEGIN + timedelta(seconds=time_s)).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def clock(seconds: float | None) -> str:
    """A lap time as live timing writes it."""
    if seconds is None:
        return ""
    hours, rest = divmod(round(seconds * 1000), 3_600_000)
    words = f"{rest // 60_000}:{rest % 60_000 / 1000:06.3f}"
    return f"{hours}:{words.zfill(9)}" if hours else words


# live timing


SECTOR_S = 2.0
"""Cars on the track are told of so often, by times of sectors that are no event."""


def live_timing_lines(events: Iterable[Event]) -> Iterator[tuple[float, bytes]]:
    """Session time and line of RSRL's own form for each event, and for the sectors that cars complete in between."""
    cars: list[int] = []
    told_s: float | None = None
    for event in events:
        if isinstance(event, Entry):
            cars.append(event.car)
        while cars and told_s is not None and event.time_s > told_s + SECTOR_S:
            told_s += SECTOR_S
            yield told_s, own_line("TimingData", _line(cars[int(told_s) % len(cars)], {"Sectors": {"0": {"Value": "30.1"}}}), at(told_s))
        told_s = event.time_s
        for topic, payload in _said(event):
            yield event.time_s, own_line(topic, payload, at(event.time_s))


def _said(event: Event) -> Iterator[tuple[str, dict[str, Any]]]:
    match event:
        case Session():
            meeting = {"Name": event.event}
            yield (
                "SessionInfo",
                {"Key": 1, "Type": "Race", "Name": "Race", "StartDate": f"{event.season}-03-05T15:00:00", "Meeting": meeting},
            )
            if event.total_laps:
                yield "LapCount", {"TotalLaps": event.total_laps}
        case Entry():
            yield "DriverList", {str(event.car): {"Tla": event.driver, "TeamName": event.team}}
            yield "TimingData", _line(event.car, {"InPit": False})
        case LapCount():
            yield "LapCount", {"CurrentLap": event.lap}
            if event.lap == 1:
                yield "SessionStatus", {"Status": "Started"}
        case LapCompleted():
            yield "TimingData", _line(event.car, {"NumberOfLaps": event.lap, "LastLapTime": {"Value": clock(event.lap_time_s)}})
        case Position():
            yield "TimingData", _line(event.car, {"Position": str(event.position)})
        case PitIn():
            yield "TimingData", _line(event.car, {"InPit": True})
        case PitOut():
            yield "TimingData", _line(event.car, {"InPit": False, "PitOut": True})
        case TyreFitted():
            stint = {
                "Compound": NAMES[event.compound or "S"],
                "New": str(event.new).lower(),
                "TotalLaps": event.laps_before,
                "StartLaps": event.laps_before,
            }
            yield "TimingAppData", _line(event.car, {"Stints": {str(event.stint - 1): stint}})
        case Retired():
            yield "TimingData", _line(event.car, {"Retired": event.out})
        case StatusChanged():
            yield "TrackStatus", {"Status": DIGITS[event.status]}
        case SessionOver():
            yield "SessionStatus", {"Status": "Finalised"}


def _line(car: int, line: dict[str, Any]) -> dict[str, Any]:
    return {"Lines": {str(car): line}}


def write_lines(path: Path, events: Iterable[Event]) -> Path:
    """A recording of live timing."""
    path.write_bytes(b"".join(line for _, line in live_timing_lines(events)))
    return path


# OpenF1

CONTROL: dict[int, dict[str, Any]] = {
    SC: {"message": "SAFETY CAR DEPLOYED", "flag": None, "scope": None},
    VSC: {"message": "VIRTUAL SAFETY CAR DEPLOYED", "flag": None, "scope": None},
    RED: {"message": "RED FLAG", "flag": "RED", "scope": "Track"},
    GREEN: {"message": "TRACK CLEAR", "flag": "CLEAR", "scope": "Track"},
}


def openf1_tables(events: Sequence[Event]) -> tuple[dict[str, Any], dict[str, list[dict[str, Any]]]]:
    """The row of the session, and rows by endpoint. Retirements have no row; stints say when they begin by their lap."""
    session = next(event for event in events if isinstance(event, Session))
    start_s = next(event.time_s for event in events if isinstance(event, LapCount))
    tables: dict[str, list[dict[str, Any]]] = {name: [] for name in ("drivers", "laps", "stints", "pit", "position", "race_control")}
    begun: dict[int, float] = {}
    entered: dict[int, PitIn] = {}
    laps: dict[int, int] = {}
    for event in events:
        match event:
            case Entry():
                tables["drivers"].append({"driver_number": event.car, "name_acronym": event.driver, "team_name": event.team})
            case LapCompleted():
                begin = begun.get(event.car, start_s)
                row = {"driver_number": event.car, "lap_number": event.lap, "date_start": at(begin), "lap_duration": event.lap_time_s}
                tables["laps"].append(row)
                begun[event.car], laps[event.car] = event.time_s, event.lap
            case Position():
                tables["position"].append({"driver_number": event.car, "date": at(event.time_s), "position": event.position})
            case PitIn():
                entered[event.car] = event
            case PitOut() if event.car in entered:
                entry = entered.pop(event.car)
                lane = {"lane_duration": round(event.time_s - entry.time_s, 3), "lap_number": entry.lap}
                tables["pit"].append({"driver_number": event.car, "date": at(event.time_s), **lane})
            case TyreFitted():
                stint = {"stint_number": event.stint, "lap_start": laps.get(event.car, 0) + 1, "compound": NAMES[event.compound or "S"]}
                tables["stints"].append({"driver_number": event.car, "tyre_age_at_start": event.laps_before, **stint})
            case StatusChanged() if event.time_s > start_s:
                tables["race_control"].append({"date": at(event.time_s), **CONTROL[event.status]})
    last = {row["driver_number"]: row for row in tables["laps"]}
    for car, latest in last.items():  # a lap that has begun has a row, as in OpenF1
        under_way = {"driver_number": car, "lap_number": latest["lap_number"] + 1, "date_start": at(begun[car]), "lap_duration": None}
        tables["laps"].append(under_way)
    row = {"session_key": 1, "session_name": "Race", "session_type": "Race", "year": session.season, "date_start": at(0.0)}
    return row | {"date_end": at(events[-1].time_s), "meeting_name": session.event}, tables


# a game


class GameTold:
    """Packets of format `season` that tell the events; each packet of laps and tyres holds all cars, as in a game."""

    def __init__(self, season: int, track: int) -> None:
        self.season, self.track, self.frame = season, track, 0
        self.slots: dict[int, int] = {}
        self.laps = blank(season, formats.LAP_DATA, 0, 0.0)
        self.status = blank(season, formats.CAR_STATUS, 0, 0.0)
        self.people = blank(season, formats.PARTICIPANTS, 0, 0.0)
        self.session = blank(season, formats.SESSION, 0, 0.0)
        self.begun: dict[int, float] = {}

    def packets(self, events: Iterable[Event]) -> Iterator[tuple[float, bytes]]:
        """Session time and datagram."""
        for event in events:
            for packet in self._packets(event):
                self.frame += 1
                packet["header"]["session_time_s"] = event.time_s
                packet["header"]["frame"] = packet["header"]["overall_frame"] = self.frame
                yield event.time_s, packet.tobytes()

    def _packets(self, event: Event) -> Iterator[Any]:
        slot = self.slots.get(getattr(event, "car", -1), -1)
        rows = self.laps["cars"]
        match event:
            case Session():
                self.session["total_laps"], self.session["track"], self.session["track_length_m"] = event.total_laps, self.track, 5000
                self.session["session_type"] = 10 if self.season == 2023 else 15
                yield self.session
            case Entry():
                self._enter(event)
            case TyreFitted():
                tyres = self.status["cars"]
                tyres["visual_compound"][slot] = {"S": 16, "M": 17, "H": 18}[event.compound or "S"]
                tyres["tyre_age_laps"][slot] = event.laps_before or 0
                if event.stint > 1:
                    yield self.status
            case LapCount() if event.lap == 1:
                self.begun = dict.fromkeys(self.slots.values(), event.time_s)
                self.people["active_cars"] = len(self.slots)
                yield from (self.people, self.laps, self.status)
            case LapCompleted():
                yield from self._lap(event, slot)
            case Position():
                rows["position"][slot] = event.position
                yield self.laps
            case PitIn() | PitOut():
                rows["pit_status"][slot] = isinstance(event, PitIn)
                yield self.laps
            case Retired():
                rows["result_status"][slot] = 7
                yield self.laps
            case StatusChanged() if event.status != RED:
                self.session["safety_car_status"] = {GREEN: 0, SC: 1, VSC: 2}[event.status]
                yield self.session

    def _enter(self, event: Entry) -> None:
        slot = self.slots[event.car] = len(self.slots)
        (driver,) = drivers_called(event.driver, self.season)
        self.people["cars"]["race_number"][slot], self.people["cars"]["name"][slot] = event.car, driver.surname.encode()
        rows = self.laps["cars"]
        rows["grid"][slot], rows["result_status"][slot], rows["lap"][slot], rows["position"][slot] = slot + 1, 2, 1, slot + 1

    def _lap(self, event: LapCompleted, slot: int) -> Iterator[Any]:
        rows, total = self.laps["cars"], int(self.session["total_laps"])
        driven_s = event.time_s - self.begun[slot] if event.lap_time_s is None else event.lap_time_s
        rows["last_lap_ms"][slot], rows["current_lap_ms"][slot] = round(driven_s * 1000), 0
        self.begun[slot] = event.time_s
        if event.lap == total:
            rows["result_status"][slot] = 3
        else:
            rows["lap"][slot] = event.lap + 1
        self.status["cars"]["tyre_age_laps"][slot] += 1
        yield self.laps
        yield self.status
