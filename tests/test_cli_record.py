"""`rsrl record game` and `rsrl record play`: a game's packets to a file and back; `record f1` is tested with its recorder."""

import asyncio
import json
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from game_race import GameRace
from test_feeds_games import check_race, free_port

from rsrl.cli import main
from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.events import Event
from rsrl.feeds.games import PacketWriter, game_events, live_game_events, read_packets

RACE = GameRace(2024, cars=4, laps=4)


OLD = (2022).to_bytes(2, "little") + bytes(1000)


def send(port: int, packets: list[bytes]) -> None:
    """Send packets once somebody listens: until then the system refuses what is sent to a port of this machine."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.connect(("127.0.0.1", port))
        heard = False
        while not heard:
            try:
                sender.send(OLD)
                time.sleep(0.05)
                sender.send(OLD)
                heard = True
            except ConnectionRefusedError:
                time.sleep(0.05)
        for packet in packets:
            sender.send(packet)
            time.sleep(0.0005)


def test_what_a_game_sends_is_recorded(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, port = tmp_path / "race.packets", free_port()
    packets = [data for _, data in RACE.packets()]
    sender = threading.Thread(target=send, args=(port, packets))
    sender.start()
    assert main(["record", "game", str(path), "--port", str(port), "--until-silent", "4", "--json"]) == 0
    sender.join()
    out = capsys.readouterr()
    result = json.loads(out.out)
    assert result["path"] == str(path)
    assert list(result["faults"]) == ["packets of format 2022"]
    assert result["packets"] - result["faults"]["packets of format 2022"] == len(packets)
    assert out.err.count("packets of format 2022: RSRL reads 2023 to 2026") == 1
    check_race(RACE, list(game_events(path)))


def test_a_recording_is_not_overwritten_unasked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "race.packets"
    path.write_bytes(b"old")
    assert main(["record", "game", str(path)]) == 2
    assert "already exists" in capsys.readouterr().err
    assert path.read_bytes() == b"old"


def test_a_port_in_use_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as holder:
        holder.bind(("0.0.0.0", 0))
        port = holder.getsockname()[1]
        assert main(["record", "game", str(tmp_path / "race.packets"), "--port", str(port)]) == 2
    assert re.fullmatch(r"rsrl: error: cannot listen at UDP port \d+: another program listens there; give .*\n", capsys.readouterr().err)


def test_a_recording_is_played_as_the_game_sent_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, port = tmp_path / "race.packets", free_port()
    with PacketWriter(path) as writer:
        for since_s, data in RACE.packets():
            writer.write(since_s, data)
    heard: list[Event] = []

    async def listen() -> None:
        heard.extend([event async for event in live_game_events(port, Anomalies(), patience_s=4.0)])

    listener = threading.Thread(target=asyncio.run, args=(listen(),))
    listener.start()
    send(port, [])
    assert main(["record", "play", str(path), "--port", str(port), "--speed", "200"]) == 0
    listener.join()
    said = capsys.readouterr().out  # a long path is broken at the width of the terminal
    assert "".join(said.split()) == f"{path}:{writer.count}packetssent"
    check_race(RACE, heard)


def test_ctrl_c_is_how_a_recording_ends(tmp_path: Path) -> None:
    path, port = tmp_path / "race.packets", free_port()
    command = [sys.executable, "-m", "rsrl", "record", "game", str(path), "--port", str(port), "--json"]
    recorder = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    send(port, [data for _, data in RACE.packets()][:50])
    time.sleep(0.5)
    recorder.send_signal(signal.SIGINT)
    out, err = recorder.communicate(timeout=60)
    assert recorder.returncode == 0, err
    assert json.loads(out)["packets"] >= 50
    assert len(list(read_packets(path, Anomalies()))) == json.loads(out)["packets"]
