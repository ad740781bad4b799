"""Messages of live timing to canonical events."""

from collections.abc import Callable, Iterator
from typing import Any, Final, Literal

from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.events import Entry, Event, Heartbeat, LapCount, Session, SessionOver, StatusChanged, TyreFitted, Weather
from rsrl.feeds.live_timing.merge import merge
from rsrl.feeds.live_timing.messages import Message
from rsrl.feeds.live_timing.race_control import race_control_events
from rsrl.feeds.live_timing.stints import LAST_OLD_SEASON, OldCompounds, stint_events
from rsrl.feeds.live_timing.timing import TOLD, CarTiming, Progress
from rsrl.feeds.live_timing.values import decimal, flag, mapping, whole
from rsrl.laps.schema import MOST_LAPS
from rsrl.season import GREEN, MAX_CARS, RED, SC, VSC
from rsrl.season.drivers import drivers_called

__all__ = ["LiveTiming"]

STATUS: Final = {"1": GREEN, "2": GREEN, "4": SC, "5": RED, "6": VSC, "7": VSC}
"""Of TrackStatus: clear, yellow, safety car, red flag, virtual safety car deployed and ending."""

STATUS_WORDS: Final = {"AllClear": "1", "Yellow": "2", "SCDeployed": "4", "Red": "5", "VSCDeployed": "6", "VSCEnding": "7"}
"""The same in SessionData."""

QUALIFYING_KEYS: Final = ("SessionPart", "NoEntries", "CutOffTime")
HIGHEST_NUMBER: Final = 99
HEARD_EVERY_S: Final = 1.0
Kind = Literal["race", "sprint", "qualifying", "practice"]
KINDS: Final[dict[str, Kind]] = {"Race": "race", "Qualifying": "qualifying", "Practice": "practice"}


