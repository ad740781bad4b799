"""`rsrl evaluate`: its result, and each input it refuses."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rsrl.agents import TRAINING_SEED, ModelMetadata, default_config, save_run
from rsrl.agents.interface import NetworkAgent
from rsrl.agents.networks import NETWORKS
from rsrl.cli import main
from rsrl.evaluation import APART
from rsrl.state import input_names

Capture = pytest.CaptureFixture[str]
ROW_FIELDS = [
    "strategist", "mean_position", "ci95", "difference", "difference_ci95", "p_better", "mean_points", "mean_stops", "invalid_share",
    "retired_share", "decision_ms", "gap_closed", "gap_closed_ci95",
]  # fmt: skip


def untrained(kind: str = "rsrl", names: tuple[str, ...] | None = None, seed: int = 0) -> NetworkAgent:
    feature_set = default_config(kind).feature_set
    names = names or input_names(feature_set)
    network = NETWORKS["feed-forward" if kind == "rsrl" else "lstm"](len(names), 8)
    return NetworkAgent(kind, feature_set, names, kind == "rsrl", network, network.init(np.random.default_rng(seed)))


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A run folder with an untrained model."""
    folder = tmp_path_factory.mktemp("runs") / "x"
    save_run(folder, untrained(), ModelMetadata(race="bahrain-2023", driver="HAM", seed=4))
    return str(folder)


def evaluated(capsys: Capture, *arguments: str) -> dict[str, Any]:
    assert main(["evaluate", *arguments, "--races", "60", "--json"]) == 0
    result: dict[str, Any] = json.loads(capsys.readouterr().out)
    return result


def test_result_as_json(capsys: Capture, run: str) -> None:
    result = evaluated(capsys, run, "--strategists", "fixed,heuristic")
    assert (result["race"], result["driver"], result["races"], result["seed"]) == ("bahrain-2023", "HAM", 60, 7)
    assert result["first_race"] == 0
    rows = {row["strategist"]: row for row in result["rows"]}
    assert set(rows) == {"rsrl", "fixed", "heuristic"}
    for row in rows.values():
        assert list(row) == ROW_FIELDS
        assert row["ci95"][0] < row["mean_position"] < row["ci95"][1]
        assert row["decision_ms"] > 0
        assert row["gap_closed"] is None, "without hindsight there is no gap to close"
    assert (rows["rsrl"]["difference"], rows["rsrl"]["difference_ci95"], rows["rsrl"]["p_better"]) == (0, [0, 0], 0.5)
    assert rows["fixed"]["difference"] == pytest.approx(rows["fixed"]["mean_position"] - rows["rsrl"]["mean_position"])
    means = [row["mean_position"] for row in result["rows"]]
    assert means == sorted(means)


def test_other_models_are_compared_under_names_of_their_own(capsys: Capture, run: str, tmp_path: Path) -> None:
    save_run(tmp_path / "second", untrained(), ModelMetadata(seed=9))
    save_run(tmp_path / "paper", untrained("drqn"), ModelMetadata())
    result = evaluated(capsys, run, "--strategists", f"{tmp_path / 'second'},{tmp_path / 'paper'},fixed", "--seed", str(TRAINING_SEED + 9))
    rows = {row["strategist"]: row for row in result["rows"]}
    assert set(rows) == {"rsrl", "rsrl second", "drqn", "fixed"}
    assert rows["rsrl second"]["difference"] == 0
    assert result["first_race"] == APART, "the second model trained on this seed"


