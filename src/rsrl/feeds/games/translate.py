"""Packets of the games to canonical events."""

from collections.abc import Callable, Iterator
from typing import Any, Final

import numpy as np

from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.events import Entry, Event, Gap, LapCount, OvertakeAid, RaceControl, Session, SessionOver, SetsLeft, StatusChanged, Weather
from rsrl.feeds.games import formats
from rsrl.feeds.games.car import GameCar, lap_columns
from rsrl.feeds.games.names import CarNames
from rsrl.feeds.games.packets import Packet
from rsrl.feeds.games.words import COMPOUNDS, PENALTIES, RAIN_FROM, session_kind, track_name
from rsrl.laps.schema import MOST_LAPS
from rsrl.season import GREEN, MAX_CARS, RED, SC, VSC

__all__ = ["GameFeed"]

GAPS_EVERY_S: Final = 1.0
"""The games tell gaps at every frame, up to 60 times a second."""

SAFETY_CAR: Final = {0: GREEN, 1: SC, 2: VSC, 3: GREEN}
"""Of the session packet; 3 is the formation lap."""

NEXT_SESSION_CODES: Final = (b"SSTA", b"LGOT")
LONGEST_FRONT_GAP_MS: Final = 60_000
"""In 2023 gaps have 16 bits, 65.5 s at most, and no minutes: from here on a gap may be another one."""

PER_CAR: Final = (formats.HISTORY, formats.TYRE_SETS)
"""Packets of one car each, in turn."""

MOST_EVENTS_KEPT: Final = 256


