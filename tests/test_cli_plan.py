"""`rsrl plan`: its result, and each input it refuses."""

import json
from pathlib import Path
from typing import Any

import pytest

from rsrl.cli import main
from rsrl.season import RaceRecord
from rsrl.simulator import Plan, check_plan

Capture = pytest.CaptureFixture[str]
QUICK = ("bahrain-2023", "--races", "2000")
PLAN_FIELDS = [
    "plan", "start", "stops", "sc_window_laps", "vsc_window_laps", "mean_position", "ci95", "behind_best", "behind_best_ci95",
    "mean_points", "mean_points_ci95", "p_best", "clean_air_loss_s",
]  # fmt: skip


def planned(capsys: Capture, *options: str) -> dict[str, Any]:
    assert main(["plan", *QUICK, "--json", *options]) == 0
    result: dict[str, Any] = json.loads(capsys.readouterr().out)
    return result


def test_result_as_json(capsys: Capture, bahrain: RaceRecord) -> None:
    result = planned(capsys, "--driver", "alo", "--seed", "3")
    assert (result["race"], result["driver"], result["start"], result["seed"]) == ("bahrain-2023", "ALO", None, 3)
    assert result["legal_plans"] > 1_000_000
    assert result["races"] > 2000
    plans = result["plans"]
    assert len(plans) > 3
    assert [p["mean_position"] for p in plans] == sorted(p["mean_position"] for p in plans)
    assert plans[0]["behind_best"] == 0
    for row in plans:
        assert list(row) == PLAN_FIELDS
        plan = Plan.parse(row["plan"])
        check_plan(plan, bahrain)
        assert plan.laps == tuple(stop["lap"] for stop in row["stops"])
        assert row["ci95"][0] < row["mean_position"] < row["ci95"][1]
        assert all(stop["window"][0] <= stop["lap"] <= stop["window"][1] for stop in row["stops"])
        assert (row["sc_window_laps"], row["vsc_window_laps"]) == (0, 0)


def test_start_and_safety_car_rule(capsys: Capture) -> None:
    plans = planned(capsys, "--start", "m", "--sc-rule")["plans"]
    assert {row["start"] for row in plans} == {"M"}
    assert plans[0]["sc_window_laps"] > 0


def test_table_and_figure(capsys: Capture, tmp_path: Path) -> None:
    assert main(["plan", *QUICK, "--start", "S", "--out", str(tmp_path / "new")]) == 0
    out = capsys.readouterr().out
    assert "legal plans" in out
    assert "S━━" in out
    assert "laps " in out
    assert (tmp_path / "new" / "plans.png").read_bytes().startswith(b"\x89PNG")
    assert main(["plan", *QUICK, "--out", str(tmp_path / "new")]) == 2
    assert "plans.png already exists" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["atlantis-2023"], "unknown race 'atlantis-2023'; known races: "),
        (["bahrain-2023", "--driver", "SEN"], "unknown driver 'SEN' for bahrain-2023"),
        (["bahrain-2023", "--start", "X"], "--start 'X': unknown compound; compounds are S, M, H"),
        (["bahrain-2023", "--races", "0"], "Invalid value for '--races'"),
        (["bahrain-2023", "--races", "3"], "a plan search on 3 races finds nothing"),
        (["bahrain-2023", "--seed", "-1"], "Invalid value for '--seed'"),
    ],
)
def test_unusable_input_is_one_line_and_exit_code_2(capsys: Capture, arguments: list[str], message: str) -> None:
    assert main(["plan", *arguments, "--json"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert f"rsrl: error: {message}" in err.splitlines()[-1]


def test_a_folder_that_cannot_be_written_is_refused_before_the_work(capsys: Capture, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    assert main(["plan", *QUICK, "--out", str(tmp_path / "file" / "sub")]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert "cannot be written to" in err
