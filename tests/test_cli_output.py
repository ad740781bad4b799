"""What commands share: JSON that is JSON, files that are not overwritten, provenance that names no one's machine."""

import json
import platform
import sys
import time
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

from rsrl import __version__
from rsrl.cli import main
from rsrl.cli import progress as progress_module
from rsrl.cli.files import make_folder, refuse_overwrite, write_json
from rsrl.cli.output import Output, table
from rsrl.cli.progress import progress
from rsrl.cli.provenance import command_line, provenance
from rsrl.errors import RsrlError
from rsrl.results import plain


def test_races_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["races", "--json"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    rows = json.loads(out)["races"]
    bahrain = next(row for row in rows if row["race"] == "bahrain-2023")
    assert bahrain == {
        "race": "bahrain-2023",
        "season": 2023,
        "round": 1,
        "event": "Bahrain Grand Prix",
        "laps": 57,
        "wet": False,
        "default_driver": "HAM",
    }
    assert rows == sorted(rows, key=lambda row: (row["season"], row["round"]))


def test_races_as_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["races"]) == 0
    out = capsys.readouterr().out
    assert "bahrain-2023" in out
    assert "Bahrain Grand Prix" in out


def test_races_of_one_season(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["races", "2023", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["races"]
    assert len(rows) > 15
    assert {row["season"] for row in rows} == {2023}
    assert main(["races", "1950"]) == 2
    assert capsys.readouterr().err.startswith("rsrl: error: no races of 1950; there are seasons 2022, 2023, 2024")


def test_plain_gives_types_json_has() -> None:
    value = {"a": np.float32(0.5), 2: np.array([1, 2], np.int8), "p": Path("x/y"), "n": (float("nan"), np.inf, True, None)}
    assert plain(value) == {"a": 0.5, "2": [1, 2], "p": "x/y", "n": [None, None, True, None]}


def test_result_is_a_table_or_json_alone(capsys: pytest.CaptureFixture[str]) -> None:
    built = table("Title", ("name", "count"), [("a", 1)])
    for as_json in (True, False):
        output = Output(as_json)
        output.note("by the way")
        output.result({"x": np.nan}, built)
        out, err = capsys.readouterr()
        assert err == "by the way\n"
        assert (out == '{\n  "x": null\n}\n') if as_json else ("Title" in out and "count" in out and "{" not in out)


@pytest.mark.parametrize("as_json", [True, False])
def test_progress_is_one_line_where_nobody_watches(capsys: pytest.CaptureFixture[str], as_json: bool) -> None:
    with progress(Output(as_json), "Counting") as report:
        report(1, 2)
    assert capsys.readouterr() == ("", "Counting ...\n")


def test_a_long_task_is_told_of_again_where_nobody_watches(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress_module, "REMIND_S", 0.2)
    with progress(Output(True), "Counting") as report:
        report(1, 3)
        time.sleep(0.3)
    assert capsys.readouterr().err == "Counting ...\nCounting ... 33 %\n"
    time.sleep(0.3)
    assert capsys.readouterr().err == ""


def test_progress_is_a_bar_at_a_terminal_and_goes_away(monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal(StringIO):
        def isatty(self) -> bool:
            return True

    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    with progress(Output(as_json=False), "Counting") as report:
        report(2, 4)
    assert "Counting" in terminal.getvalue()
    assert "50%" in terminal.getvalue()
    assert terminal.getvalue().endswith("\x1b[1A\x1b[2K"), "the bar's line is wiped"


def test_nothing_is_overwritten_unasked(tmp_path: Path) -> None:
    refuse_overwrite(tmp_path / "new", force=False)
    refuse_overwrite(tmp_path, force=False)
    (tmp_path / "old").write_text("kept", encoding="utf-8")
    for taken in (tmp_path / "old", tmp_path):
        with pytest.raises(RsrlError, match=r"already exists; give another --out, or --force"):
            refuse_overwrite(taken, force=False)
        refuse_overwrite(taken, force=True)
    assert (tmp_path / "old").read_text(encoding="utf-8") == "kept"


def test_folder_is_made_and_left_clean(tmp_path: Path) -> None:
    assert list(make_folder(tmp_path / "a" / "b").iterdir()) == []


def test_unwritable_places_are_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(RsrlError, match=r"file: cannot be written to \(.+\); choose another folder"):
        make_folder(tmp_path / "file")
    with pytest.raises(RsrlError, match=r"cannot be written \(.+\); choose another folder"):
        write_json(tmp_path / "file" / "x.json", {})


def test_written_json_reads_back(tmp_path: Path) -> None:
    write_json(tmp_path / "x.json", {"values": np.array([0.5, np.nan])})
    assert json.loads((tmp_path / "x.json").read_text(encoding="utf-8")) == {"values": [0.5, None]}


def test_provenance_tells_command_seed_version_and_machine_but_not_whose() -> None:
    assert main(["races", "--json"]) == 0
    block = plain(provenance(7))
    assert set(block) == {"command", "seed", "version", "machine", "date"}
    assert (block["command"], block["seed"], block["version"]) == ("rsrl races --json", 7, __version__)
    assert command_line() == "rsrl races --json"
    assert set(block["machine"]) == {"cpu", "cores", "python", "platform"}
    assert block["machine"]["cores"] >= 1
    assert block["date"].endswith("+00:00")
    assert platform.node() not in json.dumps(block) or not platform.node()
