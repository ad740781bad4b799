"""Links and paths that documents name are there; what must be listed is listed."""

import re
from pathlib import Path

import pytest
from docs_pages import PAGES, ROOT, name_of, text_of

from rsrl import __version__
from rsrl.cli.app import COMMANDS

LINK = re.compile(r"\[[^]]*\]\(([^)\s]+)\)")
PATH = re.compile(r"`([\w./-]+(?:/|\.(?:py|sh|md|toml|json)))`")
PLACES = (ROOT, ROOT / "src" / "rsrl", ROOT / "tests", ROOT / "benchmarks")
MADE_BY_USERS = re.compile(
    r"^(runs/|my-|state\.json|explanation\.json|generalise\.json|robustness\.json|evaluation\.json|study\.json|table3\.md|model\.json|DIR/)"
)


def anchors(page: Path) -> set[str]:
    """Names a link may have after `#`: headings as GitHub and MyST write them, and labels."""
    text = page.read_text(encoding="utf-8")
    headings = re.findall(r"^#+ (.*)$", text, flags=re.MULTILINE)
    slugs = {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}
    return slugs | set(re.findall(r"^\(([\w-]+)\)=$", text, flags=re.MULTILINE))


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_lead_somewhere(page: Path) -> None:
    for link in LINK.findall(text_of(page)):
        if link.startswith(("http://", "https://")):
            continue
        target, _, anchor = link.partition("#")
        there = (page.parent / target).resolve() if target else page
        assert there.exists(), link
        if anchor:
            assert anchor in anchors(there), link


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_paths_that_are_named_exist(page: Path) -> None:
    named = [path for path in PATH.findall(text_of(page)) if not MADE_BY_USERS.match(path)]
    missing = [path for path in named if not any((place / path).exists() for place in PLACES)]
    assert not missing


def test_the_map_of_the_house_names_every_package_in_order() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    order = re.findall(r"^\| `(\w+)` \|", (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert re.findall(r"^- `(\w+)/`", text, flags=re.MULTILINE) == order


def test_ten_common_changes_are_told() -> None:
    table = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").partition("## Where do I change")[2]
    rows = [line for line in table.splitlines() if line.startswith("|")][2:]
    assert len(rows) >= 10
    assert all("`" in row for row in rows)


def test_every_command_is_in_the_reference() -> None:
    text = (ROOT / "docs" / "reference" / "command-line.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^\| `rsrl (\w+)", text, flags=re.MULTILINE)) == set(COMMANDS)


def test_the_release_is_in_the_changelog_and_the_citation() -> None:
    assert f"\n## [{__version__}] - 20" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"\nversion: {__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
