"""`rsrl live`: from a file, a file that grows, a pipe and the live feed; its log, its silences, and what it refuses."""

import asyncio
import io
import json
import threading
import time
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from exported_forms import live_timing_lines
from exported_race import export_race
from live_timing_lines import DRIVERS, INFO, timing
from rich.console import Console
from signalr_server import SignalrServer, feed

from rsrl.cli import main
from rsrl.cli.live_view import picture
from rsrl.explanation import load_any_policy
from rsrl.feeds.lap_files import lap_events
from rsrl.live import follow_live
from rsrl.replay import Asked
from rsrl.season import RaceRecord
from rsrl.state import ACTION_NAMES

Capture = pytest.CaptureFixture[str]
Lines = list[tuple[float, bytes]]
STOPS = (12, 30)
RACE_LAPS = 57


@pytest.fixture(scope="module")
def lines(bahrain: RaceRecord) -> Lines:
    """A simulated Bahrain 2023 with a safety car as lines of live timing with their session times; HAM boxes on laps 12 and 30."""
    return list(live_timing_lines(lap_events(export_race(bahrain, bahrain.car_index("HAM"), 5, 10, STOPS).table)))


@pytest.fixture(scope="module")
def recording(lines: Lines, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("live") / "race.jsonl", lines)


def written(path: Path, lines: Lines) -> Path:
    path.write_bytes(b"".join(line for _, line in lines))
    return path


def looks_of(capsys: Capture, *arguments: str) -> list[dict[str, Any]]:
    """The looks that `rsrl live --json` prints."""
    assert main(["live", *arguments, "--json"]) == 0
    return [json.loads(line) for line in capsys.readouterr().out.splitlines()]


