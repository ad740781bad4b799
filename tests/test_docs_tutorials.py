"""Code in README, tutorials and how-to guides runs as it stands."""

import re
import shlex
from pathlib import Path

import pytest
from docs_pages import BLOCK, ROOT, code_of, name_of

from rsrl.cli import main

README = ROOT / "README.md"
RUN = [
    README,
    *(p for folder in ("tutorials", "how-to", "explanations") for p in sorted((ROOT / "docs" / folder).glob("*.md"))),
]
RUN = [page for page in RUN if code_of(page, "python") or code_of(page, "sh")]


@pytest.mark.slow
@pytest.mark.parametrize("page", RUN, ids=name_of)
def test_code_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks of a page in order: Python in one namespace, commands of `rsrl` in one folder."""
    monkeypatch.chdir(tmp_path)
    namespace: dict[str, object] = {"__name__": "__main__"}
    for language, code in BLOCK.findall(page.read_text(encoding="utf-8")):
        if language == "python":
            exec(compile(code, str(page), "exec"), namespace)
        elif language == "sh":
            for line in code.splitlines():
                assert line.startswith("rsrl ")
                assert main(shlex.split(line)[1:]) == 0, line


@pytest.mark.slow
def test_the_explanation_in_the_readme_is_what_the_command_says(capsys: pytest.CaptureFixture[str]) -> None:
    shown = next(code for code in code_of(README, "") if code.startswith("$ rsrl explain"))
    command, *lines = shown.splitlines()
    assert len(lines) <= 8
    assert main(shlex.split(command)[2:]) == 0
    said = re.sub(r"\s+", " ", capsys.readouterr().out)
    for line in lines:
        assert line in said
