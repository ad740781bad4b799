"""The games' packets: layouts, real packets of F1 23, and whole races over UDP."""

import asyncio
import socket
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from game_race import GameRace, blank, disturbed
from live_timing_lines import only

from rsrl.errors import RsrlError
from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.events import (
    Entry,
    Event,
    Gap,
    LapCompleted,
    LapCount,
    OvertakeAid,
    PitIn,
    PitOut,
    Position,
    RaceControl,
    Retired,
    Session,
    SessionOver,
    SetsLeft,
    StatusChanged,
    TyreFitted,
    Weather,
)
from rsrl.feeds.games import GameFeed, PacketWriter, decode, formats, game_events, listen, live_game_events, play, read_packets
from rsrl.feeds.games.formats import FORMATS, HEADER, SIZES, car_slots, packet_type
from rsrl.feeds.games.words import session_kind, track_name
from rsrl.season import GREEN, RED, SC


def events_of(packets: Iterable[tuple[float, bytes]], faults: Anomalies | None = None) -> list[Event]:
    faults = faults or Anomalies()
    feed = GameFeed(faults)
    decoded = (decode(data, faults) for _, data in packets)
    return [event for packet in decoded if packet for event in feed.events(packet)]


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


@pytest.mark.parametrize("packet_id", SIZES)
@pytest.mark.parametrize("season", FORMATS)
def test_layouts_have_the_sizes_of_their_season(season: int, packet_id: int) -> None:
    kind = packet_type(season, packet_id)
    assert HEADER.itemsize == 29
    assert kind is None or kind.itemsize == SIZES[packet_id][FORMATS.index(season)]
    assert (kind is None) == (packet_id in (0, 5, 6, 9, 13))


def test_there_are_24_slots_from_2026_on() -> None:
    assert [car_slots(season) for season in FORMATS] == [22, 22, 22, 24]
    assert packet_type(2022, 1) is None


@pytest.mark.real_data
def test_every_real_packet_of_f1_23_is_decoded(real_data: Path) -> None:
    faults = Anomalies()
    read = set()
    for path in sorted((real_data / "f1_23_udp" / "packets").glob("*.bin")):
        packet = decode(path.read_bytes(), faults)
        if packet:
            read.add(packet.packet_id)
            assert packet.record["header"]["packet_format"] == 2023
            assert packet.record.tobytes() == path.read_bytes()
    assert read == {1, 2, 3, 4, 7, 8, 10, 11, 12}
    assert not faults.counts


@pytest.mark.real_data
def test_the_real_opening_of_a_race_is_told(real_data: Path) -> None:
    names = ["2023-01", "2023-04", "2023-02", "2023-07", "2023-12", "2023-03-DRSE", "2023-03-RDFL", "2023-03-SEND"]
    packets = [(0.0, (real_data / "f1_23_udp" / "packets" / f"{name}.bin").read_bytes()) for name in names]
    events = events_of(packets)
    assert events[0] == Session(0.0, "race", "Melbourne", 2023, 5)
    assert events[1] == Weather(0.0, 34.0, 38.0, False)
    entries = {entry.car: entry for entry in only(Entry, events)}
    assert len(entries) == 20
    assert (entries[27].driver, entries[27].grid) == ("HUL", 13)
    assert {entry.driver for entry in entries.values()} >= {"VER", "ALO", "SAR", "ZHO"}
    assert {(tyre.compound, tyre.laps_before, tyre.stint) for tyre in only(TyreFitted, events)} == {("S", 0, 1)}
    assert only(SetsLeft, events) == [SetsLeft(0.0, 27, 1, 2, 2)]
    assert only(StatusChanged, events)[-1].status == RED
    assert not only(OvertakeAid, events), "that packet is of another session"
    assert isinstance(events[-1], SessionOver)


