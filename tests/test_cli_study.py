"""`rsrl study`: its results, its files, and each input it refuses."""

import json
from pathlib import Path
from typing import Any

import pytest

from rsrl.agents import TRAINING_SEED, load_agent
from rsrl.cli import main
from rsrl.evaluation import APART
from rsrl.strategists import find_model

Capture = pytest.CaptureFixture[str]
SMALL = ["--races", "6", "--strategists", "fixed,heuristic", "--models", "all=bahrain-2023", "--workers", "1"]


def studied(capsys: Capture, out: Path, *arguments: str) -> dict[str, Any]:
    assert main(["study", "generalise", "--out", str(out), *SMALL, *arguments, "--json"]) == 0
    result: dict[str, Any] = json.loads(capsys.readouterr().out)
    return result


def test_result_and_files(capsys: Capture, tmp_path: Path) -> None:
    result = studied(capsys, tmp_path, "--tracks", "japan,qatar", "--races-of", "heuristic=3")
    assert (result["study"], result["reference"], result["seed"], result["first_race"]) == ("generalise", "all", 7, 0)
    assert [(s["strategist"], s["kind"], s["races"]) for s in result["strategists"]] == [
        ("all", "model", 6), ("fixed", "baseline", 6), ("heuristic", "baseline", 3),
    ]  # fmt: skip
    assert [row["race"] for row in result["tracks"]["races"]] == ["japan-2023", "qatar-2023"]
    assert [(row["strategist"], row["race"]) for row in result["left_out"]] == [("fixed", "qatar-2023")]
    assert result["left_out"][0]["reason"].startswith("the season file holds no published strategies")
    assert (result["cars"], result["held_out"]) == ([], None)
    assert result["provenance"]["command"].startswith("rsrl study generalise --out")
    assert json.loads((tmp_path / "generalise.json").read_text()) == result
    table = (tmp_path / "table3.md").read_text().splitlines()
    assert table[0] == "|  | JPN | QAT | seen | unseen | all tracks |"
    assert [line.split("|")[1].strip() for line in table[2:5]] == ["all", "fixed", "heuristic"]
    assert table[3].split("|")[3].strip() == "-"
    assert "6 races (heuristic 3) of seed 7" in table[6]
    assert table[-1].startswith("fixed left out of qatar-2023: the season file holds no published strategies")
    assert (tmp_path / "strategies-japan-2023.png").read_bytes().startswith(b"\x89PNG")


def test_a_finished_study_is_extended_and_its_cells_used_again(capsys: Capture, tmp_path: Path) -> None:
    studied(capsys, tmp_path, "--tracks", "japan")
    before = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "cells").iterdir()}
    command = [
        "study",
        "generalise",
        "--out",
        str(tmp_path),
        *SMALL,
        "--tracks",
        "japan,spain",
        "--cars",
        "japan",
        "--cars-by",
        "all,heuristic",
    ]
    assert main(command) == 2
    assert "generalise.json already exists; give another --out, or --force" in capsys.readouterr().err
    assert main([*command, "--force"]) == 0
    out = capsys.readouterr().out
    after = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "cells").iterdir()}
    assert len(before) == 3
    assert len(after) == 3 + 3 + 2 * 19, "the default driver's cells serve both"
    assert all(after[name] == changed for name, changed in before.items())
    assert "Every car called in turn: all against others" in out
    assert "japan" in out


def test_without_a_model_nobody_is_compared_with_one(capsys: Capture, tmp_path: Path) -> None:
    assert main(["study", "generalise", "--out", str(tmp_path), *SMALL, "--models", "", "--tracks", "japan"]) == 0
    capsys.readouterr()
    result = json.loads((tmp_path / "generalise.json").read_text())
    assert result["reference"] is None
    assert result["tracks"]["differences"] == []


