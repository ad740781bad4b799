"""How fast recordings of live timing and packets of the games are read, beside plain readers of the same bytes in the same run.

    python benchmarks/feed_speed.py RECORDING [--archive FOLDER] [--rounds 7]

RECORDING is one that FastF1 made (Python literals), plain or .gz. Its lines are also written as JSON, RSRL's own form. Every round
measures every reader in turn, so that a drift of the machine's speed meets all; CPU time, medians over rounds. Readers:

- `ast.literal_eval` and `json.loads` alone, which merge nothing and tell nothing;
- our lines: the form told, the text parsed, the topic looked up;
- our events: all of it, to canonical events; with --archive also those of a folder of `<Topic>.jsonStream` files, merged by time;
- packets to records, and to events, against `bytes` cut into fields by `struct.unpack_from` for one car's lap data.
"""

import argparse
import ast
import gzip
import json
import statistics
import struct
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.games import GameFeed, decode
from rsrl.feeds.games.formats import LAP_DATA, PARTICIPANTS, SESSION, packet_type
from rsrl.feeds.live_timing import LiveTiming
from rsrl.feeds.live_timing.clock import session_clock
from rsrl.feeds.live_timing.messages import own_line, parse_line

PACKETS = 2000
ONE_CAR = struct.Struct("<IIHBHBHBHBfffBBBBBBBBBBBBBBBHHBfB")  # lap data of 2024 and 2025


def parsed(lines: list[bytes]) -> None:
    for line in lines:
        parse_line(line)


def told(lines: list[bytes]) -> None:
    feed = LiveTiming(Anomalies())
    for message in session_clock((message for line in lines for message in parse_line(line)), Anomalies()):
        feed.events(message)


def archived(lines: list[bytes]) -> None:
    """Lines of an archive, each with its topic and a tabulator before it."""
    feed, faults = LiveTiming(Anomalies()), Anomalies()
    pairs = (line.split(b"\t", 1) for line in lines)
    for message in session_clock((message for topic, line in pairs for message in parse_line(line, topic.decode())), faults):
        feed.events(message)


def archive_lines(folder: Path) -> list[bytes]:
    """The lines of an archive in order of time, with their topics."""
    found = []
    for path in sorted(folder.glob("*.jsonStream*")):
        raw = path.read_bytes()
        lines = (gzip.decompress(raw) if path.suffix == ".gz" else raw).removeprefix(b"\xef\xbb\xbf").splitlines()
        found += [(line[:12], path.name.partition(".")[0].encode() + b"\t" + line) for line in lines]
    return [line for _, line in sorted(found)]


def literals(lines: list[bytes]) -> None:
    for line in lines:
        ast.literal_eval(line.decode())


def loaded(lines: list[bytes]) -> None:
    for line in lines:
        json.loads(line)


def packets() -> list[bytes]:
    """A session, its cars, and lap data in which a lap ends now and then."""
    made = []
    for frame in range(PACKETS):
        packet_id = (SESSION, PARTICIPANTS)[frame] if frame < 2 else LAP_DATA
        kind = packet_type(2025, packet_id)
        assert kind is not None
        packet = np.zeros((), kind)
        packet["header"]["packet_format"], packet["header"]["packet_id"], packet["header"]["session_uid"] = 2025, packet_id, 1
        packet["header"]["overall_frame"], packet["header"]["session_time_s"] = frame, frame / 60
        if packet_id == PARTICIPANTS:
            packet["active_cars"], packet["cars"]["race_number"] = 22, np.arange(22) + 1
        if packet_id == LAP_DATA:
            packet["cars"]["lap"], packet["cars"]["result_status"], packet["cars"]["position"] = 1 + frame // 500, 2, np.arange(22) + 1
        made.append(packet.tobytes())
    return made


def records(datagrams: list[bytes]) -> None:
    for data in datagrams:
        decode(data, Anomalies())


def game_told(datagrams: list[bytes]) -> None:
    faults = Anomalies()
    feed = GameFeed(faults)
    for data in datagrams:
        packet = decode(data, faults)
        if packet:
            feed.events(packet)


def cut(datagrams: list[bytes]) -> None:
    for data in datagrams[2:]:
        for slot in range(22):
            ONE_CAR.unpack_from(data, 29 + slot * ONE_CAR.size)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", type=Path)
    parser.add_argument("--archive", type=Path)
    parser.add_argument("--rounds", type=int, default=7)
    arguments = parser.parse_args()
    raw = arguments.recording.read_bytes()
    as_literals = (gzip.decompress(raw) if arguments.recording.suffix == ".gz" else raw).splitlines()
    as_json = [own_line(*ast.literal_eval(line.decode())).rstrip() for line in as_literals]
    datagrams = packets()
    readers: dict[str, tuple[Callable[[list[bytes]], None], list[bytes], str]] = {
        "ast.literal_eval": (literals, as_literals, ""),
        "our lines, literals": (parsed, as_literals, "ast.literal_eval"),
        "our events, literals": (told, as_literals, "ast.literal_eval"),
        "json.loads": (loaded, as_json, ""),
        "our lines, JSON": (parsed, as_json, "json.loads"),
        "our events, JSON": (told, as_json, "json.loads"),
        "struct.unpack_from": (cut, datagrams, ""),
        "our records": (records, datagrams, "struct.unpack_from"),
        "our events, packets": (game_told, datagrams, "struct.unpack_from"),
    }
    if arguments.archive:
        readers["our events, archive"] = archived, archive_lines(arguments.archive), ""
    times: dict[str, list[float]] = {name: [] for name in readers}
    for _ in range(arguments.rounds):
        for name, (reader, data, _reference) in readers.items():
            begun = time.process_time()
            reader(data)
            times[name].append(len(data) / (time.process_time() - begun))
    for name, (_, data, reference) in readers.items():
        rate = statistics.median(times[name])
        ratios = [ours / other for ours, other in zip(times[name], times[reference], strict=True)] if reference else []
        beside = f"{statistics.median(ratios):6.2f} x {reference}" if ratios else ""
        print(f"{name:22} {rate:10,.0f} a second of {len(data):6,} {beside}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