def replayed(capsys: Capture, source: Path, *arguments: str) -> dict[str, Any]:
    assert main(["replay", str(source), *arguments, "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def test_a_race_is_called_and_its_log_replayed(recording: Path, tmp_path: Path, capsys: Capture) -> None:
    log = tmp_path / "race.log"
    looks = looks_of(capsys, "--source", str(recording), "--driver", "44", "--log", str(log))
    assert {look["seen"]["lap"] for look in looks} == set(range(1, RACE_LAPS + 1))
    for look in looks:
        seen = look["seen"]
        if "call" not in seen:
            assert seen["reason"] == "in the pit lane"
            continue
        assert seen["call"] in seen["legal"]
        assert set(seen["values"]) == set(ACTION_NAMES)
        assert seen["confidence"] in ("high", "close", "low")
        assert seen["health"]["age_s"] < 8
    assert {"safety car", "lap begins", "pit entry", "new tyres"} <= {look["why"] for look in looks}
    by_log, by_source = replayed(capsys, log), replayed(capsys, recording, "--driver", "HAM")
    assert by_log["laps"] == by_source["laps"], "race, driver and policy are those of the log"
    again = [(one["time_s"], one["why"], one.get("call")) for lap in by_log["laps"] for one in lap["looks"]]
    assert [(look["time_s"], look["why"], look["seen"].get("call")) for look in looks] == again
    assert [lap["lap"] for lap in by_log["laps"] if lap["team"] != "no pit"] == list(STOPS)


def test_a_growing_file_is_followed_and_a_half_written_line_waited_for(lines: Lines, tmp_path: Path, capsys: Capture) -> None:
    path = tmp_path / "race.jsonl"
    whole = b"".join(line for time_s, line in lines if time_s < lines[0][0] + 1200)
    half = len(whole) * 2 // 3 + next(i for i in range(40, 400) if whole[len(whole) * 2 // 3 + i - 1 : len(whole) * 2 // 3 + i] != b"\n")
    path.write_bytes(whole[:half])

    def grow() -> None:
        time.sleep(1.5)
        with path.open("ab") as stream:
            stream.write(whole[half:])

    writer = threading.Thread(target=grow)
    writer.start()
    looks = looks_of(capsys, "--source", str(path), "--driver", "HAM", "--until-silent", "4")
    writer.join()
    path.write_bytes(whole)
    at_once = looks_of(capsys, "--source", str(path), "--driver", "HAM", "--until-silent", "1")
    assert [look["seen"].get("call") for look in looks] == [look["seen"].get("call") for look in at_once]
    assert looks[-1]["seen"]["lap"] >= 11


def test_a_half_written_last_line_of_a_finished_file_is_told(lines: Lines, tmp_path: Path, capsys: Capture) -> None:
    path = written(tmp_path / "race.jsonl", [one for one in lines if one[0] < lines[0][0] + 400])
    path.write_bytes(path.read_bytes()[:-20])
    assert "half-written last line 1" in replayed(capsys, path, "--driver", "HAM")["note"]


def test_a_pipe_is_followed(recording: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    with recording.open("rb") as stream:
        monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=stream))
        looks = looks_of(capsys, "--source", "-", "--driver", "HAM")
    assert {look["seen"]["lap"] for look in looks} == set(range(1, RACE_LAPS + 1))


def test_two_minutes_of_silence(lines: Lines, recording: Path, tmp_path: Path, capsys: Capture) -> None:
    """Stale within ten seconds and not called; one lap after the return what is known is what it is without the silence."""
    begin = lines[0][0] + 60 + 4 * 97
    cut = written(tmp_path / "cut.jsonl", [one for one in lines if not begin < one[0] < begin + 120])
    found, whole = replayed(capsys, cut, "--driver", "HAM"), replayed(capsys, recording, "--driver", "HAM")
    looks = [look for lap in found["laps"] for look in lap["looks"]]
    (silent,) = [look for look in looks if look["why"] == "no data"]
    (again,) = [look for look in looks if look["why"] == "data again"]
    origin = lines[0][0]
    assert "call" not in silent
    assert silent["confidence"] == "none"
    assert "stale" in silent["reason"]
    assert 110 < again["time_s"] - silent["time_s"] < 120
    assert again["time_s"] == pytest.approx(begin + 120 - origin, abs=5)
    back = next(
        lap["lap"]
        for lap in found["laps"]
        if any(look["why"] == "lap begins" and look["time_s"] > again["time_s"] for look in lap["looks"])
    )
    ours = {lap["lap"]: lap for lap in found["laps"]}
    for lap in whole["laps"]:
        if lap["lap"] > back:
            other = ours[lap["lap"]]
            assert (other["position"], other["compound"], other["tyre_age_laps"], other["track_status"]) == (
                lap["position"], lap["compound"], lap["tyre_age_laps"], lap["track_status"],
            )  # fmt: skip
            assert other["gap_to_leader_s"] == pytest.approx(lap["gap_to_leader_s"], abs=0.3)


def test_a_late_join_is_called_from_the_second_lap_on(lines: Lines, tmp_path: Path, capsys: Capture) -> None:
    """Of the first 25 laps only what a snapshot has: session, drivers, distance, and the tyres so far."""
    joined = lines[0][0] + 60 + 25 * 97
    kept = (b'"SessionInfo"', b'"DriverList"', b'"TimingAppData"', b'"SessionStatus"', b"TotalLaps")
    path = written(tmp_path / "late.jsonl", [one for one in lines if one[0] > joined or any(topic in one[1] for topic in kept)])
    laps = replayed(capsys, path, "--driver", "HAM")["laps"]
    assert laps[0]["lap"] in range(25, 29)
    assert all(lap["call"] for lap in laps[1:])
    assert laps[-1]["lap"] == RACE_LAPS
    assert laps[-1]["confidence"] in ("high", "close"), "two cars that were out before are not waited for any more"


def test_the_view_tells_state_call_confidence_and_health(lines: Lines, tmp_path: Path) -> None:
    source = written(tmp_path / "race.jsonl", [one for one in lines if one[0] < lines[0][0] + 500])
    look, shown = None, ""
    for moment in follow_live(str(source), Asked(driver="HAM"), load_any_policy("all"), until_silent_s=9.5):
        look = moment.looks[-1] if moment.looks else look
        if moment.looks or moment.stale:
            console = Console(file=io.StringIO(), width=110)
            console.print(picture(moment, look))
            text = console.file.getvalue()  # type: ignore[attr-defined]
            if moment.stale:
                assert "STALE, no car heard of for" in text
                assert "no call: the data are stale" in text
            shown = text if not moment.stale else shown
    assert moment.stale, "the file does not grow"
    for words in ("Bahrain Grand Prix 2023", "lap 5 of 57", "HAM", "stay out", "confidence", "measured", "VER"):
        assert words in shown


def serve(scripts: Sequence[Any]) -> tuple[str, threading.Event, threading.Thread]:
    server, address, ready, done = SignalrServer(scripts), [""], threading.Event(), threading.Event()

    async def run() -> None:
        async with server.running() as url:
            address[0] = url
            ready.set()
            await asyncio.to_thread(done.wait)

    thread = threading.Thread(target=asyncio.run, args=(run(),))
    thread.start()
    ready.wait()
    return address[0], done, thread


def test_the_live_feed_is_followed_over_a_lost_connection_and_recorded(tmp_path: Path, capsys: Capture) -> None:
    stints = {
        "Lines": {
            "4": {"Stints": {"0": {"Compound": "MEDIUM", "New": "true", "TotalLaps": 7}}},
            "1": {"Stints": {"0": {"Compound": "HARD", "New": "true"}}},
        }
    }
    opening = {"SessionInfo": INFO, "DriverList": DRIVERS, "LapCount": {"TotalLaps": 71}, "TimingAppData": stints}
    first = opening | {"TimingData": timing(c4={"NumberOfLaps": 7, "Position": "1"}, c1={"NumberOfLaps": 7, "Position": "2"})}
    later = opening | {"TimingData": timing(c4={"NumberOfLaps": 8, "Position": "1"}, c1={"NumberOfLaps": 8, "Position": "2"})}

    def at(seconds: float) -> str:
        return (datetime.now(UTC) + timedelta(seconds=seconds)).isoformat()  # the snapshot is stamped with the time at which it comes

    def lap(number: int, at_s: float) -> list[Any]:
        lines = {car: {"NumberOfLaps": number, "LastLapTime": {"Value": "1:14.000"}} for car in ("c4", "c1")}
        return [feed("TimingData", timing(**{car: line}), at(at_s)) for car, line in lines.items()]

    ends = [feed("SessionStatus", {"Status": word}, at(400)) for word in ("Finalised", "Ends")]
    url, done, thread = serve([(first, [*lap(8, 60), "drop"]), (later, [*lap(9, 134), *lap(10, 208), *ends])])
    try:
        raw = tmp_path / "raw.jsonl"
        looks = looks_of(capsys, "--source", "f1", "--url", url, "--driver", "NOR", "--record", str(raw))
    finally:
        done.set()
        thread.join()
    assert [look["seen"]["lap"] for look in looks if look["why"] == "lap begins"] == [8, 9, 10, 11]
    called = [look["seen"] for look in looks if look["seen"].get("call")]
    assert called
    assert called[-1]["compound"] == "M"
    assert raw.read_text("utf-8").count('"snapshot"') == 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--source", "{tmp}/absent.jsonl"], "cannot be read"),
        (["--source", "{tmp}/notes.txt"], "is no recording of live timing"),
        (["--source", "{tmp}/quali.jsonl"], "this is a qualifying session"),
        (["--source", "{tmp}/laps.csv"], "a lap file does not grow; replay it with rsrl replay"),
        (["--source", "{race}", "--driver", "XYZ"], "unknown driver 'XYZ'"),
        (["--source", "{race}", "--race", "atlantis"], "unknown race 'atlantis'"),
        (["--source", "{race}", "--model", "nobody"], "no model 'nobody'"),
        (["--source", "f1", "--url", "http://127.0.0.1:9/signalrcore"], "the live feed cannot be reached"),
    ],
)
def test_unusable_input_is_one_line_and_exit_code_2(
    recording: Path, tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch, arguments: list[str], message: str
) -> None:
    monkeypatch.setattr("rsrl.feeds.live_timing.recorder.FIRST_TRIES", 1)
    (tmp_path / "notes.txt").write_text("shopping\n" * 200)
    (tmp_path / "laps.csv").write_text("season,round\n")
    quali = INFO | {"Type": "Qualifying"}
    (tmp_path / "quali.jsonl").write_text(json.dumps({"topic": "SessionInfo", "data": quali, "utc": "2025-11-08T14:00:00Z"}) + "\n")
    words = [word.format(tmp=tmp_path, race=recording) for word in arguments]
    assert main(["live", *words, "--until-silent", "1"]) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert [message in line for line in said if line.startswith("rsrl: error: ")] == [True]


def test_a_port_in_use_is_one_line_and_exit_code_2(capsys: Capture) -> None:
    import socket

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("0.0.0.0", 0))
        assert main(["live", "--source", "game", "--driver", "HAM", "--port", str(taken.getsockname()[1])]) == 2
    assert "another program listens there" in capsys.readouterr().err