def test_a_folder_with_brackets_in_its_name_is_shown_as_it_is(capsys: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("[x]", "[bold]"):
        save_run(Path("runs") / name, untrained(), ModelMetadata(race="bahrain-2023", driver="HAM"))
    assert main(["evaluate", "runs/[x],runs/[bold]", "--races", "4", "--strategists", "fixed"]) == 0
    out = capsys.readouterr().out
    assert "rsrl [x]" in out
    assert "rsrl [bold]" in out
    assert main(["evaluate", "runs/[y]"]) == 2
    assert "runs/[y]" in capsys.readouterr().err


def test_another_race_file_driver_and_no_company(capsys: Capture, run: str) -> None:
    result = evaluated(capsys, run, "--driver", "alo", "--race", "bahrain-2023", "--strategists", "")
    assert result["driver"] == "ALO"
    assert [row["strategist"] for row in result["rows"]] == ["rsrl"]


def test_several_seeds_of_a_model_get_a_row_each_and_an_aggregate(capsys: Capture, run: str, tmp_path: Path) -> None:
    about = ModelMetadata(race="bahrain-2023", driver="HAM")
    save_run(tmp_path / "b", untrained(seed=1), about)
    save_run(tmp_path / "c", untrained(seed=2), about)
    models = f"{run},{tmp_path / 'b'},{tmp_path / 'c'}"
    result = evaluated(capsys, models, "--strategists", "fixed")
    rows = {row["strategist"]: row for row in result["rows"]}
    assert set(rows) == {"rsrl x", "rsrl b", "rsrl c", "fixed"}
    seeds = [rows[name]["mean_position"] for name in ("rsrl x", "rsrl b", "rsrl c")]
    together = result["aggregate"]
    assert together["seeds"] == 3
    assert together["mean_position"] == pytest.approx(np.mean(seeds))
    assert together["iqm_position_ci95"][0] <= together["iqm_position"] <= together["iqm_position_ci95"][1]
    (fixed,) = together["comparisons"]
    assert fixed["difference"] == pytest.approx(rows["fixed"]["mean_position"] - np.mean(seeds)) == rows["fixed"]["difference"]
    assert sum(rows[name]["difference"] for name in ("rsrl x", "rsrl b", "rsrl c")) == pytest.approx(0)
    assert main(["evaluate", models, "--races", "60", "--strategists", "fixed"]) == 0
    out = capsys.readouterr().out
    assert "3 seeds together" in out
    assert "behind the mean of 3 seeds" in out


def test_models_that_differ_in_more_than_their_seed_are_refused(capsys: Capture, run: str, tmp_path: Path) -> None:
    save_run(tmp_path / "paper", untrained("drqn"), ModelMetadata(race="bahrain-2023", driver="HAM"))
    assert "give models that differ in their seed alone" in refused(capsys, f"{run},{tmp_path / 'paper'}")
    assert "a model is named twice" in refused(capsys, f"{run},{run}")


def test_the_training_seed_gets_races_that_training_never_saw(capsys: Capture, run: str) -> None:
    result = evaluated(capsys, run, "--strategists", "fixed", "--seed", str(TRAINING_SEED + 4))
    assert result["first_race"] == APART
    assert evaluated(capsys, run, "--strategists", "fixed", "--seed", str(TRAINING_SEED + 5))["first_race"] == 0


def test_table_and_files(capsys: Capture, run: str, tmp_path: Path) -> None:
    arguments = ["evaluate", run, "--races", "60", "--strategists", "fixed", "--out", str(tmp_path / "new")]
    assert main(arguments) == 0
    out = capsys.readouterr().out
    assert "rsrl <" in out
    assert "60 races of seed 7" in out
    saved = json.loads((tmp_path / "new" / "evaluation.json").read_text())
    assert [row["strategist"] for row in saved["strategies"]].count("fixed") >= 2
    for name in ("positions.png", "strategies.png"):
        assert (tmp_path / "new" / name).read_bytes().startswith(b"\x89PNG")
    assert main(arguments) == 2
    assert "already exists" in capsys.readouterr().err
    assert main([*arguments, "--force"]) == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--races", "0"], "Invalid value for '--races'"),
        (["--strategists", "fixed,oracle"], "unknown strategist 'oracle'; there are fixed, heuristic, best-plan, best-plan-sc"),
        (["--race", "atlantis-2023"], "unknown race 'atlantis-2023'; known races: "),
        (["--driver", "SEN"], "unknown driver 'SEN' for bahrain-2023"),
        (["--seed", "-1"], "Invalid value for '--seed'"),
    ],
)
def test_unusable_input_is_one_line_and_exit_code_2(capsys: Capture, run: str, arguments: list[str], message: str) -> None:
    assert main(["evaluate", run, *arguments, "--json"]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert err.startswith(f"rsrl: error: {message}")


def refused(capsys: Capture, model: Path | str, *arguments: str) -> str:
    assert main(["evaluate", str(model), *arguments]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    return err


def test_a_model_that_cannot_be_used_is_refused(capsys: Capture, run: str, tmp_path: Path) -> None:
    assert "no model 'nowhere': neither a run folder" in refused(capsys, "nowhere")
    assert "holds no model.json" in refused(capsys, tmp_path)
    save_run(tmp_path / "foreign", untrained(names=("speed", "colour")), ModelMetadata(race="bahrain-2023"))
    assert "trained on another version of the 'full' features" in refused(capsys, tmp_path / "foreign")
    save_run(tmp_path / "nameless", untrained(), ModelMetadata())
    assert "does not say which race it was trained on; name one with --race" in refused(capsys, tmp_path / "nameless")
    (tmp_path / "file").write_text("x")
    assert "cannot be written to" in refused(capsys, run, "--out", str(tmp_path / "file" / "sub"))
