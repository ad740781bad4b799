"""`rsrl wall`: what it refuses, in one line, and that it serves; the clock and the log of views."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import httpx
import pytest

from rsrl.cli import main
from rsrl.errors import RsrlError
from rsrl.wall import View
from rsrl.wall.clock import ViewerClock
from rsrl.wall.server import bind
from rsrl.wall.session_log import MOST_BYTES, SessionLog, last_view

Capture = pytest.CaptureFixture[str]


def complaint(capsys: Capture, *arguments: str) -> str:
    assert main(["wall", "--no-browser", *arguments]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    said = [line for line in captured.err.splitlines() if not line.endswith(" ...")]
    assert len(said) == 1
    return said[0]


@pytest.mark.parametrize(
    ("arguments", "what"),
    [
        (["--race", "atlantis-2023"], "unknown race"),
        (["--driver", "NOBODY"], "unknown driver"),
        (["--host", "0.0.0.0"], "--token"),
        (["--token", "short"], "--token"),
        (["--laps", "nowhere"], "no such folder"),
        (["--port", "70000"], "--port"),
        (["--seed", "-1"], "--seed"),
        (["--follow"], "--follow goes with --source"),
        (["--season-from", "bahrain-2023"], "--season-from goes with --source"),
        (["--source", "f1", "--resume"], "--resume"),
        (["--source", "nowhere.jsonl", "--port", "0"], "cannot be read"),
        (["--source", "nowhere.csv", "--follow", "--port", "0"], "does not grow"),
        (["--host", "not an address", "--token", "0123456789abcdef"], "cannot listen"),
    ],
)
def test_misuse_is_one_line(capsys: Capture, arguments: list[str], what: str) -> None:
    assert what in complaint(capsys, *arguments)


def test_a_port_in_use_is_one_line(capsys: Capture) -> None:
    taken = bind("127.0.0.1", 0)
    try:
        assert "choose another --port" in complaint(capsys, "--port", str(taken.getsockname()[1]))
    finally:
        taken.close()


def test_nothing_to_resume_is_one_line(capsys: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert "--resume" in complaint(capsys, "--resume", "--port", "0")


def test_the_command_serves_until_it_is_told_to_end() -> None:
    command = [sys.executable, "-m", "rsrl", "wall", "--no-browser", "--port", "0", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            line = ""
            while not line.rstrip().endswith("}"):
                line += process.stdout.readline()
            told = json.loads(line)
            assert told["address"] == f"http://localhost:{told['port']}/"
            assert httpx.get(told["address"], trust_env=False).status_code == 200
            process.send_signal(signal.SIGTERM)
            process.wait(30)
        finally:
            process.kill()


class Wall:
    """A wall clock that is set by hand."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def test_a_clock_runs_at_its_speed_and_stands_still() -> None:
    wall = Wall()
    clock = ViewerClock(wall)
    assert clock.time_s(1000.0) == 0.0
    clock.play(1000.0)
    clock.set_speed(10.0, 1000.0)
    wall.now_s += 2.0
    assert clock.time_s(1000.0) == 20.0
    clock.pause(1000.0)
    wall.now_s += 5.0
    assert clock.time_s(1000.0) == 20.0
    clock.seek(500.0)
    clock.play(1000.0)
    wall.now_s += 1.0
    assert clock.time_s(1000.0) == 510.0


def test_a_clock_waits_for_the_race_to_be_known() -> None:
    wall = Wall()
    clock = ViewerClock(wall)
    clock.play(30.0)
    clock.set_speed(100.0, 30.0)
    wall.now_s += 10.0
    assert clock.time_s(30.0) == 30.0
    assert clock.time_s(60.0) == 30.0, "it has waited, not run ahead"
    clock.seek(500.0)
    assert clock.time_s(60.0) == 60.0
    assert clock.time_s(600.0) == 500.0, "what was asked for is reached when it is known"


VIEW = View("simulated", "bahrain-2023", "HAM", 3, 1234.5, 20.0, True, 12.0)


def test_the_last_view_is_read_back(tmp_path: Path) -> None:
    log = SessionLog(tmp_path / "wall" / "log.jsonl")
    log.note(VIEW._replace(time_s=1.0))
    log.note(VIEW)
    assert last_view(tmp_path / "wall" / "log.jsonl") == VIEW


@pytest.mark.parametrize("tail", ["", "{", "[]", "null", '{"format": 2}', '{"format": 1, "nothing": 1}', '"text"', "\x00"])
def test_a_damaged_end_is_passed_over(tmp_path: Path, tail: str) -> None:
    path = tmp_path / "log.jsonl"
    path.write_text(json.dumps({"format": 1, **VIEW._asdict()}) + "\n" + tail, encoding="utf-8")
    assert last_view(path) == VIEW


@pytest.mark.parametrize("content", [None, "", "{", "\n\n"])
def test_an_empty_log_is_told(tmp_path: Path, content: str | None) -> None:
    path = tmp_path / "log.jsonl"
    if content is not None:
        path.write_text(content, encoding="utf-8")
    with pytest.raises(RsrlError, match="--resume"):
        last_view(path)


def test_a_long_log_begins_anew(tmp_path: Path) -> None:
    path = tmp_path / "log.jsonl"
    path.write_text("x" * (MOST_BYTES + 1), encoding="utf-8")
    SessionLog(path).note(VIEW)
    assert path.stat().st_size < 1000
    assert last_view(path) == VIEW