def test_the_training_seed_gets_races_that_training_never_saw(capsys: Capture, tmp_path: Path) -> None:
    seed = load_agent(find_model("bahrain-2023"))[1].seed + TRAINING_SEED
    result = studied(capsys, tmp_path, "--tracks", "bahrain", "--seed", str(seed), "--strategists", "")
    assert result["first_race"] == APART


def test_a_folder_of_another_study_is_refused_and_nothing_is_lost(capsys: Capture, tmp_path: Path) -> None:
    studied(capsys, tmp_path, "--tracks", "japan", "--strategists", "")
    (tmp_path / "generalise.json").unlink()
    (tmp_path / "table3.md").unlink()
    cells = sorted((tmp_path / "cells").iterdir())
    assert refused(capsys, tmp_path, "--seed", "8").startswith(f"{tmp_path}: holds a study of seed 7, not 8; choose another --out")
    about = tmp_path / "study.json"
    about.write_text(about.read_text().replace('"version": "', '"version": "0.0.'))
    assert "holds a study of version '0.0." in refused(capsys, tmp_path)
    assert sorted((tmp_path / "cells").iterdir()) == cells


def refused(capsys: Capture, out: Path, *arguments: str) -> str:
    assert main(["study", "generalise", "--out", str(out), *SMALL, "--tracks", "japan", *arguments]) == 2
    printed, err = capsys.readouterr()
    assert (printed, err.count("\n")) == ("", 1)
    assert err.startswith("rsrl: error: ")
    return err.removeprefix("rsrl: error: ").strip()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--tracks", "atlantis"], "unknown race 'atlantis-2023'; known races: "),
        (["--tracks", ","], "--tracks names no track"),
        (["--strategists", "oracle"], "unknown strategist 'oracle'; there are fixed, heuristic"),
        (["--models", "all=nowhere"], "no model 'nowhere': neither a run folder"),
        (["--models", "all="], "--models 'all=' does not parse; write NAME=FOLDER"),
        (["--models", "bahrain-2023,bahrain-2023=x"], "--models: bahrain-2023 is there twice"),
        (["--driver", "SEN"], "unknown driver 'SEN' for japan-2023"),
        (["--races-of", "heuristic"], "--races-of 'heuristic' does not parse; write NAME=N"),
        (["--races-of", "heuristic=one"], "--races-of heuristic=one: write a number of races"),
        (["--races-of", "dp9=4"], "races of 'dp9': no such strategist takes part"),
        (["--cars", "spain"], "--cars spain-2023: not among the study's races"),
        (["--cars", "japan", "--cars-by", "dp9"], "--cars-by dp9: takes no part in the study"),
        (["--engine", "spark"], "unknown engine 'spark'; there are local, ray"),
        (["--address", "a:1"], "address a:1: only the engine ray has one"),
        (["--races", "1"], "Invalid value for '--races'"),
    ],
)
def test_unusable_input_is_one_line_and_exit_code_2(capsys: Capture, tmp_path: Path, arguments: list[str], message: str) -> None:
    assert refused(capsys, tmp_path / "new", *arguments).startswith(message)
    assert not (tmp_path / "new").exists()


def test_an_unreachable_cluster_is_one_line(capsys: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RAY_AUTH_TOKEN", "0" * 64)
    assert (
        main(["study", "generalise", "--out", str(tmp_path), *SMALL, "--tracks", "japan", "--engine", "ray", "--address", "127.0.0.1:1"])
        == 2
    )
    assert capsys.readouterr().err.splitlines()[-1].startswith("rsrl: error: Ray cluster 127.0.0.1:1: nobody answers")


def test_a_study_must_be_named(capsys: Capture) -> None:
    assert main(["study"]) == 2
    assert capsys.readouterr().err == "rsrl: error: Missing command; see `rsrl study --help`\n"
    assert main(["study", "alchemy"]) == 2
    assert "No such command 'alchemy'; see `rsrl study --help`" in capsys.readouterr().err
