"""The commands that train: run folders, the demo's leaderboard, the figures of the benchmark."""

import json
import tempfile
from pathlib import Path

import pytest

from rsrl.agents import load_agent
from rsrl.cli import demo, main
from rsrl.state import input_names

Capture = pytest.CaptureFixture[str]
SCREEN_LINES, EXPLAINED_LINES = 24, 8


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


def test_a_folder_without_a_checkpoint_is_begun_again_and_not_resumed(capsys: Capture, tmp_path: Path) -> None:
    assert main(["train", "bahrain-2023", "--resume", "--out", str(tmp_path)]) == 2
    assert capsys.readouterr().err.endswith(f"{tmp_path}: holds no checkpoint to continue from; start the run again without --resume\n")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--agent", "ppo"], "unknown agent 'ppo'; known agents: dqn, drqn, rsrl"),
        (["--seconds", "0"], "nothing to train for"),
        (["--seconds", "5", "--iterations", "5"], "give either --seconds or --iterations"),
        (["--driver", "XXX"], "unknown driver 'XXX' for bahrain-2023"),
        (["--resume"], "no such run folder"),
        (["--features", "half"], "unknown feature set 'half'; there are paper, full, named"),
        (["--features", "paper"], "--features paper with --agent rsrl: rsrl reads full or named"),
        (["--features", "full", "--agent", "drqn"], "--features full with --agent drqn"),
        (["--goal", "laps"], "no goal 'laps'; there are position, points, paper-reward"),
        (["--goal", "points", "--agent", "dqn"], "--goal points with --agent dqn: the paper's agents learn the paper's reward"),
        (["--agent", "dqn", "--driver", "all"], "dqn learns one race for one car, as in the paper; name one race and one driver"),
    ],
)
def test_what_cannot_be_trained_is_told_in_one_line(capsys: Capture, tmp_path: Path, arguments: list[str], message: str) -> None:
    assert main(["train", "bahrain-2023", "--out", str(tmp_path / "run"), *arguments]) == 2
    error = capsys.readouterr().err.splitlines()[-1]
    assert error.startswith("rsrl: error: ")
    assert message in error


@pytest.mark.parametrize(
    ("races", "agent", "message"),
    [
        ("netherlands-2023", "rsrl", "netherlands-2023 was a wet race and there is no wet-weather model"),
        ("bahrain-2023,atlantis-2023", "rsrl", "unknown race 'atlantis-2023'"),
        ("rsrl-2", "drqn", "drqn learns one race for one car"),
    ],
)
def test_unfit_races_are_told_in_one_line(capsys: Capture, tmp_path: Path, races: str, agent: str, message: str) -> None:
    assert main(["train", races, "--agent", agent, "--out", str(tmp_path / "run")]) == 2
    assert message in capsys.readouterr().err.splitlines()[-1]
    assert not (tmp_path / "run" / "model.json").exists()


