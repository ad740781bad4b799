"""A race as a game would send it: packets of every kind that is read, and what is true of it."""

import random
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from rsrl.feeds.games import formats
from rsrl.feeds.games.formats import packet_type

UID = 4711
LANE_S, TRACK_M = 20.0, 5000
LAP_HZ, OTHER_HZ = 2, 1


def blank(season: int, packet_id: int, frame: int, time_s: float, uid: int = UID) -> Any:
    """A packet with its header and nothing else."""
    kind = packet_type(season, packet_id)
    assert kind is not None
    packet = np.zeros((), kind)
    header = packet["header"]
    header["packet_format"], header["packet_id"], header["packet_version"], header["session_uid"] = season, packet_id, 1, uid
    header["session_time_s"], header["frame"], header["overall_frame"] = time_s, frame, frame
    return packet


class GameRace:
    """A race of `cars` cars over `laps` laps, one stop each, a safety car from lap `laps // 3`; lap data come `hz` times a second.

    Attributes:
        crossings: when each car ends each lap, s; (cars, laps).
        stop_lap: the lap at whose end each car stops.
    """

    def __init__(self, season: int, cars: int, laps: int, seed: int = 1, hz: int = LAP_HZ) -> None:
        self.hz = hz
        rng = np.random.default_rng(seed)
        self.season, self.cars, self.laps = season, cars, laps
        self.stop_lap = 2 + np.arange(cars) % max(laps - 3, 1)
        times = 90 + 0.2 * np.arange(cars)[:, None] + rng.normal(0, 0.5, (cars, laps))
        times[:, 0] += 5 + 0.4 * np.arange(cars)
        for car, lap in enumerate(self.stop_lap):
            times[car, lap] += LANE_S
        self.lap_ms = np.round(times * 1000).astype(np.int64)
        self.crossings = np.cumsum(self.lap_ms, axis=1) / 1000
        self.finish_s = np.array([self.crossings[car, laps - 1] for car in range(cars)])
        self.sc = (float(self.crossings[0, laps // 3]), float(self.crossings[0, laps // 3 + 1]))

    def packets(self) -> Iterator[tuple[float, bytes]]:
        """Session time and datagram, in order."""
        end_s = float(self.finish_s.max()) + 3
        for frame in range(int(end_s * self.hz)):
            time_s = frame / self.hz
            if frame % (self.hz // OTHER_HZ) == 0:
                yield time_s, self._session(frame, time_s).tobytes()
            if frame % (self.hz * 5) == 0:
                yield time_s, self._participants(frame, time_s).tobytes()
            yield time_s, self._lap_data(frame, time_s).tobytes()
            if frame % (self.hz // OTHER_HZ) == 0:
                yield time_s, self._car_status(frame, time_s).tobytes()
        yield end_s, self._classification(int(end_s * self.hz), end_s).tobytes()

    def _session(self, frame: int, time_s: float) -> Any:
        packet = blank(self.season, formats.SESSION, frame, time_s)
        packet["total_laps"], packet["track"], packet["track_length_m"], packet["session_type"] = self.laps, 3, TRACK_M, self._race_type()
        packet["safety_car_status"] = int(self.sc[0] <= time_s < self.sc[1])
        packet["air_c"], packet["track_c"] = 25, 35
        return packet

    def _race_type(self) -> int:
        return 10 if self.season == 2023 else 15

    def _participants(self, frame: int, time_s: float) -> Any:
        packet = blank(self.season, formats.PARTICIPANTS, frame, time_s)
        packet["active_cars"] = self.cars
        for car in range(self.cars):
            packet["cars"]["race_number"][car] = car + 1
            packet["cars"]["name"][car] = f"{chr(65 + car)}XQ Driver".encode()
        return packet

    def _lap_data(self, frame: int, time_s: float) -> Any:
        packet = blank(self.season, formats.LAP_DATA, frame, time_s)
        rows = packet["cars"][: self.cars]
        done = (self.crossings <= time_s).sum(axis=1)
        finished = done >= self.laps
        begun = np.where(done > 0, self.crossings[np.arange(self.cars), np.minimum(done, self.laps) - 1], 0.0)
        lap = np.minimum(done, self.laps - 1)
        share = np.minimum((time_s - begun) / (self.lap_ms[np.arange(self.cars), lap] / 1000), 1.0)
        distance = np.where(finished, self.laps, done + share)
        order = np.lexsort((np.where(finished, self.finish_s, 0), -distance))
        rows["position"][order] = np.arange(1, self.cars + 1)
        rows["lap"] = np.minimum(done + 1, self.laps)
        rows["current_lap_ms"] = np.round((time_s - begun) * 1000)
        rows["last_lap_ms"] = np.where(done > 0, self.lap_ms[np.arange(self.cars), done - 1], 0)
        rows["result_status"] = np.where(finished, 3, 2)
        rows["grid"] = np.arange(1, self.cars + 1)
        rows["total_distance_m"] = distance * TRACK_M
        stop_s = self.crossings[np.arange(self.cars), self.stop_lap - 1]
        rows["pit_status"] = (time_s >= stop_s - 5) & (time_s < stop_s + LANE_S - 5)
        gap_ms = np.clip(np.round((distance[order][0] - distance) * 90_000), 0, None)
        if self.season == 2023:
            rows["leader_gap_ms"] = np.minimum(gap_ms, 65_535)
        else:
            rows["leader_gap_minutes"], rows["leader_gap_ms"] = gap_ms // 60_000, gap_ms % 60_000
        front = np.zeros(self.cars)
        front[order[1:]] = gap_ms[order[1:]] - gap_ms[order[:-1]]
        rows["front_gap_ms"] = np.clip(front, 0, 65_535)
        return packet

    def _car_status(self, frame: int, time_s: float) -> Any:
        packet = blank(self.season, formats.CAR_STATUS, frame, time_s)
        rows = packet["cars"][: self.cars]
        done = (self.crossings <= time_s).sum(axis=1)
        stop_s = self.crossings[np.arange(self.cars), self.stop_lap - 1] + 5
        stopped = time_s >= stop_s
        rows["visual_compound"] = np.where(stopped, 18, 16)
        rows["compound"] = np.where(stopped, 20, 18)
        rows["tyre_age_laps"] = np.where(stopped, done - self.stop_lap, done)
        return packet

    def _classification(self, frame: int, time_s: float) -> Any:
        packet = blank(self.season, formats.CLASSIFICATION, frame, time_s)
        packet["car_count"] = self.cars
        rows = packet["cars"][: self.cars]
        rows["laps"], rows["result_status"] = self.laps, 3
        rows["position"][np.argsort(self.finish_s)] = np.arange(1, self.cars + 1)
        return packet


def disturbed(packets: Iterable[tuple[float, bytes]], seed: int, share: float = 0.01) -> Iterator[tuple[float, bytes]]:
    """Packets of which `share` are lost, as many come twice, and as many are overtaken by the four after them; the last one comes."""
    rng = random.Random(seed)
    late: list[tuple[int, tuple[float, bytes]]] = []
    packet: tuple[float, bytes] | None = None
    for i, packet in enumerate(packets):
        fate = rng.random()
        if fate < share:
            continue
        if fate < 2 * share:
            late.append((i + 4, packet))
        else:
            yield packet
        if fate > 1 - share:
            yield packet
        while late and late[0][0] <= i:
            yield late.pop(0)[1]
    if packet is not None:
        yield packet
