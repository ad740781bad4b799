"""The recorder of the live feed, against a server that speaks its protocol."""

import asyncio
import json
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from live_timing_lines import DRIVERS, INFO, only, read, timing
from signalr_server import SignalrServer, Step, feed

from rsrl.cli import main
from rsrl.errors import RsrlError
from rsrl.feeds.events import Entry, LapCompleted, Session, SessionOver
from rsrl.feeds.live_timing.recorder import Recorder

SNAPSHOT = {"SessionInfo": INFO, "DriverList": DRIVERS, "TimingData": timing(c4={"NumberOfLaps": 7, "Position": "1"}), "Heartbeat": {}}
ENDS = [feed("SessionStatus", {"Status": "Finalised"}), feed("SessionStatus", {"Status": "Ends"})]


def run(path: Path, scripts: Sequence[tuple[dict[str, Any], Sequence[Step]]], **options: Any) -> tuple[Recorder, SignalrServer, list[str]]:
    """What was recorded from a server with these scripts, the server and the lines for people."""
    server = SignalrServer(scripts, options.pop("refusals", 0))
    told: list[str] = []

    async def both() -> Recorder:
        async with server.running() as url:
            recorder = Recorder(path, told.append, url, first_wait_s=0.01, **options)
            await recorder.run()
            return recorder

    return asyncio.run(both()), server, told


def laps(path: Path) -> list[tuple[int, bool]]:
    return [(lap.lap, lap.at_line) for lap in only(LapCompleted, read(path))]


def test_a_session_is_recorded_as_it_comes(tmp_path: Path) -> None:
    path = tmp_path / "race.jsonl"
    update = feed("TimingData", timing(c4={"NumberOfLaps": 8}), "2025-11-09T17:01:20.5Z")
    recorded, server, told = run(path, [(SNAPSHOT, [update, {"type": 6}, *ENDS])])
    assert (recorded.lines, recorded.connections, recorded.over) == (4, 1, True)
    assert [method for method, _ in server.negotiated] == ["OPTIONS", "POST"]
    assert server.negotiated[1][1] == "/signalrcore/negotiate?negotiateVersion=1"
    assert server.headers[0]["path"] == "/signalrcore?id=token/1%2B2"
    assert (server.headers[0]["user-agent"], server.headers[0]["cookie"]) == ("BestHTTP", "AWSALBCORS=abc123")
    assert {"TimingData", "TimingAppData", "SessionInfo"} <= set(server.subscribed[0])
    assert not {topic for topic in server.subscribed[0] if topic.endswith(".z")}, "those need a login"
    lines = [json.loads(line) for line in path.read_text("utf-8").splitlines()]
    assert list(lines[0]) == ["snapshot", "utc"]
    assert lines[1] == {"topic": "TimingData", "data": timing(c4={"NumberOfLaps": 8}), "utc": "2025-11-09T17:01:20.5Z"}
    assert laps(path) == [(7, False), (8, True)]
    events = read(path)
    assert only(Session, events)[0].event == "São Paulo Grand Prix"
    assert only(Entry, events)[0].driver == "NOR"
    assert isinstance(events[-1], SessionOver)
    assert len(told) == 1


@pytest.mark.parametrize("end", ["drop", "close", "garbage"])
def test_a_lost_connection_is_made_again(end: str, tmp_path: Path) -> None:
    path = tmp_path / "race.jsonl"
    later = SNAPSHOT | {"TimingData": timing(c4={"NumberOfLaps": 9, "Position": "1"})}
    first = [feed("TimingData", timing(c4={"NumberOfLaps": 8})), end]
    recorded, server, told = run(path, [(SNAPSHOT, first), (later, ENDS)])
    assert recorded.connections == len(server.subscribed) == 2
    assert laps(path) == [(7, False), (8, True), (9, False)]
    assert "connecting again" in told[1]


def test_silence_is_a_lost_connection(tmp_path: Path) -> None:
    recorded, _, told = run(tmp_path / "race.jsonl", [(SNAPSHOT, ["hang"]), (SNAPSHOT, ENDS)], silent_s=0.2)
    assert recorded.connections == 2
    assert told[1].startswith("nothing came for 0 s")


def test_a_server_that_refuses_is_asked_again_ever_less_often(tmp_path: Path) -> None:
    recorded, server, told = run(tmp_path / "race.jsonl", [(SNAPSHOT, ENDS)], refusals=3)
    assert recorded.connections == 1
    assert len(server.negotiated) == 8
    assert sum("503" in line for line in told) == 3


def test_a_new_session_is_subscribed_to_anew(tmp_path: Path) -> None:
    path = tmp_path / "race.jsonl"
    sprint = INFO | {"Key": 2, "Name": "Sprint"}
    other = {"SessionInfo": sprint, "DriverList": DRIVERS, "TimingData": timing(c1={"Position": "1"})}
    again = feed("SessionInfo", INFO | {"SessionStatus": "Finalised"})
    recorded, server, _ = run(path, [(SNAPSHOT, [again, feed("SessionInfo", sprint)]), (other, ENDS)])
    assert recorded.connections == len(server.subscribed) == 2
    assert [session.kind for session in only(Session, read(path))] == ["race", "sprint"]


def test_a_recording_is_continued_and_its_half_written_line_ended(tmp_path: Path) -> None:
    path = tmp_path / "race.jsonl"
    run(path, [(SNAPSHOT, ENDS)])
    path.write_bytes(path.read_bytes()[:-5])
    run(path, [(SNAPSHOT, [feed("TimingData", timing(c4={"NumberOfLaps": 8})), *ENDS])])
    assert laps(path) == [(7, False), (8, True)]


def test_another_file_is_not_written_to(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("shopping\n")
    with pytest.raises(RsrlError, match="is no recording of live timing; name another file"):
        run(path, [(SNAPSHOT, ENDS)])
    assert path.read_text() == "shopping\n"
    with pytest.raises(RsrlError, match="cannot be written"):
        run(tmp_path / "absent" / "race.jsonl", [(SNAPSHOT, ENDS)])


def test_the_command_records_and_says_what(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    server = SignalrServer([(SNAPSHOT, ENDS)])
    address: list[str] = []
    ready, done = threading.Event(), threading.Event()

    async def serve() -> None:
        async with server.running() as url:
            address.append(url)
            ready.set()
            await asyncio.to_thread(done.wait)

    thread = threading.Thread(target=asyncio.run, args=(serve(),))
    thread.start()
    ready.wait()
    path = tmp_path / "race.jsonl"
    assert main(["record", "f1", str(path), "--url", address[0]]) == 0
    done.set()
    thread.join()
    out = capsys.readouterr()
    # a long path is broken at the width of the terminal
    assert "".join(out.out.split()) == f"{path}: 3 messages in 1 connection; the session is over".replace(" ", "")
    assert out.err == f"rsrl: connected to {address[0]}\n"
