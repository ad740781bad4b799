"""`rsrl replay`: its result on a race told as a lap file, and each input it refuses."""

import json
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from exported_race import export_race

from rsrl.cli import main
from rsrl.explanation.state_file import parse_state
from rsrl.results import ReplayResult, from_plain
from rsrl.season import RaceRecord
from rsrl.state import ACTION_NAMES

Capture = pytest.CaptureFixture[str]
NAMES = {"S": "SOFT", "M": "MEDIUM", "H": "HARD"}
STOPS = (12, 30)


def write_laps(path: Path, table: pl.DataFrame) -> Path:
    """A lap table as the file that `read_lap_csv` reads."""
    renamed = {"tyre_life_laps": "tyre_life", "pit_in_s": "pit_in", "pit_out_s": "pit_out"}
    table.with_columns(pl.col("compound").replace(NAMES)).rename(renamed).write_csv(path)
    return path


@pytest.fixture(scope="module")
def lap_file(bahrain: RaceRecord, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A simulated Bahrain 2023 with a safety car as a lap file; HAM boxes on laps 12 and 30."""
    exported = export_race(bahrain, bahrain.car_index("HAM"), 5, 10, STOPS)
    return write_laps(tmp_path_factory.mktemp("laps") / "laps_2023.csv", exported.table)


@pytest.fixture(scope="module")
def audited(lap_file: Path) -> dict[str, Any]:
    """The result of a replay with a small audit, as JSON."""
    import contextlib
    import io

    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        assert main(["replay", str(lap_file), "--driver", "hamilton", "--audit", "--races", "20", "--json"]) == 0
    found: dict[str, Any] = json.loads(out.getvalue())
    return found


def test_every_lap_has_a_call_and_what_was_known(audited: dict[str, Any], bahrain: RaceRecord) -> None:
    result = from_plain(audited, ReplayResult)
    assert (result.race, result.driver, result.model, result.finished) == ("bahrain-2023", "HAM", "all", True)
    assert [lap.lap for lap in result.laps] == list(range(1, bahrain.laps + 1))
    for lap in result.laps:
        assert lap.call in lap.legal
        assert lap.state is not None
        state = parse_state(lap.state, "state")  # what `rsrl explain --state` reads
        assert (state.laps_completed, state.driver) == (lap.lap - 1, "HAM")
        assert lap.values is not None
        assert set(lap.values) == set(ACTION_NAMES)
        assert lap.health is not None
        assert lap.looks[0].why == "lap begins"
        assert lap.agrees == (lap.call == lap.team)
    assert [lap.lap for lap in result.laps if lap.team != "no pit"] == list(STOPS)
    assert result.provenance is not None


def test_looks_come_when_the_race_changes(audited: dict[str, Any]) -> None:
    whys = {look["why"] for lap in audited["laps"] for look in lap["looks"]}
    assert {"lap begins", "pit entry", "new tyres"} <= whys
    assert any(why.endswith(" boxes") for why in whys)
    assert "safety car" in whys


def test_the_audit_adds_up(audited: dict[str, Any]) -> None:
    audit = from_plain(audited, ReplayResult).audit
    assert audit is not None
    laps = audited["laps"]
    assert (audit.races, audit.laps_called, audit.laps_agreed) == (20, len(laps), sum(lap["agrees"] for lap in laps))
    assert [lap.lap for lap in audit.differences] == [lap["lap"] for lap in laps if not lap["agrees"]]
    for one in audit.differences:
        assert one.places is not None
        assert one.ci95 is not None
        low, high = one.ci95
        assert low is not None
        assert high is not None
        assert low <= one.places <= high
    assert [stop.lap for stop in audit.stops] == list(STOPS)
    assert audit.stops_within_two_laps == sum(stop.within_two_laps for stop in audit.stops)
    for stop in audit.stops:
        if stop.within_two_laps:
            assert stop.policy_lap is not None
            assert abs(stop.policy_lap - stop.lap) <= 2


def test_table(lap_file: Path, capsys: Capture) -> None:
    assert main(["replay", str(lap_file), "--driver", "44", "--wide"]) == 0
    out = capsys.readouterr().out
    assert "HAM, called by all" in out
    assert out.count("stay out") + out.count("box for") >= 57


def test_a_race_without_season_file_is_tracked_without_calls(lap_file: Path, tmp_path: Path, capsys: Capture) -> None:
    table = pl.read_csv(lap_file, infer_schema=False).with_columns(season=pl.lit("2021"))
    table.write_csv(tmp_path / "laps.csv")
    assert main(["replay", str(tmp_path / "laps.csv"), "--driver", "HAM", "--json"]) == 0
    result = from_plain(json.loads(capsys.readouterr().out), ReplayResult)
    assert result.model is None
    assert result.note is not None
    assert "no season file of bahrain-2021" in result.note
    assert len(result.laps) == 57
    assert all(lap.call is None for lap in result.laps)
    assert {lap.position for lap in result.laps[1:]} != {None}
    assert result.laps[20].compound == "H"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--driver", "XYZ"], "unknown driver 'XYZ' for bahrain-2023; who started: "),
        (["--race", "atlantis-2023"], "unknown race 'atlantis-2023'; known races: bahrain, each with a season such as 2023"),
        (["--race", "monza-2023"], "unknown race 'monza-2023'; no season file of italy"),
        (["--model", "nobody"], "no model 'nobody'"),
    ],
)
def test_unusable_input_is_one_line_and_exit_code_2(lap_file: Path, capsys: Capture, arguments: list[str], message: str) -> None:
    assert main(["replay", str(lap_file), *arguments]) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len([line for line in said if line.startswith("rsrl: error: ")]) == 1
    assert message in said[-1]


@pytest.mark.parametrize(
    ("content", "message"),
    [(None, "cannot be read"), ("", "is empty"), ("a,b\n1,2\n", "column season, round"), ("\x00\x01", "lap")],
    ids=["absent", "empty", "another table", "no text"],
)
def test_a_file_that_is_no_lap_file_is_refused(tmp_path: Path, capsys: Capture, content: str | None, message: str) -> None:
    path = tmp_path / "laps.csv"
    if content is not None:
        path.write_text(content)
    assert main(["replay", str(path), "--race", "bahrain-2023"]) == 2
    err = capsys.readouterr().err.strip()
    assert err.count("\n") == 0
    assert err.startswith("rsrl: error: ")
    assert message in err


def test_what_would_have_happened_beside_what_did(lap_file: Path, capsys: Capture) -> None:
    asked = ["replay", str(lap_file), "--what-if", "HAM@9-H", "--races", "40"]
    assert main([*asked, "--json"]) == 0
    result = from_plain(json.loads(capsys.readouterr().out), ReplayResult)
    found = result.what_if
    assert found is not None
    assert (found.driver, found.lap, found.races, [lap for lap, _ in found.stops]) == ("HAM", 9, 40, list(STOPS))
    assert found.finish is not None
    options = {one.name: one for one in found.options}
    assert (options["asked"].call, options["team"].call[:13]) == ("box now for hard", "box in 3 laps")
    assert (options["team"].verdict, options["team"].places) == ("itself", 0.0)
    for one in found.options:
        assert sum(one.positions) == pytest.approx(1.0)
        assert sum((i + 1) * share for i, share in enumerate(one.positions)) == pytest.approx(one.mean_position)
        assert one.places == pytest.approx(one.mean_position - options["team"].mean_position)
    assert main([*asked, "--wide"]) == 0
    shown = capsys.readouterr().out
    assert "what the team did" in shown
    assert "What happened: finished P" in shown


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ("HAM 20 H", "does not parse"),
        ("HAM@99-H", "has no lap 99"),
        ("HAM@57-H", "pit hard is not possible on lap 57"),
        ("XYZ@20-H", "unknown driver 'XYZ'"),
    ],
)
def test_a_what_if_that_cannot_be_is_refused(lap_file: Path, capsys: Capture, asked: str, message: str) -> None:
    assert main(["replay", str(lap_file), "--what-if", asked, "--races", "4"]) == 2
    assert message in capsys.readouterr().err.splitlines()[-1]
