"""Spoilt lines of live timing and spoilt packets of the games: no crash, no event that cannot be, none of a car the line does not name.

    python benchmarks/feed_fuzz.py [--count 1000000] [--seed 1] [--recording FILE]

Every input is a function of the seed and its number, so that a finding can be made again: `--only NUMBER` runs one. The seed lines are
made by hand (feed_seeds.txt); --recording adds the lines of a recording. The feed that reads them starts anew every few hundred inputs.
"""

import argparse
import gzip
import math
import random
import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.events import (
    Entry,
    Event,
    Gap,
    LapCompleted,
    LapCount,
    Position,
    RaceControl,
    Session,
    StatusChanged,
    TyreFitted,
)
from rsrl.feeds.games import GameFeed, decode
from rsrl.feeds.games.formats import FORMATS, SIZES, packet_type
from rsrl.feeds.live_timing import LiveTiming
from rsrl.feeds.live_timing.messages import Message, own_line, parse_line

RENEW_EVERY = 300
TOKENS = (
    b"null", b"-1", b"1e999", b'""', b"{}", b"[]", b"[[[[", b"99999999999999999999", b"true", b"NaN", b'"\\ud800"', b"'", b'"', b"\x00",
    b"\xff", b"None", b"4", b"44",
)  # fmt: skip
VALUES: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 7, 99, 1e300, 10**20, "", "4", "-3", "1L", "+1.5", "1:30.5", "true", "1" * 300, [], {}, [[]],
    {"4": 1}, [1, 2],
)  # fmt: skip
LINES = tuple((Path(__file__).parent / "feed_seeds.txt").read_bytes().splitlines())
"""Lines made by hand, a feed of each form and topic; read in order they are the beginning of a session."""


class FindingError(AssertionError):
    """An input that shows a fault."""


def spoilt(data: bytes, others: tuple[bytes, ...], rng: random.Random) -> bytes:
    """The bytes after one to four random changes."""
    changed = bytearray(data)
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(changed) + 1)
        span = rng.randint(1, 8)
        match rng.randrange(7):
            case 0 if at < len(changed):
                changed[at] ^= 1 << rng.randrange(8)
            case 1:
                del changed[at : at + span]
            case 2:
                changed[at:at] = changed[at : at + span]
            case 3:
                changed[at : at + rng.randint(0, 3)] = rng.choice(TOKENS)
            case 4:
                changed[at:] = b""
            case 5:
                other = rng.choice(others)
                changed[at:] = other[rng.randrange(len(other)) :]
            case _ if at < len(changed) and 48 <= changed[at] <= 57:
                changed[at] = rng.randrange(48, 58)
    return bytes(changed)


def twisted(value: Any, rng: random.Random) -> Any:
    """A parsed payload with one of its values, or keys, replaced by another one."""
    if isinstance(value, dict) and value and rng.random() < 0.9:
        key = rng.choice(list(value))
        if rng.random() < 0.1:
            return {str(rng.choice(VALUES)) if one == key else one: inner for one, inner in value.items()}
        return value | {key: twisted(value[key], rng)}
    if isinstance(value, list) and value and rng.random() < 0.9:
        at = rng.randrange(len(value))
        return [*value[:at], twisted(value[at], rng), *value[at + 1 :]]
    return rng.choice(VALUES)


def check_event(event: Event) -> None:
    """Raise FindingError for an event that cannot be."""
    for value in msgspec.structs.asdict(event).values():
        if isinstance(value, float) and not math.isfinite(value):
            raise FindingError(f"not a number: {event}")
    match event:
        case LapCompleted(lap=lap) if not 1 <= lap <= 100:
            raise FindingError(f"no lap: {event}")
        case LapCount(lap=lap) if not 1 <= lap <= 100:
            raise FindingError(f"no lap: {event}")
        case Position(position=position) if not 1 <= position <= 24:
            raise FindingError(f"no place: {event}")
        case StatusChanged(status=status) if status not in range(4):
            raise FindingError(f"no status: {event}")
        case TyreFitted(compound=compound, stint=stint) if compound not in (None, *"SMHIW") or stint < 1:
            raise FindingError(f"no tyres: {event}")
    if msgspec.json.decode(msgspec.json.encode(event), type=type(event)) != event:
        raise FindingError(f"does not survive JSON: {event}")


def cars_named(message: Message) -> set[int]:
    """Cars that a message speaks of."""
    lines = message.payload.get("Lines")
    keys = lines if isinstance(lines, dict) else range(len(lines)) if isinstance(lines, list) else ()
    return {int(key) for key in keys if str(key).isascii() and str(key).isdecimal()}


