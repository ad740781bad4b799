"""Spoilt lines and packets: a few thousand of those that `benchmarks/feed_fuzz.py` makes a million of."""

import copy
import random

import numpy as np
import pytest
from docs_pages import benchmark
from game_race import GameRace

from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.events import Event
from rsrl.feeds.games import GameFeed, decode, formats
from rsrl.feeds.live_timing import LiveTiming
from rsrl.feeds.live_timing.messages import Message

fuzz = benchmark("feed_fuzz")


def test_spoilt_lines_end_in_no_crash_and_tell_nothing_of_other_cars() -> None:
    lines = fuzz.LineFuzz(seed=1)
    for number in range(4000):
        lines.one(number)
    assert lines.outcomes["refused"] > 500
    assert lines.outcomes["read"] > 500
    assert lines.outcomes["events"] > 300


def test_spoilt_packets_end_in_no_crash_and_no_event_that_cannot_be() -> None:
    packets = fuzz.PacketFuzz(seed=1)
    for number in range(3000):
        packets.one(number)
    assert packets.outcomes["refused"] > 100
    assert packets.outcomes["events"] > 500


def test_the_checks_notice_what_cannot_be(monkeypatch: pytest.MonkeyPatch) -> None:
    class Wrong(LiveTiming):
        def events(self, message: Message) -> list[Event]:
            return [fuzz.Position(1.0, 77, 1)]

    monkeypatch.setattr(fuzz, "LiveTiming", Wrong)
    lines = fuzz.LineFuzz(seed=1)

    def some() -> None:
        for number in range(100):
            lines.one(number)

    with pytest.raises(fuzz.FindingError, match="is not of the cars"):
        some()
    wrong = [fuzz.Position(1.0, 4, 99), fuzz.LapCompleted(float("nan"), 4, 1), fuzz.LapCompleted(1.0, 4, 101), fuzz.StatusChanged(1.0, 9)]
    for event in wrong:
        with pytest.raises(fuzz.FindingError):
            fuzz.check_event(event)


def of_others(events: list[Event], car: int) -> list[Event]:
    """Events of cars without one of them; gaps are left out, since they are between cars."""
    return [event for event in events if getattr(event, "car", car) != car and not isinstance(event, fuzz.Gap)]


def test_a_spoilt_slot_of_a_packet_changes_its_own_car_alone() -> None:
    race = GameRace(2026, cars=20, laps=4)
    faults = Anomalies()
    feed = GameFeed(faults)
    packets = [data for time_s, data in race.packets() if time_s < 100]
    for data in packets[:-3]:
        packet = decode(data, faults)
        assert packet
        feed.events(packet)
    data = next(one for one in packets[-3:] if one[6] == formats.LAP_DATA)
    rng = random.Random(3)
    right = decode(data, faults)
    assert right
    expected = copy.deepcopy(feed).events(right)
    size = np.dtype(formats.packet_type(2026, formats.LAP_DATA)["cars"].base).itemsize  # type: ignore[index]
    for slot in range(20):
        spoilt = bytearray(data)
        for _ in range(5):
            spoilt[29 + slot * size + rng.randrange(size)] = rng.randrange(256)
        packet = decode(bytes(spoilt), faults)
        assert packet
        found = copy.deepcopy(feed).events(packet)
        assert of_others(found, slot + 1) == of_others(expected, slot + 1)
