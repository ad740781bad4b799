"""`rsrl calibrate`: what it hands to the fit, what it writes, and each input it refuses."""

import json
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from rsrl import calibration
from rsrl.calibration import CalibrationResult, figure_table
from rsrl.cli import main
from rsrl.season import RaceRecord, load_race, race_hash

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch, bahrain: RaceRecord) -> list[tuple[Any, ...]]:
    """Puts the shipped record in the place of a fit; holds the arguments of each call."""
    calls: list[tuple[Any, ...]] = []

    def fit(*arguments: Any) -> CalibrationResult:
        *given, progress = arguments
        calls.append(tuple(given))
        progress("reading laps")
        attrition = pl.DataFrame({"filter": ["read"], "removed": [0], "left": [5]})
        return CalibrationResult(bahrain, attrition, 0.25, figure_table(bahrain), pl.DataFrame())

    monkeypatch.setattr(calibration, "calibrate_race", fit)
    return calls


def test_writes_the_season_file_and_tells_the_figures(capsys: Capture, tmp_path: Path, asked: list[Any], bahrain: RaceRecord) -> None:
    assert main(["calibrate", "bahrain-2023", "--laps", "some laps", "--facts", "facts", "--out", str(tmp_path / "new"), "--json"]) == 0
    path = tmp_path / "new" / "bahrain-2023.toml"
    out, err = capsys.readouterr()
    result = json.loads(out)
    assert err.splitlines() == [
        "Calibrating bahrain-2023: reading laps ...",
        "Calibrating bahrain-2023: working ranges of the features, from simulated races ...",
    ]
    assert (result["race"], result["file"], result["seasons"]) == ("bahrain-2023", str(path), [2022, 2023])
    assert result["season_hash"] == race_hash(bahrain)
    assert {"name", "value", "se", "n", "note"} == set(result["figures"][0])
    assert result["attrition"] == [{"filter": "read", "removed": 0, "left": 5}]
    assert load_race(str(path)) == bahrain
    remake = "rsrl calibrate bahrain-2023 --seasons 2022,2023 --laps 'some laps' --facts facts"
    assert asked == [("bahrain-2023", Path("some laps"), Path("facts"), (2022, 2023), remake)]


def test_table_and_file_of_a_name_of_its_own(capsys: Capture, tmp_path: Path, asked: list[Any], bahrain: RaceRecord) -> None:
    path = tmp_path / "mine.toml"
    assert main(["calibrate", "bahrain-2023", "--laps", "l", "--seasons", "2023, 2021", "--out", str(path)]) == 0
    out, err = capsys.readouterr()
    assert asked[0][2:4] == (None, (2021, 2023))
    assert "track.base_lap_s" in out
    assert all(car.driver in out for car in bahrain.cars)
    assert err.endswith(f"Written to {path}\n")
    assert path.is_file()


def test_nothing_is_overwritten_unasked(capsys: Capture, tmp_path: Path, asked: list[Any]) -> None:
    path = tmp_path / "bahrain-2023.toml"
    path.write_text("kept", encoding="utf-8")
    arguments = ["calibrate", "bahrain-2023", "--laps", "l", "--out", str(tmp_path)]
    assert main(arguments) == 2
    assert capsys.readouterr().err == f"rsrl: error: {path} already exists; give another --out, or --force to overwrite it\n"
    assert path.read_text(encoding="utf-8") == "kept"
    assert not asked, "refused before the work"
    assert main([*arguments, "--force"]) == 0
    assert load_race(str(path)).name == "bahrain-2023"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["bahrain-2023"], "Missing option '--laps'"),
        (["bahrain", "--laps", "none"], "race 'bahrain' has no season; name it"),
        (["bahrain-2023", "--laps", "none", "--seasons", "2023;2022"], "--seasons '2023;2022' does not parse"),
        (["bahrain-2023", "--laps", "none", "--seasons", ""], "--seasons '' does not parse"),
        (["bahrain-2023", "--laps", "none"], "none/laps_2022.csv.gz: cannot be read"),
    ],
)
def test_unusable_input_is_one_line_and_exit_code_2(
    capsys: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["calibrate", *arguments, "--json"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert f"rsrl: error: {message}" in err
    assert list(tmp_path.iterdir()) == []


def test_folder_that_cannot_be_written_is_told_before_the_work(capsys: Capture, tmp_path: Path, asked: list[Any]) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    assert main(["calibrate", "bahrain-2023", "--laps", "l", "--out", str(tmp_path / "file" / "x.toml")]) == 2
    assert "cannot be written to" in capsys.readouterr().err
    assert not asked


@pytest.mark.real_data
def test_the_command_in_the_shipped_file_makes_its_figures_again(capsys: Capture, tmp_path: Path, real_data: Path) -> None:
    shipped = load_race("bahrain-2023")
    assert shipped.provenance.command.startswith("rsrl calibrate bahrain-2023 --seasons 2022,2023 ")
    folders = ["--laps", str(real_data / "laps"), "--facts", str(real_data / "facts")]
    assert main(["calibrate", "bahrain-2023", "--seasons", "2022,2023", *folders, "--out", str(tmp_path), "--json"]) == 0
    again = load_race(str(tmp_path / "bahrain-2023.toml"))
    figures = {row["name"]: row["value"] for row in json.loads(capsys.readouterr().out)["figures"]}
    for name, value, *_ in figure_table(shipped).iter_rows():
        assert figures[name] == pytest.approx(value, rel=1e-4, abs=1e-6), name
    assert again.published == shipped.published
    assert again.provenance.data == shipped.provenance.data