class LineFuzz:
    """Spoilt lines through one feed after another."""

    def __init__(self, seed: int, lines: tuple[bytes, ...] = LINES) -> None:
        self.seed, self.lines = seed, lines
        self.outcomes: Counter[str] = Counter()
        self.renew()

    def renew(self) -> None:
        self.feed = LiveTiming(Anomalies())
        for line in LINES:
            for message in parse_line(line):
                self.feed.events(message)

    def one(self, number: int) -> None:
        """Read input `number`. Raises FindingError, or whatever the reader should not have raised."""
        rng = random.Random(f"{self.seed} line {number}")
        line = rng.choice(self.lines)
        if rng.random() < 0.5:
            line = spoilt(line, self.lines, rng)
        elif messages := parse_line(line):
            message = rng.choice(messages)
            line = own_line(message.topic, twisted(message.payload, rng), "2025-11-09T17:00:00Z")
        if number % RENEW_EVERY == 0:
            self.renew()
        try:
            messages = parse_line(line, "TimingData")
        except ValueError:
            self.outcomes["refused"] += 1
            return
        self.outcomes["read" if messages else "not needed"] += 1
        for message in messages:
            named = cars_named(message)
            for event in self.feed.events(message):
                check_event(event)
                car = getattr(event, "car", None)
                if car is not None and car not in named and not isinstance(event, RaceControl | Entry):
                    raise FindingError(f"{event} is not of the cars {sorted(named)} of {line!r}")
                self.outcomes["events"] += not isinstance(event, Session)


def seed_packets() -> tuple[bytes, ...]:
    """A packet of each kind and season with small numbers in it, those first that begin a session."""
    rng = np.random.default_rng(5)
    packets = []
    for season in FORMATS:
        for packet_id in sorted(SIZES, key=lambda one: (one not in (1, 4), one)):
            kind = packet_type(season, packet_id)
            if kind is not None:
                packet = np.frombuffer(rng.integers(0, 4, kind.itemsize, dtype=np.uint8).tobytes(), kind)[0].copy()
                header = packet["header"]
                header["packet_format"], header["packet_id"], header["session_uid"], header["session_time_s"] = (
                    season,
                    packet_id,
                    season,
                    50,
                )
                if packet_id == 4:
                    packet["active_cars"], packet["cars"]["race_number"] = 20, np.arange(len(packet["cars"])) + 1
                if packet_id == 3:
                    packet["code"] = b"PENA"
                packets.append(packet.tobytes())
    return tuple(packets)


class PacketFuzz:
    """Spoilt packets through one feed after another."""

    def __init__(self, seed: int) -> None:
        self.seed, self.packets = seed, seed_packets()
        self.outcomes: Counter[str] = Counter()
        self.renew()

    def renew(self) -> None:
        self.feed, self.faults = GameFeed(Anomalies()), Anomalies()

    def one(self, number: int) -> None:
        """Read input `number`, most with the size that it should have and newer than those before it. Raises as `LineFuzz.one`."""
        rng = random.Random(f"{self.seed} packet {number}")
        if number % RENEW_EVERY == 0:
            self.renew()
        index = number % len(self.packets) if number % RENEW_EVERY < len(self.packets) else rng.randrange(len(self.packets))
        data = bytearray(self.packets[index])
        data[19:27] = (number % RENEW_EVERY + 1).to_bytes(4, "little") * 2
        if rng.random() < 0.1:
            data = bytearray(spoilt(bytes(data), self.packets, rng))
        else:
            for _ in range(rng.randint(0, 6)):
                data[rng.randrange(29 if rng.random() < 0.9 else 0, len(data))] = rng.randrange(256)
        packet = decode(bytes(data), self.faults)
        self.outcomes["read" if packet else "refused"] += 1
        if packet:
            for event in self.feed.events(packet):
                check_event(event)
                self.outcomes["events"] += not isinstance(event, Gap)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--recording", type=Path)
    parser.add_argument("--only", type=int)
    arguments = parser.parse_args()
    lines = LINES
    if arguments.recording:
        raw = arguments.recording.read_bytes()
        recorded = (gzip.decompress(raw) if arguments.recording.suffix == ".gz" else raw).splitlines()
        lines = (*LINES * 20, *(line for line in recorded if len(line) < 2000))
    numbers = [arguments.only] if arguments.only is not None else range(arguments.count)
    fuzzes: tuple[Any, ...] = (LineFuzz(arguments.seed, lines), PacketFuzz(arguments.seed))
    begun_s = time.perf_counter()
    for number in numbers:
        for fuzz in fuzzes if arguments.only is not None else (fuzzes[number % 2],):
            try:
                fuzz.one(number)
            except Exception as error:
                print(f"input {number} of {type(fuzz).__name__}: {type(error).__name__}: {error}")
                raise
    print(f"{len(numbers)} inputs in {time.perf_counter() - begun_s:.0f} s")
    for fuzz in fuzzes:
        print(f"{type(fuzz).__name__}: {dict(fuzz.outcomes)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