def test_several_races_make_a_model_for_all_their_cars(capsys: Capture, tmp_path: Path) -> None:
    out = tmp_path / "run"
    races = "bahrain-2023,spain-2023"
    assert main(["train", races, "--features", "named", "--iterations", "1", "--seed", "3", "--out", str(out), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert (result["race"], result["driver"], result["iterations"]) == (races, "", 1)
    agent, about = load_agent(out)
    assert agent.feature_set == "named"
    assert agent.feature_names == input_names("named")
    assert (about.race, about.driver, about.seed) == (races, "", 3)
    assert about.trained_range["race_laps"] == [57.0, 66.0]
    assert about.trained_range["grid"] == [1.0, 20.0]
    for named, race in (([], "bahrain-2023"), (["--race", "spain-2023"], "spain-2023")):
        assert main(["evaluate", str(out), "--races", "8", "--strategists", "fixed", *named, "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["race"] == race


def test_a_run_is_resumed_for_the_race_and_car_it_is_of(capsys: Capture, tmp_path: Path) -> None:
    out = tmp_path / "run"
    assert main(["train", "bahrain-2023", "--agent", "dqn", "--iterations", "2", "--out", str(out)]) == 0
    model = json.loads((out / "model.json").read_text())
    (out / "model.json").write_text(json.dumps(model | {"finished": False, "budget": {"iterations": 100}}))
    capsys.readouterr()
    for arguments, message in (
        (["spain-2023"], "a run for HAM at bahrain-2023, not for HAM at spain-2023"),
        (["bahrain-2023", "--driver", "ALO"], "a run for HAM at bahrain-2023, not for ALO at bahrain-2023"),
        (["bahrain-2023", "--driver", "all"], "not for every car at bahrain-2023"),
    ):
        assert main(["train", *arguments, "--resume", "--out", str(out)]) == 2
        assert message in capsys.readouterr().err.splitlines()[-1]
    assert main(["train", "bahrain-2023", "--resume", "--out", str(out), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert (result["agent"], result["iterations"], result["finished"]) == ("dqn", 100, True)
    (out / "model.json").write_text(json.dumps(model | {"finished": False, "season_hash": "0" * 16}))
    assert main(["train", "bahrain-2023", "--resume", "--out", str(out)]) == 2
    assert "the figures of bahrain-2023 have changed since this run began" in capsys.readouterr().err.splitlines()[-1]


def test_a_trained_model_is_not_overwritten_unasked(capsys: Capture, tmp_path: Path) -> None:
    out = tmp_path / "run"
    out.mkdir()
    (out / "model.json").write_text("{}")
    assert main(["train", "bahrain-2023", "--iterations", "1", "--out", str(out)]) == 2
    assert (out / "model.json").read_text() == "{}"
    assert "--force" in capsys.readouterr().err


def test_demo_shows_the_leaderboard_of_all_on_the_same_races(capsys: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(demo, "QUICK_STRATEGISTS", "fixed,heuristic")
    out = tmp_path / "demo"
    assert main(["demo", "--pretrained", "--races", "64", "--out", str(out), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert {row["strategist"] for row in result["rows"]} == {"rsrl", "fixed", "heuristic"}
    assert (result["races"], result["seed"], result["training"]["pretrained"]) == (64, 7, True)
    assert {p.name for p in out.iterdir()} == {"evaluation.json", "explanation.json", "positions.png", "strategies.png"}
    why = json.loads((out / "explanation.json").read_text())
    assert (why["race"], why["lap"], why["decision"]["lap"]) == ("bahrain-2023", 10, 10)
    assert next(one["method"] for one in why["explanations"]) == "what-if"
    assert main(["report", str(out), "--json"]) == 0
    assert "what-if" in [section["id"] for section in json.loads(capsys.readouterr().out)["sections"]]


def test_demo_fits_two_screens_and_all_shows_the_rest(capsys: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(demo, "DEFAULT_STRATEGISTS", "fixed")  # a plan search takes half a minute
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["demo", "--pretrained", "--races", "64"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) <= 2 * SCREEN_LINES
    assert max(len(line) for line in lines if "picture" not in line) <= 80
    assert all(any(line.startswith(name) for line in lines) for name in ("rsrl <", "fixed", "heuristic", "dp"))
    told = next(i for i, line in enumerate(lines) if line.startswith("HAM at bahrain-2023, race"))
    picture = next(i for i, line in enumerate(lines) if line.startswith("Strategies driven, as a picture: "))
    assert sum(bool(line) for line in lines[told:picture]) <= EXPLAINED_LINES
    assert Path(lines[picture].removeprefix("Strategies driven, as a picture: ")).read_bytes().startswith(b"\x89PNG")
    assert sum("rsrl " in line for line in lines[picture + 1 :]) == 4
    assert main(["demo", "--pretrained", "--races", "64", "--all", "--out", str(tmp_path / "all")]) == 0
    text = capsys.readouterr().out
    assert "Most common strategies" in text
    assert "The policy's value of each call" in text
    assert str(tmp_path / "all" / "strategies.png") in text.replace("\n", "")


def test_bench_gives_every_figure(capsys: Capture) -> None:
    assert main(["bench", "--repeats", "1", "--train-seconds", "1", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    figures = [
        *(result["simulator"][k] for k in ("races_per_s", "races_per_s_one_thread")),
        result["environment"]["steps_per_s"],
        result["training"]["branches_per_s"],
        result["training"]["cores_used"],
        result["decision"]["ms"],
    ]
    assert all(figure > 0 for figure in figures)