@pytest.mark.real_data
def test_the_real_final_classification_has_what_the_game_showed(real_data: Path) -> None:
    packet = decode((real_data / "f1_23_udp" / "packets" / "2023-08.bin").read_bytes(), Anomalies())
    assert packet
    cars = packet.record["cars"][: int(packet.record["car_count"])]
    assert sorted(cars["position"].tolist()) == list(range(1, 21))
    winner = cars[cars["position"] == 1][0]
    assert (int(winner["laps"]), round(float(winner["race_time_s"]), 3), int(winner["best_lap_ms"])) == (5, 406.032, 79686)


def check_race(race: GameRace, events: list[Event]) -> None:
    """Every lap, stop, set and status of a race, to the millisecond."""
    laps = {(lap.car - 1, lap.lap): lap for lap in only(LapCompleted, events)}
    assert set(laps) == {(car, lap) for car in range(race.cars) for lap in range(1, race.laps + 1)}
    for (car, lap), told in laps.items():
        assert told.lap_time_s == race.lap_ms[car, lap - 1] / 1000
        assert abs(told.time_s - race.crossings[car, lap - 1]) < 0.002
    for lap in range(1, race.laps):
        order = sorted(range(race.cars), key=lambda car: laps[car, lap].time_s)
        assert order == np.argsort(race.crossings[:, lap - 1]).tolist()
    assert {(stop.car - 1, stop.lap) for stop in only(PitIn, events)} == set(enumerate(race.stop_lap.tolist()))
    assert {(stop.car - 1, stop.lap) for stop in only(PitOut, events)} == {(car, lap + 1) for car, lap in enumerate(race.stop_lap.tolist())}
    sets = {(tyre.car, tyre.stint): (tyre.compound, tyre.new) for tyre in only(TyreFitted, events)}
    assert sets == {(car + 1, stint): (letter, True) for car in range(race.cars) for stint, letter in ((1, "S"), (2, "H"))}
    assert [status.status for status in only(StatusChanged, events)] == [SC, GREEN]
    assert only(LapCount, events)[-1].lap == race.laps
    last = {position.car - 1: position.position for position in only(Position, events)}
    assert sorted(last, key=last.__getitem__) == np.argsort(race.finish_s).tolist()
    assert len(only(SessionOver, events)) == len(only(Session, events)) == 1


@pytest.mark.parametrize("season", FORMATS)
def test_a_race_of_every_season_is_told_whole(season: int) -> None:
    race = GameRace(season, cars=20, laps=4)
    events = events_of(race.packets())
    check_race(race, events)
    gaps = [gap for gap in only(Gap, events) if gap.time_s > 200]
    assert all(gap.gap_to_leader_s is not None and 0 <= gap.gap_to_leader_s < 65 for gap in gaps)
    assert {gap.interval_s is None for gap in gaps if not gap.gap_to_leader_s} >= {True}


async def over_udp(race: GameRace, seed: int, faults: Anomalies) -> list[Event]:
    """The events of a race sent to a port of this machine, disturbed on its way."""
    port = free_port()

    async def receive() -> list[Event]:
        return [event async for event in live_game_events(port, faults, patience_s=2.0)]

    receiver = asyncio.create_task(receive())
    await asyncio.sleep(0.1)
    await play(disturbed(race.packets(), seed), port, speed=1e9)
    return await receiver


def test_a_short_race_over_udp_is_told_whole_though_packets_are_lost_doubled_and_late() -> None:
    faults = Anomalies()
    race = GameRace(2025, cars=22, laps=6)
    check_race(race, asyncio.run(over_udp(race, 7, faults)))
    assert not faults.counts


@pytest.mark.slow
def test_a_race_of_57_laps_and_22_cars_over_udp_is_told_whole() -> None:
    race = GameRace(2026, cars=22, laps=57)
    check_race(race, asyncio.run(over_udp(race, 11, Anomalies())))


