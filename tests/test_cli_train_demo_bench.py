"""The commands that train: run folders, the demo's leaderboard, the figures of the benchmark."""

import json
from pathlib import Path

import pytest

from rsrl.cli import demo, main

Capture = pytest.CaptureFixture[str]


def test_trains_into_a_run_folder_that_evaluate_reads(capsys: Capture, tmp_path: Path) -> None:
    out = tmp_path / "run"
    assert main(["train", "bahrain-2023", "--iterations", "1", "--out", str(out), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert (result["race"], result["driver"], result["agent"], result["iterations"]) == ("bahrain-2023", "HAM", "rsrl", 1)
    assert result["finished"]
    assert result["provenance"]["command"].startswith("rsrl train bahrain-2023")
    assert main(["evaluate", str(out), "--races", "8", "--strategists", "fixed", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert {row["strategist"] for row in rows} == {"rsrl", "fixed"}
    assert all(row["invalid_share"] == 0 for row in rows)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--agent", "ppo"], "unknown agent 'ppo'; known agents: dqn, drqn, rsrl"),
        (["--seconds", "0"], "nothing to train for"),
        (["--seconds", "5", "--iterations", "5"], "give either --seconds or --iterations"),
        (["--driver", "XXX"], "unknown driver 'XXX' for bahrain-2023"),
        (["--resume"], "no such run folder"),
    ],
)
def test_what_cannot_be_trained_is_told_in_one_line(capsys: Capture, tmp_path: Path, arguments: list[str], message: str) -> None:
    assert main(["train", "bahrain-2023", "--out", str(tmp_path / "run"), *arguments]) == 2
    error = capsys.readouterr().err.splitlines()[-1]
    assert error.startswith("rsrl: error: ")
    assert message in error


def test_a_trained_model_is_not_overwritten_unasked(capsys: Capture, tmp_path: Path) -> None:
    out = tmp_path / "run"
    out.mkdir()
    (out / "model.json").write_text("{}")
    assert main(["train", "bahrain-2023", "--iterations", "1", "--out", str(out)]) == 2
    assert (out / "model.json").read_text() == "{}"
    assert "--force" in capsys.readouterr().err


def test_demo_shows_the_leaderboard_of_all_on_the_same_races(capsys: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(demo, "DEFAULT_STRATEGISTS", "fixed,heuristic")  # a plan search takes half a minute
    out = tmp_path / "demo"
    assert main(["demo", "--pretrained", "--races", "64", "--out", str(out), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert {row["strategist"] for row in result["rows"]} == {"rsrl", "fixed", "heuristic"}
    assert (result["races"], result["seed"], result["training"]["pretrained"]) == (64, 7, True)
    assert {p.name for p in out.iterdir()} == {"evaluation.json", "positions.png", "strategies.png"}


def test_bench_gives_every_figure(capsys: Capture) -> None:
    assert main(["bench", "--repeats", "1", "--train-seconds", "1", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    figures = [
        *(result["simulator"][k] for k in ("races_per_s", "races_per_s_one_thread")),
        result["environment"]["steps_per_s"],
        result["training"]["steps_per_s"],
        result["decision"]["ms"],
    ]
    assert all(figure > 0 for figure in figures)
