"""Every example runs; the one that needs Stable-Baselines3 has its own test, which is skipped where that is absent."""

import runpy
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[1] / "examples").glob("*.py"))
OWN = [path for path in EXAMPLES if not path.name.startswith("stable_baselines3")]
MAX_LINES = 60


def test_there_are_five() -> None:
    assert len(OWN) >= 5


@pytest.mark.parametrize("path", OWN, ids=lambda path: path.name)
def test_an_example_is_short(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= MAX_LINES


@pytest.mark.slow
@pytest.mark.parametrize("path", OWN, ids=lambda path: path.name)
def test_an_example_runs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(path), run_name="__main__")
    assert capsys.readouterr().out.count("\n") >= 2
    assert not list(tmp_path.iterdir())