def test_a_recording_is_read_as_it_was_written_and_its_end_may_be_cut(tmp_path: Path) -> None:
    race = GameRace(2024, cars=4, laps=4)
    packets = list(race.packets())
    path = tmp_path / "race.packets"
    with PacketWriter(path) as writer:
        for since_s, data in packets:
            writer.write(since_s, data)
    assert list(read_packets(path, Anomalies())) == packets
    check_race(race, list(game_events(path)))
    whole = path.read_bytes()
    for cut in (1, 3, len(packets[-1][1]) + 4):
        path.write_bytes(whole[:-cut])
        faults = Anomalies()
        assert list(read_packets(path, faults)) == packets[:-1]
        assert faults.counts == {"half-written last packet": 1}


def test_what_is_no_recording_of_a_game_is_told_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "laps.csv").write_text("season,round\n")
    with pytest.raises(RsrlError, match=r"no recording of a game's packets; rsrl record game makes one"):
        list(game_events(tmp_path / "laps.csv"))
    with pytest.raises(RsrlError, match="cannot be read"):
        list(game_events(tmp_path / "absent"))
    with pytest.raises(RsrlError, match="cannot be written"):
        PacketWriter(tmp_path / "absent" / "race.packets")


def test_a_port_in_use_is_told_in_one_line() -> None:
    async def twice() -> None:
        async for _ in listen(port, Anomalies(), "127.0.0.1"):
            pass

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as holder:
        holder.bind(("127.0.0.1", 0))
        port = holder.getsockname()[1]
        with pytest.raises(RsrlError, match=rf"UDP port {port}: another program listens there; give another one with --port"):
            asyncio.run(twice())


def test_packets_of_other_formats_are_named_once_and_counted() -> None:
    faults = Anomalies()
    old = (2022).to_bytes(2, "little") + bytes(1000)
    assert [decode(data, faults) for data in (old, old, b"", bytes(40), bytes(29))] == [None] * 5
    assert faults.counts == {"packets of format 2022": 2, "no packet of a game": 3}
    assert faults.examples[0].startswith("packets of format 2022: RSRL reads 2023 to 2026")
    right = blank(2024, formats.SESSION, 1, 0.0).tobytes()
    assert decode(right[:-1], faults) is None
    assert faults.counts["packet of a wrong size"] == 1


def told(race: GameRace, *packets: Any) -> list[Event]:
    """Events of packets that come after the first second of a race."""
    opening = [data for time_s, data in race.packets() if time_s < 1]
    events = events_of((0.0, data) for data in [*opening, *(packet.tobytes() for packet in packets)])
    return events[len(events_of((0.0, data) for data in opening)) :]


def coded(code: bytes, *details: int, frame: int = 100, season: int = 2025) -> Any:
    packet = blank(season, formats.EVENT, frame, 20.0)
    packet["code"] = code
    packet["details"][: len(details)] = details
    return packet


RACE = GameRace(2025, cars=4, laps=4)


def test_events_are_told_once_though_they_come_twice() -> None:
    assert told(RACE, coded(b"DRSE"), coded(b"DRSE"), coded(b"DRSD")) == [OvertakeAid(20.0, True), OvertakeAid(20.0, False)]


def test_penalties_and_those_served() -> None:
    events = told(
        RACE,
        coded(b"PENA", 4, 0, 2, 255, 5),
        coded(b"PENA", 0, 0, 1, 255, 255),
        coded(b"PENA", 5, 0, 1),
        coded(b"DTSV", 1),
        coded(b"SGSV", 99),
    )
    assert [(event.topic, event.car, event.seconds) for event in only(RaceControl, events)] == [
        ("time penalty", 3, 5.0),
        ("drive-through", 2, None),
        ("penalty served", 2, None),
    ]


def test_a_red_flag_lasts_until_the_race_goes_on() -> None:
    green = blank(2025, formats.SESSION, 200, 30.0)
    green["air_c"], green["track_c"] = 25, 35
    later = blank(2025, formats.SESSION, 300, 50.0)
    later["air_c"], later["track_c"] = 25, 35
    events = told(RACE, coded(b"RDFL"), green, coded(b"LGOT", frame=250), later)
    assert events == [StatusChanged(20.0, RED), StatusChanged(50.0, GREEN)]


