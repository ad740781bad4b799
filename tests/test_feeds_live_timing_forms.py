"""The recorded forms of live timing: each line tells its own form, and every form gives the same events."""

import gzip
import io
import json
import os
import threading
import time
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from live_timing_lines import DRIVERS, INFO, archived, only, read, timing, write_archive

from rsrl.errors import RsrlError
from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.events import Entry, Event, LapCompleted, Session
from rsrl.feeds.live_timing import STANDARD_INPUT
from rsrl.feeds.live_timing.merge import merge
from rsrl.feeds.live_timing.messages import own_line, parse_line, python_value
from rsrl.feeds.live_timing.values import flag, lap_time_s, parse_gap, whole

UTC = "2025-11-09T17:{:02}:{:06.3f}Z"
RACE: list[tuple[str, Any, float]] = [
    ("SessionInfo", INFO, 0.0),
    ("DriverList", DRIVERS, 0.5),
    ("TimingData", timing(c1={"Position": "1", "InPit": False}, c4={"Position": "2", "InPit": False}), 1.0),
    ("TimingData", timing(c1={"NumberOfLaps": 1}), 90.0),
    ("TimingData", timing(c4={"NumberOfLaps": 1, "GapToLeader": "+1.250"}), 91.25),
    ("RaceControlMessages", {"Messages": {"0": {"Message": 'DRIVERS\' BRIEFING: "NO" SHORT CUTS'}}}, 92.0),
]


