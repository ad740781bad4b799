"""`rsrl calibrate`: what it hands to the fit, what it writes, and each input it refuses."""

import gzip
import json
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from calibration_laps import write_season
from test_calibration_race import some_seasons

from rsrl import calibration
from rsrl.cli import main
from rsrl.season import load_race, race_hash
from rsrl.season.bounds import BOUNDS

Capture = pytest.CaptureFixture[str]
SEASONS = ("2022", "2023")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("laps")
    table = some_seasons()
    for season in SEASONS:
        write_season(table, path, int(season))
    return path


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch, folder: Path) -> list[tuple[Any, ...]]:
    """Keeps the fit in one process and holds the arguments of each call."""
    calls: list[tuple[Any, ...]] = []
    real = calibration.calibrate

    def fit(laps: Path, facts: Path | None, seasons: tuple[int, ...], command: str, report: Any, workers: int) -> calibration.Calibration:
        calls.append((laps, facts, seasons, command))
        return real(laps, facts, seasons, command, report, workers=1)

    monkeypatch.setattr(calibration, "calibrate", fit)
    return calls


def test_writes_every_race_of_the_seasons_and_tells_what_was_made_of_each(
    capsys: Capture, tmp_path: Path, folder: Path, asked: list[Any]
) -> None:
    out = tmp_path / "races"
    assert main(["calibrate", "--laps", str(folder), "--seasons", "2022,2023", "--out", str(out), "--json"]) == 0
    said, err = capsys.readouterr()
    result = json.loads(said)
    names = ["bahrain-2022", "canada-2022", "bahrain-2023", "monaco-2023", "canada-2023"]
    assert [r["race"] for r in result["races"]] == names
    assert sorted(p.stem for p in out.glob("*.toml")) == sorted(names)
    assert [r["wet"] for r in result["races"]] == [False, False, False, True, False]
    for row in result["races"]:
        record = load_race(str(out / f"{row['race']}.toml"))
        assert row["season_hash"] == race_hash(record)
        assert bool(record.scaling) != record.wet
        assert record.provenance.command == f"rsrl calibrate --seasons 2022,2023 --laps {folder}"
    assert err.splitlines() == ["Analysing 2022 and 2023 ...", "Writing season files ...", f"5 season files written to {out}"]
    assert asked[0][1:3] == (None, (2022, 2023))


def test_one_race_of_all_is_written_with_every_figure_told(capsys: Capture, tmp_path: Path, folder: Path, asked: list[Any]) -> None:
    path = tmp_path / "mine.toml"
    assert main(["calibrate", "bahrain-2023", "--laps", str(folder), "--out", str(path)]) == 0
    out, err = capsys.readouterr()
    assert asked[0][2] == (2022, 2023), "the season before is taken too"
    assert "track.base_lap_s" in out
    assert all(car.driver in out for car in load_race(str(path)).cars)
    assert err.endswith(f"Written to {path}\n")


def test_only_some_seasons_are_written(capsys: Capture, tmp_path: Path, folder: Path, asked: list[Any]) -> None:
    assert main(["calibrate", "--laps", str(folder), "--seasons", "2022,2023", "--only", "2022", "--out", str(tmp_path)]) == 0
    assert sorted(p.stem for p in tmp_path.glob("*.toml")) == ["bahrain-2022", "canada-2022"]
    assert "bahrain-2022" in capsys.readouterr().out


def test_nothing_is_overwritten_unasked(capsys: Capture, tmp_path: Path, folder: Path, asked: list[Any]) -> None:
    path = tmp_path / "bahrain-2023.toml"
    path.write_text("kept", encoding="utf-8")
    for arguments in (["bahrain-2023"], ["--seasons", "2022,2023"]):
        place = str(tmp_path)
        assert main(["calibrate", *arguments, "--laps", str(folder), "--out", place]) == 2
        assert "already exists; give another --out, or --force to overwrite it" in capsys.readouterr().err
    assert path.read_text(encoding="utf-8") == "kept"
    assert not asked, "refused before the work"


def test_a_file_that_nothing_could_read_leaves_the_folder_as_it_was(
    capsys: Capture, tmp_path: Path, folder: Path, asked: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "bahrain-2022.toml").write_text("kept", encoding="utf-8")
    monkeypatch.setitem(BOUNDS, "red_share", (0.9, 1.0))
    arguments = ["calibrate", "--laps", str(folder), "--seasons", "2022,2023", "--out", str(tmp_path), "--force"]
    assert main(arguments) == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert said.startswith(
        "rsrl: error: bahrain-2022: these laps give a file that cannot be used, and none is written: incidents.red_share is"
    )
    assert [path.name for path in tmp_path.iterdir()] == ["bahrain-2022.toml"]
    assert (tmp_path / "bahrain-2022.toml").read_text(encoding="utf-8") == "kept"


