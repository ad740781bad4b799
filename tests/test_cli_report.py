"""`rsrl report`: the page it writes, its JSON, and what it refuses."""

import json
from pathlib import Path

import pytest
from report_study import evaluation

from rsrl.cli import main

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "evaluation.json").write_text(json.dumps(evaluation()))
    return tmp_path


def test_page_beside_its_files_or_where_asked(capsys: Capture, folder: Path) -> None:
    assert main(["report", str(folder)]) == 0
    assert "Leaderboard: Bahrain 2023" in capsys.readouterr().out
    html = (folder / "report.html").read_text(encoding="utf-8")
    assert html.startswith("<!DOCTYPE html>")
    assert f"rsrl report {folder}" in html, "the command that makes it again"
    assert main(["report", str(folder), "--out", str(folder / "new" / "page.html")]) == 0
    assert (folder / "new" / "page.html").is_file()


def test_json_has_path_and_sections(capsys: Capture, folder: Path) -> None:
    assert main(["report", str(folder), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["path"] == str(folder / "report.html")
    assert result["files"] == ["evaluation.json"]
    assert [section["id"] for section in result["sections"]] == ["leaderboard", "reading", "again"]
    assert result["provenance"]["command"] == f"rsrl report {folder} --json"


def test_nothing_is_overwritten_unless_told(capsys: Capture, folder: Path) -> None:
    (folder / "report.html").write_text("mine")
    assert main(["report", str(folder)]) == 2
    assert "already exists; give another --out, or --force to overwrite it" in capsys.readouterr().err
    assert (folder / "report.html").read_text() == "mine"
    assert main(["report", str(folder), "--force"]) == 0
    assert (folder / "report.html").read_text(encoding="utf-8") != "mine"


def test_what_cannot_be_reported_is_one_line(capsys: Capture, tmp_path: Path) -> None:
    for folder in (tmp_path, tmp_path / "none"):
        assert main(["report", str(folder)]) == 2
        error = capsys.readouterr().err
        assert error.startswith("rsrl: error: ")
        assert error.count("\n") == 1
    assert not (tmp_path / "none").exists()


def test_a_place_that_cannot_be_written(capsys: Capture, folder: Path) -> None:
    assert main(["report", str(folder), "--out", str(folder / "evaluation.json" / "page.html")]) == 2
    assert "cannot be written" in capsys.readouterr().err
    (folder / "pages").mkdir()
    assert main(["report", str(folder), "--out", str(folder / "pages")]) == 2
    assert "cannot be written" in capsys.readouterr().err