def utc(time_s: float) -> str:
    return UTC.format(int(time_s // 60), time_s % 60)


def own_form() -> bytes:
    return b"".join(own_line(topic, payload, utc(time_s)) for topic, payload, time_s in RACE)


def signalr_form() -> bytes:
    return "".join(f"{[topic, payload, utc(time_s)]!r}\n" for topic, payload, time_s in RACE).encode()


def undercut_form() -> bytes:
    return "".join(json.dumps({"Type": topic, "Json": payload, "DateTime": utc(time_s)}) + "\n" for topic, payload, time_s in RACE).encode()


@pytest.fixture
def expected(tmp_path: Path) -> list[Event]:
    """What the archive of the race gives."""
    topics: dict[str, list[tuple[float, Any]]] = {}
    for topic, payload, time_s in RACE:
        topics.setdefault(topic, []).append((time_s, payload))
    events = read(write_archive(tmp_path / "archive", topics))
    assert isinstance(events[0], Session)
    assert events[0].event == "São Paulo Grand Prix"
    assert [(lap.car, lap.lap, lap.time_s) for lap in only(LapCompleted, events)] == [(1, 1, 90.0), (4, 1, 91.25)]
    return events


@pytest.mark.parametrize("form", [own_form, signalr_form, undercut_form])
@pytest.mark.parametrize("packed", [False, True])
def test_every_form_gives_the_same_events(expected: list[Event], form: Any, packed: bool, tmp_path: Path) -> None:
    path = tmp_path / ("race.txt.gz" if packed else "race.txt")
    path.write_bytes(gzip.compress(form()) if packed else form())
    assert read(path) == expected


def test_a_byte_order_mark_blank_lines_and_windows_line_ends_change_nothing(expected: list[Event], tmp_path: Path) -> None:
    path = tmp_path / "race.txt"
    path.write_bytes(b"\xef\xbb\xbf" + own_form().replace(b"\n", b"\r\n\r\n"))
    assert read(path) == expected


def test_standard_input_is_read(expected: list[Event], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(own_form())))
    assert read(STANDARD_INPUT) == expected


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_a_named_pipe_is_read(expected: list[Event], tmp_path: Path) -> None:
    path = tmp_path / "pipe"
    os.mkfifo(path)
    writer = threading.Thread(target=path.write_bytes, args=(own_form(),))
    writer.start()
    assert read(path) == expected
    writer.join()


def test_a_file_that_grows_is_followed_and_a_half_written_line_waited_for(expected: list[Event], tmp_path: Path) -> None:
    path = tmp_path / "race.txt"
    whole_file = own_form()
    path.write_bytes(whole_file[:-40])

    def grow() -> None:
        time.sleep(0.3)
        with path.open("ab") as stream:
            stream.write(whole_file[-40:])

    writer = threading.Thread(target=grow)
    writer.start()
    assert read(path, follow=True, patience_s=1.0) == expected
    writer.join()


def test_the_last_line_of_a_file_may_be_half_written_or_lack_its_end(expected: list[Event], tmp_path: Path) -> None:
    path = tmp_path / "race.txt"
    path.write_bytes(own_form()[:-1])
    assert read(path) == expected
    path.write_bytes(own_form()[:-9])
    faults = Anomalies()
    assert read(path, faults) == expected[:-1]
    assert faults.counts == {"half-written last line": 1}


def test_a_compressed_file_that_is_cut_short_is_read_up_to_there(tmp_path: Path) -> None:
    path = tmp_path / "race.txt.gz"
    lines = b"".join(own_line("TimingData", timing(c1={"NumberOfLaps": lap}), utc(lap)) for lap in range(1, 60)) * 50
    path.write_bytes(gzip.compress(lines)[:-300])
    faults = Anomalies()
    assert only(LapCompleted, read(path, faults))
    assert faults.counts["compressed file cut short"] == 1


def test_undercut_f1_keeps_its_snapshot_beside_its_lines(tmp_path: Path) -> None:
    snapshot = {"SessionInfo": INFO, "DriverList": DRIVERS, "TimingData": timing(c4={"NumberOfLaps": 7, "Position": "1"})}
    (tmp_path / "subscribe.json").write_text(json.dumps(snapshot, indent=2), encoding="utf-8")
    line = {"Type": "TimingData", "Json": timing(c4={"NumberOfLaps": 8}), "DateTime": utc(5.0)}
    (tmp_path / "live.jsonl").write_text(json.dumps(line) + "\n", encoding="utf-8")
    for path in (tmp_path, tmp_path / "live.jsonl"):
        events = read(path)
        assert only(Entry, events)[0].driver == "NOR"
        assert [(lap.lap, lap.at_line) for lap in only(LapCompleted, events)] == [(7, False), (8, True)]


def test_snapshots_within_lines_are_taken_as_such() -> None:
    fastf1 = f"['TimingData', {json.dumps(timing(c4={'NumberOfLaps': 7}))!r}, '']".encode()
    own = json.dumps({"snapshot": {"TimingData": timing(c4={"NumberOfLaps": 7})}, "utc": utc(3.0)}).encode()
    for line in (fastf1, own):
        (message,) = parse_line(line)
        assert message.snapshot
        assert message.payload == timing(c4={"NumberOfLaps": 7})


def test_topics_that_are_not_read_are_no_faults() -> None:
    assert parse_line(b"['CarData.z', 'lZ...', '2025-11-09T17:00:00Z']") == []
    assert parse_line(own_line("Position.z", "lZ", utc(1.0))) == []


@pytest.mark.parametrize(
    "line",
    [
        b"[", b"['", b"['TimingData'", b"['TimingData', {'Lines': {}}", b"['TimingData', 5, '']", b"{", b"{}", b'{"topic": 5}',
        b"nonsense", b"00:00:00.000{}", b"['TimingData', __import__('os').getcwd(), '']", b"['TimingData', {}, '2025-99-99T00:00:00Z']",
        b"['TimingData', " + b"[" * 100_000, b'{"topic": ' + b"[" * 100_000, b"\xff\xfe",
        b"['TimingData', {'Lines': {}}, '2023-10-07T17:34:36.07Z'.02]", b"['TimingData', {4: {}}, '']",
        b"['TimingData', {'4': {1, 2}}, '']", b"['TimingData', {'4': '\\ud800'}, '']",
        b'{"topic":"TimingData","data":{"4":"\\ud800"}}',
    ],
)  # fmt: skip
def test_lines_without_a_form_are_refused(line: bytes) -> None:
    with pytest.raises(ValueError, match=r"."):
        parse_line(line)


@pytest.mark.parametrize(
    "line", [b"10:60:00.000{}", b"10:00:60.000{}", b"1:00:00.000{}", b"00:00:00.000{", b"00:00:00.000[]", b"00:00:00,000{}"]
)
def test_lines_of_an_archive_without_a_time_or_a_payload_are_refused(line: bytes) -> None:
    with pytest.raises(ValueError, match=r"."):
        parse_line(line, "TimingData")


values = st.recursive(
    st.none() | st.booleans() | st.integers(-(10**9), 10**9) | st.text("aT'\"\\: ,{}[]nrueFls", max_size=8),
    lambda children: st.lists(children, max_size=3) | st.dictionaries(st.text("ab'\": ", max_size=3), children, max_size=3),
    max_leaves=8,
)


@given(st.dictionaries(st.text("ab: ", max_size=3), values, max_size=4))
def test_a_python_literal_is_read_as_python_reads_it(payload: dict[str, Any]) -> None:
    line = repr(["TimingData", payload, "2025-11-09T17:00:00Z"])
    assert python_value(line.encode()) == ["TimingData", payload, "2025-11-09T17:00:00Z"]


def test_deltas_are_merged_recursively_and_lists_are_mappings_by_index() -> None:
    state: dict[str, Any] = {}
    merge(state, {"4": {"Stints": [{"Compound": "SOFT"}], "Line": 1}})
    merge(state, {"4": {"Stints": {"0": {"TotalLaps": 5}, "1": {"Compound": "HARD"}}}, "_kf": True})
    merge(state, {"4": {"Line": 2, "Stints": []}})
    assert state == {"4": {"Stints": {"0": {"Compound": "SOFT", "TotalLaps": 5}, "1": {"Compound": "HARD"}}, "Line": 2}}
    merge(state, {"4": {"Stints": {"_deleted": ["0"]}}})
    assert list(state["4"]["Stints"]) == ["1"]


@pytest.mark.parametrize(
    ("text", "gap"),
    [
        ("+1.685", (1.685, 0)), ("1.685", (1.685, 0)), ("+1:05.2", (65.2, 0)), ("LAP 23", (0.0, 0)), ("1L", (None, 1)), ("2 L", (None, 2)),
        ("+1 LAP", (None, 1)), ("+2 LAPS", (None, 2)), ("", (None, None)), (None, (None, None)), ("INTERVAL", (None, None)),
        (1.5, (None, None)), ("+٣", (None, None)),
    ],
)  # fmt: skip
def test_gaps_are_seconds_or_laps_or_unknown(text: Any, gap: tuple[float | None, int | None]) -> None:
    assert parse_gap(text) == gap


def test_lap_times_flags_and_numbers() -> None:
    assert (lap_time_s("1:47.017"), lap_time_s("59.9"), lap_time_s("1:02:03.5"), lap_time_s(""), lap_time_s(None)) == (
        107.017,
        59.9,
        3723.5,
        None,
        None,
    )
    assert (flag("true"), flag("0"), flag(True), flag("maybe"), flag(None)) == (True, False, True, None, None)
    assert (whole("12", 20), whole(12, 20), whole("21", 20), whole(True, 20), whole("1.5", 20), whole(-1, 20)) == (
        12,
        12,
        None,
        None,
        None,
        None,
    )


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("race.txt", b"", "it is empty"),
        ("race.txt", b"season,round\n2023,1\n" * 80, "none of its first 100 lines can be read"),
        ("race.txt", b"hello\n", "none of its first 1 lines can be read"),
        ("subscribe.json", b"[]", "no recording"),
    ],
)
def test_what_is_no_recording_is_told_in_one_line(name: str, content: bytes, message: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(RsrlError, match=message):
        read(tmp_path / name)


def test_missing_files_and_folders_without_a_recording_are_told_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(RsrlError, match=r"absent\.txt: cannot be read"):
        read(tmp_path / "absent.txt")
    with pytest.raises(RsrlError, match="holds no recording of live timing"):
        read(tmp_path)
    write_archive(tmp_path, {"Heartbeat": [(0.0, {})]})
    with pytest.raises(RsrlError, match="name the file that grows"):
        read(tmp_path, follow=True)
    (tmp_path / "live.jsonl").write_text("{}\n")
    (tmp_path / "subscribe.json").write_text("[1]")
    with pytest.raises(RsrlError, match="no opening snapshot"):
        read(tmp_path)


def test_a_line_without_end_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rsrl.feeds.live_timing.sources.LONGEST_LINE", 1 << 16)
    path = tmp_path / "race.txt"
    path.write_bytes(own_form() + b"{" * (1 << 19) + b"\n" + own_line("TimingData", timing(c1={"NumberOfLaps": 2}), utc(180.0)))
    faults = Anomalies()
    assert [lap.lap for lap in only(LapCompleted, read(path, faults))] == [1, 1, 2]
    assert faults.counts == {"line too long": 1}


def test_archives_are_merged_by_time(tmp_path: Path) -> None:
    assert archived(3723.5, {}) == "01:02:03.500{}"
    laps = {"TimingData": [(10.0, timing(c4={"NumberOfLaps": 1})), (20.0, timing(c4={"NumberOfLaps": 2}))]}
    drivers = {"DriverList": [(5.0, DRIVERS), (15.0, {"4": {"TeamName": "McLaren F1 Team"}})]}
    events = read(write_archive(tmp_path, laps | drivers))
    assert [event.time_s for event in events] == sorted(event.time_s for event in events)
    assert [entry.team for entry in only(Entry, events)] == ["McLaren", "McLaren F1 Team"]
