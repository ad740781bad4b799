"""A recording is told by what is in it, whatever it is called."""

from pathlib import Path

import pytest
from game_race import GameRace
from live_timing_lines import INFO, write_archive

from rsrl.errors import RsrlError
from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.events import Event, Session
from rsrl.feeds.games import PacketWriter
from rsrl.feeds.live_timing.messages import own_line
from rsrl.feeds.recordings import recording_events


def first(source: object) -> Event:
    return next(iter(recording_events(str(source), Anomalies())))


def test_live_timing_and_games_are_told_apart(tmp_path: Path) -> None:
    lines = tmp_path / "a.txt"
    lines.write_bytes(own_line("SessionInfo", INFO, "2025-11-09T17:00:00Z"))
    with PacketWriter(tmp_path / "b.txt") as writer:
        for since_s, data in GameRace(2025, cars=2, laps=4).packets():
            writer.write(since_s, data)
            if since_s > 1:
                break
    archive = write_archive(tmp_path / "c", {"SessionInfo": [(0.0, INFO)]})
    assert [first(source).time_s for source in (lines, tmp_path / "b.txt", archive)] == [0, 0, 0]
    names = [event.event for source in (lines, tmp_path / "b.txt", archive) if isinstance(event := first(source), Session)]
    assert names == ["São Paulo Grand Prix", "Bahrain International Circuit", "São Paulo Grand Prix"]


def test_openf1_is_named_by_a_session(monkeypatch: pytest.MonkeyPatch) -> None:
    session = Session(0.0, "race", "Bahrain Grand Prix", 2023)
    monkeypatch.setattr("rsrl.feeds.openf1.openf1_events", lambda key, anomalies: [session] if key == 7953 else [])
    assert first("openf1:7953") == session
    with pytest.raises(RsrlError, match="openf1:monza: is no session of OpenF1; write its key"):
        first("openf1:monza")


def test_what_is_no_recording_is_told_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "laps.csv").write_text("season,round\n" * 3)
    with pytest.raises(RsrlError, match="is no recording of live timing: none of its first 3 lines can be read"):
        first(tmp_path / "laps.csv")
    with pytest.raises(RsrlError, match="cannot be read"):
        first(tmp_path / "absent")
