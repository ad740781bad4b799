"""`rsrl study robustness`: its result, its table and what it refuses."""

import json
from pathlib import Path

import pytest
from test_cli_evaluate import untrained

from rsrl.agents import ModelMetadata, save_run
from rsrl.cli.study_robustness import command
from rsrl.errors import RsrlError

Capture = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("runs") / "x"
    save_run(folder, untrained(), ModelMetadata(race="bahrain-2023", driver="HAM", seed=4))
    return str(folder)


def test_result_and_table(capsys: Capture, run: str, tmp_path: Path) -> None:
    command(run, races=8, draws=2, scales="0,1.5", rivals="plans,itself", strategists="fixed,heuristic", out=tmp_path, json=True)
    result = json.loads(capsys.readouterr().out)
    assert (result["race"], result["driver"], result["plan"]["scales"]) == ("bahrain-2023", "HAM", [0, 1.5])
    assert [(row["rivals"], row["scale"], row["races"]) for row in result["rows"]] == [
        ("plans", 0, 8), ("plans", 1.5, 8), ("itself", 0, 8), ("itself", 1.5, 8),
    ]  # fmt: skip
    assert [other["strategist"] for other in result["rows"][0]["against"]] == ["fixed", "heuristic"]
    assert json.loads((tmp_path / "robustness.json").read_text())["rows"] == result["rows"]
    with pytest.raises(RsrlError, match="already exists"):
        command(run, out=tmp_path)
    command(run, races=8, draws=2, scales="0", rivals="plans", strategists="heuristic")
    assert "other rivals, and figures off by their errors times a scale" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"scales": "one"}, "--scales 'one' does not parse"),
        ({"scales": "-1"}, "a scale lies between 0 and 10"),
        ({"rivals": "robots"}, "unknown rivals 'robots'"),
        ({"strategists": "oracle"}, "unknown strategist 'oracle'"),
    ],
)
def test_what_cannot_be_run_is_refused(run: str, options: dict[str, str], message: str) -> None:
    with pytest.raises(RsrlError, match=message):
        command(run, **options)  # type: ignore[arg-type]