class GameFeed:
    """The events of one game, packet by packet.

    Packets may be lost, doubled or late: a packet older than the last of its kind tells nothing, and an event told twice is told once.
    Nothing is told before the session packet, which comes twice a second, and the participants, which come every five seconds.

    Args:
        anomalies: what could not be used is counted there.
    """

    def __init__(self, anomalies: Anomalies) -> None:
        self.anomalies = anomalies
        self._handlers: dict[int, Callable[[Packet, float], Iterator[Event]]] = {
            formats.LAP_DATA: self._lap_data,
            formats.EVENT: self._event,
            formats.PARTICIPANTS: self._participants,
            formats.CAR_STATUS: self._car_status,
            formats.CLASSIFICATION: self._classification,
            formats.HISTORY: self._history,
            formats.TYRE_SETS: self._tyre_sets,
        }
        self._uid: int | None = None
        self._forget()

    def _forget(self) -> None:
        self._session: Session | None = None
        self._track_length_m = 0
        self._frames: dict[tuple[int, int], int] = {}
        self._told_codes: dict[bytes, None] = {}
        self._names = CarNames()
        self._cars: dict[int, GameCar] = {}
        self._sets: dict[int, tuple[int, int, int]] = {}
        self._status = GREEN
        self._red_lap: int | None = None
        self._leader_lap = 0
        self._gaps_s = -GAPS_EVERY_S
        self._tyre_bytes = b""
        self._weather: tuple[float, float, bool] | None = None
        self._over = False

    def events(self, packet: Packet) -> list[Event]:
        """The events of a packet, none for one that tells nothing new."""
        header = packet.record["header"]
        uid, time_s = int(header["session_uid"]), float(header["session_time_s"])
        if not 0 <= time_s < 1e6 or not uid:  # not true of NaN; menus have no session
            return []
        if uid != self._uid:
            if packet.packet_id != formats.SESSION:
                return []
            self._uid = uid
            self._forget()
        if not self._is_new(packet, int(header["overall_frame"])):
            return []
        if packet.packet_id == formats.SESSION:
            return list(self._session_packet(packet, time_s))
        if packet.packet_id not in self._handlers or (packet.packet_id != formats.PARTICIPANTS and not self._names.cars):
            return []
        return list(self._handlers[packet.packet_id](packet, time_s))

    def _is_new(self, packet: Packet, frame: int) -> bool:
        """Whether a packet is no double and not overtaken by one of its kind; events of one frame are told apart by what they say."""
        if packet.packet_id == formats.EVENT:
            said = frame.to_bytes(4, "little") + packet.record.tobytes()[formats.HEADER.itemsize :]
            if said in self._told_codes:
                return False
            self._told_codes[said] = None
            if len(self._told_codes) > MOST_EVENTS_KEPT:
                del self._told_codes[next(iter(self._told_codes))]
            return True
        kind = packet.packet_id, int(packet.record["car"]) if packet.packet_id in PER_CAR else -1
        if frame <= self._frames.get(kind, -1):
            return False
        self._frames[kind] = frame
        return True

    def _session_packet(self, packet: Packet, time_s: float) -> Iterator[Event]:
        record = packet.record
        self._track_length_m = int(record["track_length_m"])
        if self._session is None:
            kind = session_kind(packet.season, int(record["session_type"]))
            laps = int(record["total_laps"]) or None
            self._session = Session(time_s, kind, track_name(int(record["track"])), packet.season, laps if kind == "race" else None)
            yield self._session
        weather = float(record["air_c"]), float(record["track_c"]), int(record["weather"]) >= RAIN_FROM
        if weather != self._weather:
            self._weather = weather
            yield Weather(time_s, *weather)
        if self._red_lap is None:
            yield from self._track_status(SAFETY_CAR.get(int(record["safety_car_status"]), self._status), time_s)

    def _track_status(self, status: int, time_s: float) -> Iterator[Event]:
        if status != self._status:
            self._status = status
            yield StatusChanged(time_s, status)

    def _participants(self, packet: Packet, time_s: float) -> Iterator[Event]:
        for slot, driver in self._names.update(packet.record["cars"], int(packet.record["active_cars"]), packet.season):
            car = self._names.cars[slot]
            grid = self._cars[car].grid if car in self._cars else None
            yield Entry(time_s, car, driver, None, grid)

    def _lap_data(self, packet: Packet, time_s: float) -> Iterator[Event]:
        cars = packet.record["cars"]
        leader = 0
        for slot, now in enumerate(lap_columns(cars)):
            car = self._names.cars.get(slot)
            if car is None or now.result_status < 2:
                continue
            if now.lap > MOST_LAPS or now.position > MAX_CARS:
                self.anomalies.add("no lap of a race", f"car {car}: lap {now.lap}, place {now.position}")
                continue
            if car not in self._cars:
                grid = int(cars["grid"][slot])
                self._cars[car] = GameCar(car, grid or None)
                yield Entry(time_s, car, self._names.drivers[slot], None, grid or None)
            yield from self._cars[car].update(now, time_s)
            leader = max(leader, now.lap)
        yield from self._leader(leader, time_s)
        if abs(time_s - self._gaps_s) >= GAPS_EVERY_S:
            self._gaps_s = time_s
            yield from self._gaps(cars, time_s, packet.season)

    def _leader(self, lap: int, time_s: float) -> Iterator[Event]:
        total = self._session.total_laps if self._session else None
        if lap > self._leader_lap and (total is None or lap <= total):
            self._leader_lap = lap
            yield LapCount(time_s, lap, total)
        if self._red_lap is not None and self._leader_lap > self._red_lap:
            self._red_lap = None  # racing again: the session packet says under what status

    def _gaps(self, cars: np.ndarray, time_s: float, season: int) -> Iterator[Event]:
        """Gaps of all cars in the race, front to back. In 2023 the gap to the leader is summed up, for want of its minutes."""
        rows = [(int(cars["position"][slot]), slot) for slot in self._names.cars if cars["result_status"][slot] == 2]
        if not rows:
            return
        leading = float(max(cars["total_distance_m"][slot] for _, slot in rows))
        summed_s: float | None = 0.0
        for place, (_, slot) in enumerate(sorted(rows)):
            row = cars[slot]
            interval_s: float | None = _seconds(row, "front_gap", season)
            if place == 0:
                interval_s = None
            elif season == 2023:
                interval_s = None if row["front_gap_ms"] >= LONGEST_FRONT_GAP_MS else interval_s
                summed_s = None if summed_s is None or interval_s is None else summed_s + interval_s
            gap_s = summed_s if season == 2023 or place == 0 else _seconds(row, "leader_gap", season)
            behind_m = leading - float(row["total_distance_m"])
            down = int(behind_m // self._track_length_m) if self._track_length_m and 0 <= behind_m < 1e6 else 0
            yield Gap(time_s, self._names.cars[slot], None if down else gap_s, down, interval_s)

    def _car_status(self, packet: Packet, time_s: float) -> Iterator[Event]:
        cars = packet.record["cars"]
        said = cars["visual_compound"].tobytes() + cars["tyre_age_laps"].tobytes()
        if said == self._tyre_bytes or not self._cars:
            return
        self._tyre_bytes = said
        for slot, car in self._names.cars.items():
            if car in self._cars:
                yield from self._cars[car].tyres(int(cars["visual_compound"][slot]), int(cars["tyre_age_laps"][slot]), time_s)

    def _tyre_sets(self, packet: Packet, time_s: float) -> Iterator[Event]:
        car = self._names.cars.get(int(packet.record["car"]))
        if car is None:
            return
        sets = packet.record["sets"]
        free = [COMPOUNDS.get(int(one["visual_compound"])) for one in sets if one["available"] and not one["fitted"]]
        left = free.count("S"), free.count("M"), free.count("H")
        if self._sets.get(car) != left:
            self._sets[car] = left
            yield SetsLeft(time_s, car, *left)

    def _history(self, packet: Packet, time_s: float) -> Iterator[Event]:
        """Laps that no LapData told of, since packets were lost; the last lap of the list is under way."""
        car = self._cars.get(self._names.cars.get(int(packet.record["car"]), -1))
        if car is None:
            return
        for index in range(min(int(packet.record["lap_count"]), 100)):
            lap_ms = int(packet.record["laps"]["lap_ms"][index])
            if lap_ms and index + 1 < car.lap:
                yield from car.completed(index + 1, lap_ms, time_s, at_line=False)

    def _event(self, packet: Packet, time_s: float) -> Iterator[Event]:
        code, details = bytes(packet.record["code"]), packet.record["details"]
        if code in (b"DRSE", b"DRSD"):
            yield OvertakeAid(time_s, code == b"DRSE")
        elif code == b"RDFL":
            self._red_lap = self._leader_lap
            yield from self._track_status(RED, time_s)
        elif code in NEXT_SESSION_CODES:
            self._red_lap = None
        elif code == b"SEND":
            yield from self._ended(time_s)
        elif code == b"FLBK":
            self.anomalies.add("flashback", f"to {details[4:8].copy().view('<f4')[0]:.0f} s")
        elif code in (b"PENA", b"DTSV", b"SGSV"):
            yield from self._penalty(code, details, time_s)

    def _penalty(self, code: bytes, details: np.ndarray, time_s: float) -> Iterator[Event]:
        if code != b"PENA":
            car = self._names.cars.get(int(details[0]))
            if car is not None:
                yield RaceControl(time_s, "PENALTY SERVED", "penalty served", car)
            return
        topic, car = PENALTIES.get(int(details[0])), self._names.cars.get(int(details[2]))
        if topic and car is not None:
            seconds = float(details[4]) if topic == "time penalty" and details[4] != 255 else None
            yield RaceControl(time_s, topic.upper(), topic, car, seconds)

    def _classification(self, packet: Packet, time_s: float) -> Iterator[Event]:
        cars = packet.record["cars"]
        for slot, number in self._names.cars.items():
            car, laps = self._cars.get(number), int(cars["laps"][slot])
            if car is not None and 0 < laps <= MOST_LAPS and int(cars["result_status"][slot]) == 3 and laps not in car.laps:
                yield from car.completed(laps, 0, time_s, at_line=False)
        yield from self._ended(time_s)

    def _ended(self, time_s: float) -> Iterator[Event]:
        if not self._over:
            self._over = True
            yield SessionOver(time_s)


def _seconds(row: Any, name: str, season: int) -> float:
    """A gap of LapData, which has its minutes in a field of its own from 2024 on."""
    minutes = 0 if season == 2023 else int(row[f"{name}_minutes"])
    return 60.0 * minutes + float(row[f"{name}_ms"]) / 1000