class LiveTiming:
    """The events of one feed, message by message.

    A car is one that the timing has a line for: the list of drivers may hold those of a support race too, and may name one of them for a
    number that a car has; the driver named first stays. Where nobody names the driver of a car, the season's numbers do, else the number
    itself stands for the code.

    Args:
        anomalies: what could not be used is counted there.
        season: where the feed does not say; some recordings begin too late for it. 0 for unknown.
    """

    def __init__(self, anomalies: Anomalies, season: int = 0) -> None:
        self.anomalies, self._default_season = anomalies, season
        self._handlers: dict[str, Callable[[Message], Iterator[Event]]] = {
            "SessionInfo": self._session_info,
            "SessionStatus": self._session_status,
            "SessionData": self._session_data,
            "LapCount": self._lap_count,
            "DriverList": self._driver_list,
            "TrackStatus": self._track_status,
            "TimingData": self._timing,
            "TimingAppData": self._tyres,
            "RaceControlMessages": self._race_control,
            "WeatherData": self._weather,
            "Heartbeat": self._heartbeat,
        }
        self._key: object = None
        self._forget()

    def _forget(self) -> None:
        """A session begins: nothing of the one before holds."""
        self._told_session: Session | None = None
        self._kind: Kind = "race"
        self._event, self._season = "", self._default_season
        self._progress = Progress()
        self._timed: dict[str, CarTiming] = {}  # by number, as the feed writes it
        self._drivers: dict[str, Any] = {}
        self._tyre_lines: dict[str, Any] = {}
        self._entries: dict[int, Entry] = {}
        self._tyres_told: dict[tuple[int, int], TyreFitted] = {}
        self._old_compounds = OldCompounds()
        self._heard_s = 0.0
        self._waiting = False
        self._status: int | None = None
        self._status_topic = self._over = False
        self._messages_told: dict[str, str] = {}
        self._air: tuple[float | None, float | None, bool | None] = (None, None, None)

    def events(self, message: Message) -> list[Event]:
        """The events of a message, none for one that tells nothing new. The message's stamp is on the session clock."""
        found = list(self._handlers[message.topic](message))
        if message.topic == "TimingData":
            found += self._heard(message.stamp_s or 0.0, told=bool(found))
        if found and self._told_session is None:
            session = Session(message.stamp_s or 0.0, self._kind, self._event, self._season, self._progress.total_laps)
            self._told_session = session
            found.insert(0, session)
        return found

    def _heard(self, time_s: float, *, told: bool) -> list[Event]:
        """That cars were told of, once a second, where all that was told (sectors, speeds) is no event."""
        if not told and (not self._entries or 0 <= time_s - self._heard_s < HEARD_EVERY_S):
            return []
        self._heard_s = time_s
        return [] if told else [Heartbeat(time_s, on_track=True)]

    def _session_info(self, message: Message) -> Iterator[Event]:
        info = message.payload
        key, kind, name = info.get("Key"), info.get("Type"), info.get("Name")
        if not isinstance(kind, str) or kind not in KINDS or not isinstance(key, int):
            self.anomalies.add("no session", repr(kind))
            return
        named_late = self._key is None and info.get("SessionStatus") != "Inactive"
        if self._told_session is not None and (key == self._key or named_late):
            self._key = key  # more about the session that is on, or at last its name
            return
        self._forget()
        self._key = key
        sprint = isinstance(name, str) and "SPRINT" in name.upper()
        self._kind = "sprint" if sprint and kind == "Race" else KINDS[kind]
        event, start = mapping(info.get("Meeting")).get("Name"), info.get("StartDate")
        self._event = event if isinstance(event, str) else ""
        self._season = (whole(start[:4], 2999) if isinstance(start, str) else None) or self._season
        self._told_session = Session(message.stamp_s or 0.0, self._kind, self._event, self._season)
        yield self._told_session

    def _session_status(self, message: Message) -> Iterator[Event]:
        return self._session_word(message.payload.get("Status"), message.stamp_s or 0.0)

    def _session_word(self, word: object, time_s: float) -> Iterator[Event]:
        if word == "Started":
            self._progress.started = True
            if self._progress.leader_lap == 1 and self._waiting:
                self._waiting = False
                yield LapCount(time_s, 1, self._progress.total_laps)
        elif word == "Finished":
            self._progress.finished = True
        elif word in ("Finalised", "Ends") and not self._over:
            self._over = True
            yield SessionOver(time_s)

    def _session_data(self, message: Message) -> Iterator[Event]:
        """A second source of the lap, the track status and the session's, of which the last words count."""
        time_s = message.stamp_s or 0.0
        laps = [whole(mapping(entry).get("Lap"), MOST_LAPS) or 0 for entry in mapping(message.payload.get("Series")).values()]
        yield from self._lap(max(laps, default=0), time_s)
        for entry in mapping(message.payload.get("StatusSeries")).values():
            yield from self._session_word(mapping(entry).get("SessionStatus"), time_s)
            word = mapping(entry).get("TrackStatus")
            if isinstance(word, str) and not self._status_topic:
                yield from self._status_digit(STATUS_WORDS.get(word), time_s)

    def _lap_count(self, message: Message) -> Iterator[Event]:
        total = whole(message.payload.get("TotalLaps"), MOST_LAPS)
        if total and total != self._progress.total_laps:
            self._progress.total_laps = total
            if (lap := self._progress.leader_lap) is not None and not self._waiting:
                yield LapCount(message.stamp_s or 0.0, lap, total)
        yield from self._lap(whole(message.payload.get("CurrentLap"), MOST_LAPS), message.stamp_s or 0.0)

    def _lap(self, lap: int | None, time_s: float) -> Iterator[Event]:
        if not lap or lap <= (self._progress.leader_lap or 0):
            return
        self._progress.leader_lap = lap
        self._progress.started = self._progress.started or lap > 1
        self._waiting = not self._progress.started  # lap 1 is counted long before the start, and is told of when it begins
        if not self._waiting:
            yield LapCount(time_s, lap, self._progress.total_laps)

    def _track_status(self, message: Message) -> Iterator[Event]:
        self._status_topic = True
        return self._status_digit(message.payload.get("Status"), message.stamp_s or 0.0)

    def _status_digit(self, digit: object, time_s: float) -> Iterator[Event]:
        status = STATUS.get(digit) if isinstance(digit, str) else None
        if status is None:
            self.anomalies.add("unknown track status", repr(digit))
        elif status != self._status:
            self._status = status
            yield StatusChanged(time_s, status)

    def _driver_list(self, message: Message) -> Iterator[Event]:
        for number, line in message.payload.items():
            if not isinstance(line, dict):
                continue
            known = mapping(self._drivers.get(number)).get("Tla")
            if known and line.get("Tla", known) != known:
                self.anomalies.add("another driver for a number", f"{number}: {line['Tla']} after {known}")
            else:
                merge(self._drivers, {number: line})
        for car in list(self._entries):
            yield from self._entry(car, message.stamp_s or 0.0)

    def _entry(self, car: int, time_s: float) -> Iterator[Event]:
        """The entry of a car that has a line, where it is new or says more than before."""
        about, tyres = mapping(self._drivers.get(str(car))), mapping(self._tyre_lines.get(str(car)))
        code, team = about.get("Tla"), about.get("TeamName")
        if not (isinstance(code, str) and len(code) == 3):
            called = drivers_called(str(car), self._season)
            code = called[0].code if len(called) == 1 else str(car)
        entry = Entry(time_s, car, code, team if isinstance(team, str) else None, whole(tyres.get("GridPos"), MAX_CARS) or None)
        old = self._entries.get(car)
        if old is None or (old.driver, old.team, old.grid) != (entry.driver, entry.team, entry.grid):
            self._entries[car] = entry
            yield entry

    def _lines(self, message: Message) -> Iterator[tuple[int, dict[str, Any]]]:
        """The cars of a message and their lines."""
        for number, line in mapping(message.payload.get("Lines")).items():
            car = whole(number, HIGHEST_NUMBER)
            if car is None or not isinstance(line, dict):
                self.anomalies.add("no line of a car", repr(number))
            elif car not in self._entries and len(self._entries) >= MAX_CARS:
                self.anomalies.add("more cars than a race has", str(car))
            else:
                yield car, line

    def _timing(self, message: Message) -> Iterator[Event]:
        if self._told_session is None and any(key in message.payload for key in QUALIFYING_KEYS):
            self._kind = "qualifying"
        time_s = message.stamp_s or 0.0
        lines = mapping(message.payload.get("Lines"))
        if lines.keys() <= self._timed.keys() and all(isinstance(line, dict) for line in lines.values()):
            for number, line in lines.items():  # as nearly every message: of cars that are known
                if not TOLD.isdisjoint(line):
                    yield from self._timed[number].update(line, time_s, message.snapshot)
            return
        for car, line in self._lines(message):
            if car not in self._entries:
                yield from self._entry(car, time_s)
            timing = self._timed.setdefault(str(car), CarTiming(car, self._progress, self.anomalies))
            yield from timing.update(line, time_s, message.snapshot)

    def _tyres(self, message: Message) -> Iterator[Event]:
        time_s = message.stamp_s or 0.0
        old = self._old_compounds if 0 < self._season <= LAST_OLD_SEASON else None
        for car, line in self._lines(message):
            names = len(self._old_compounds.seen)
            merge(self._tyre_lines, {str(car): line})
            if car not in self._entries or "GridPos" in line:
                yield from self._entry(car, time_s)
            if "Stints" in line:
                yield from self._stints(car, old, time_s, message.snapshot)
            if old and len(old.seen) != names:  # what the names of the other cars mean may be known now
                for other in self._entries:
                    yield from self._stints(other, old, time_s, message.snapshot)

    def _stints(self, car: int, old: OldCompounds | None, time_s: float, snapshot: bool) -> Iterator[Event]:
        stints = mapping(mapping(self._tyre_lines.get(str(car))).get("Stints"))
        return stint_events(car, stints, self._tyres_told, old, time_s, snapshot)

    def _race_control(self, message: Message) -> Iterator[Event]:
        for index, entry in mapping(message.payload.get("Messages")).items():
            text = mapping(entry).get("Message")
            if isinstance(text, str) and self._messages_told.get(index) != text:
                self._messages_told[index] = text
                yield from race_control_events(text, message.stamp_s or 0.0)

    def _heartbeat(self, message: Message) -> Iterator[Event]:
        utc = message.payload.get("Utc")
        if not self._season and isinstance(utc, str):
            self._season = whole(utc[:4], 2999) or 0
        yield Heartbeat(message.stamp_s or 0.0)

    def _weather(self, message: Message) -> Iterator[Event]:
        air_c, track_c, rain = self._air
        new = decimal(message.payload.get("AirTemp")), decimal(message.payload.get("TrackTemp")), flag(message.payload.get("Rainfall"))
        self._air = (air_c if new[0] is None else new[0], track_c if new[1] is None else new[1], rain if new[2] is None else new[2])
        if self._air != (air_c, track_c, rain):
            yield Weather(message.stamp_s or 0.0, *self._air)