def test_the_season_before_is_taken_where_its_file_is_there(tmp_path: Path, asked: list[Any]) -> None:
    write_season(some_seasons(), tmp_path, 2023)
    assert main(["calibrate", "monaco-2023", "--laps", str(tmp_path), "--out", str(tmp_path)]) == 0
    assert asked[0][2] == (2023,)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["bahrain-2023"], "Missing option '--laps'"),
        (["--laps", "none"], "no season given; name some with --seasons"),
        (["--laps", "none", "--seasons", "2023"], "no folder given for the season files; name one with --out"),
        (
            ["--laps", "none", "--seasons", "2023", "--only", "2022", "--out", "x"],
            "--only '2022': races can be written of the seasons 2023",
        ),
        (["bahrain", "--laps", "none"], "race 'bahrain' has no season; name it"),
        (["atlantis-2023", "--laps", "none"], "unknown race 'atlantis-2023'; known races: "),
        (["Monza 2023", "--laps", "none"], "none/laps_2023.csv.gz: cannot be read"),
        (["bahrain-2023", "--laps", "none", "--seasons", "2023;2022"], "--seasons '2023;2022' does not parse"),
        (["bahrain-2023", "--laps", "none", "--seasons", ""], "--seasons '' does not parse"),
        (["bahrain-2023", "--laps", "none"], "none/laps_2023.csv.gz: cannot be read"),
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
    assert list(tmp_path.glob("*.toml")) == []


def broken(name: str) -> pl.DataFrame:
    """A season of one race with one fault."""
    table = some_seasons().filter((pl.col("season") == 2023) & (pl.col("round") == 1))
    first = pl.int_range(pl.len()) == 7
    faults: dict[str, pl.DataFrame] = {
        "column": table.drop("team"),
        "compound": table.with_columns(compound=pl.when(first).then(pl.lit("PURPLE")).otherwise("compound")),
        "double": pl.concat([table, table[7:8]]),
        "negative": table.with_columns(lap_time_s=pl.when(first).then(-90.0).otherwise("lap_time_s")),
        "long": table.with_columns(lap_time_s=pl.when(first).then(10_000.0).otherwise("lap_time_s")),
        "zero": table.with_columns(lap_time_s=pl.when(pl.col("lap") == 5).then(0.0).otherwise("lap_time_s")),
        "lap": table.with_columns(lap=pl.when(first).then(4000).otherwise("lap")),
        "season": table.with_columns(season=pl.when(first).then(2019).otherwise("season")),
        "short": table.filter(pl.col("lap") < 4),
    }
    return faults[name]


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("column", "column team is missing; a lap file has the columns season, round, event, driver, team, lap, lap_time_s, compound,"),
        ("compound", "row 9, column compound: unknown compound 'PURPLE'; known are SOFT"),
        ("double", "row 1142: ALB has lap 8 of round 1 more than once, first in row 9; remove the double row"),
        ("negative", "row 9, column lap_time_s: -90.0 is negative; leave it blank"),
        ("long", "row 9, column lap_time_s: 10000.0 is longer than any race; times are in seconds"),
        ("zero", "row 6, column lap_time_s: 0.0 is zero; leave it blank"),
        ("lap", "row 9, column lap: 4000 is beyond 100"),
        ("season", "row 9, column season: 2019 in the file of 2023; keep one season in each file"),
        ("short", "row 2: round 1 (Bahrain Grand Prix) ends after lap 3, with 60 rows; give the whole race"),
    ],
)
def test_a_broken_lap_file_is_named_with_row_and_remedy(capsys: Capture, tmp_path: Path, fault: str, message: str) -> None:
    path = tmp_path / "laps_2023.csv.gz"
    write_all(broken(fault), tmp_path)
    assert main(["calibrate", "bahrain-2023", "--laps", str(tmp_path), "--seasons", "2023", "--out", str(tmp_path / "out")]) == 2
    assert f"rsrl: error: {path}: {message}" in capsys.readouterr().err
    assert list((tmp_path / "out").iterdir()) == []


def write_all(table: pl.DataFrame, folder: Path) -> None:
    """Write a table as the file of 2023, whatever seasons it holds."""
    names = {"S": "SOFT", "M": "MEDIUM", "H": "HARD"}
    out = table.with_columns(pl.col("compound").replace(names)).rename(
        {"tyre_life_laps": "tyre_life", "pit_in_s": "pit_in", "pit_out_s": "pit_out"}
    )
    (folder / "laps_2023.csv.gz").write_bytes(gzip.compress(out.write_csv().encode()))


def test_folder_that_cannot_be_written_is_told_before_the_work(capsys: Capture, tmp_path: Path, asked: list[Any]) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    assert main(["calibrate", "bahrain-2023", "--laps", "l", "--out", str(tmp_path / "file" / "x.toml")]) == 2
    assert "cannot be written to" in capsys.readouterr().err
    assert not asked