def test_a_car_may_retire_and_a_flashback_undo_laps() -> None:
    faults = Anomalies()
    packets = [data for _, data in RACE.packets()]
    frames = {time_s: data for time_s, data in RACE.packets() if data[6] == formats.LAP_DATA}

    def at(time_s: float, frame: int) -> bytes:
        packet = np.frombuffer(frames[time_s], packet_type(2025, formats.LAP_DATA))[0].copy()
        packet["header"]["overall_frame"] = frame
        packet["cars"]["result_status"][3] = 7 if frame == 9002 else 2
        return bytes(packet.tobytes())

    events = events_of(((0.0, data) for data in [*packets[:5], at(200.0, 9000), at(60.0, 9001), at(200.0, 9002), at(200.5, 9003)]), faults)
    assert [lap.lap for lap in only(LapCompleted, events) if lap.car == 1] == [2, 2], "lap 1 was never seen to end"
    assert [(event.car, event.out) for event in only(Retired, events)] == [(4, True), (4, False)]


def test_history_tells_laps_that_no_packet_told() -> None:
    gone = [(time_s, data) for time_s, data in RACE.packets() if not (data[6] == formats.LAP_DATA and 80 < time_s < 250)]
    history = blank(2025, formats.HISTORY, 10**6, 260.0)
    history["car"], history["lap_count"] = 0, 3
    history["laps"]["lap_ms"][:3] = [*RACE.lap_ms[0, :2], 50]
    before = [packet for packet in gone if packet[0] < 260]
    events = events_of([*before, (260.0, history.tobytes())])
    found = {lap.lap: lap for lap in only(LapCompleted, events) if lap.car == 1}
    assert found[1] == LapCompleted(260.0, 1, 1, RACE.lap_ms[0, 0] / 1000, at_line=False)
    assert found[2].at_line


def test_cars_without_a_number_of_their_own_go_by_their_slot() -> None:
    session = blank(2024, formats.SESSION, 1, 0.0)
    packet = blank(2024, formats.PARTICIPANTS, 1, 0.0)
    packet["active_cars"] = 5
    for slot, (number, name) in enumerate([(44, b"HAMILTON"), (44, b"Player"), (0, b"Player"), (7, b"\xff\xfe"), (1, b"VERSTAPPEN")]):
        packet["cars"]["race_number"][slot], packet["cars"]["name"][slot] = number, name
    events = events_of([(0.0, session.tobytes()), (0.0, packet.tobytes())])
    assert [(entry.car, entry.driver) for entry in only(Entry, events)] == [(44, "HAM"), (101, "PLA"), (102, "C02"), (7, "C03"), (1, "VER")]


def test_another_session_begins_anew_and_packets_without_one_say_nothing() -> None:
    first = events_of(RACE.packets())
    other = GameRace(2025, cars=4, laps=4)
    packets = [data for _, data in other.packets()]
    renamed = [np.frombuffer(data, packet_type(2025, data[6]))[0].copy() for data in packets]
    for packet in renamed:
        packet["header"]["session_uid"] = 9
    assert len(only(Session, events_of([*RACE.packets(), *((0.0, packet.tobytes()) for packet in renamed)]))) == 2
    assert len(only(Session, first)) == 1
    assert events_of([(0.0, coded(b"DRSE").tobytes()), (0.0, blank(2025, formats.SESSION, 1, float("nan")).tobytes())]) == []


@pytest.mark.parametrize(
    ("season", "number", "kind"),
    [
        (2023, 1, "practice"),
        (2023, 5, "qualifying"),
        (2023, 10, "race"),
        (2023, 12, "race"),
        (2024, 10, "qualifying"),
        (2024, 14, "qualifying"),
        (2026, 15, "race"),
        (2026, 17, "race"),
        (2026, 18, "practice"),
    ],
)
def test_the_kind_of_session(season: int, number: int, kind: str) -> None:
    assert session_kind(season, number) == kind


def test_tracks_are_called_as_races_can_be() -> None:
    assert [track_name(track) for track in (0, 3, 42, 22, -1)] == ["Melbourne", "Bahrain International Circuit", "Madring", "", ""]
