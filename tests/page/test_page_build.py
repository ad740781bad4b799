"""The committed page is what its sources build, its types are those of the schema, and it is as small as promised."""

import gzip
import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE, ASSETS = ROOT / "page", ROOT / "src/rsrl/wall/assets"


def run(*command: str, where: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, cwd=where, capture_output=True, text=True, env=os.environ | {"CI": "1"}, check=False)


def test_javascript_is_within_its_budget_and_nothing_is_inline() -> None:
    script = (ASSETS / "wall.js").read_bytes()
    assert sorted(path.name for path in ASSETS.iterdir()) == ["favicon.svg", "index.html", "wall.css", "wall.js"]
    assert len(script) <= 180_000
    assert len(gzip.compress(script)) <= 65_000
    html = (ASSETS / "index.html").read_text(encoding="utf-8")
    assert "style=" not in html
    assert "<style" not in html
    assert html.count("<script") == html.count('<script type="module" crossorigin src=') == 1


@pytest.mark.slow
def test_rebuilding_the_page_gives_the_committed_files(tmp_path: Path) -> None:
    if not (shutil.which("node") and shutil.which("npm")):
        pytest.skip("no Node: node and npm are absent")
    copy = tmp_path / "page"
    shutil.copytree(PAGE, copy, ignore=shutil.ignore_patterns("node_modules"))
    (tmp_path / "src/rsrl/wall").mkdir(parents=True)
    shutil.copy(ROOT / "src/rsrl/wall/schema.json", tmp_path / "src/rsrl/wall/schema.json")
    installed = run("npm", "ci", "--prefer-offline", where=copy)
    if installed.returncode:
        pytest.skip("no packages of the page: " + (installed.stderr.strip().splitlines() or ["npm ci failed"])[0])
    types = run("node", "types.mjs", "--check", where=copy)
    assert types.returncode == 0, types.stderr
    checked = run("npm", "run", "check", where=copy)
    assert checked.returncode == 0, checked.stdout
    built = run("npm", "run", "build", where=copy)
    assert built.returncode == 0, built.stderr
    made = tmp_path / "src/rsrl/wall/assets"
    assert {path.name: path.read_bytes() for path in made.iterdir()} == {path.name: path.read_bytes() for path in ASSETS.iterdir()}
