"""Numbers of README and docs come from result files, and result files from the commands of remake.sh."""

import json
import re
import shlex
from pathlib import Path

import pytest
from docs_pages import ROOT, benchmark, name_of, text_of

tables = benchmark("tables")
README, RESULTS_PAGE, REALISM_PAGE = ROOT / "README.md", ROOT / "docs" / "results.md", ROOT / "docs" / "realism.md"
RESULT_FILES = sorted(p.relative_to(ROOT) for p in (ROOT / "benchmarks" / "results").rglob("*") if p.is_file())
SCRIPTS = "\n".join((ROOT / "benchmarks" / name).read_text(encoding="utf-8") for name in ("remake.sh", "backtest.sh"))
README_WORDS, README_ROWS, README_COLUMNS = 700, 7, 4


def table_rows(text: str) -> list[list[str]]:
    """Tables of a page, each as its lines."""
    return [match.splitlines() for match in re.findall(r"(?:^\|.*\|\n)+", text, flags=re.MULTILINE)]


@pytest.mark.parametrize("page", tables.documents(), ids=name_of)
def test_tables_are_as_generated(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert tables.filled(text) == text, "run: python benchmarks/tables.py"


def test_a_number_changed_by_hand_is_noticed() -> None:
    text = README.read_text(encoding="utf-8")
    changed = text.replace("| 5.64 |", "| 5.54 |")
    assert changed != text
    assert tables.filled(changed) != changed


@pytest.mark.parametrize("page", [README, RESULTS_PAGE], ids=name_of)
def test_every_table_is_generated(page: Path) -> None:
    outside = tables.BLOCK.sub("", page.read_text(encoding="utf-8"))
    assert not table_rows(outside)


def test_each_table_is_used_once() -> None:
    names = [match[2] for page in tables.documents() for match in tables.BLOCK.finditer(page.read_text(encoding="utf-8"))]
    assert sorted(names) == sorted(tables.TABLES)


def test_numbers_in_the_prose_of_the_readme_stand_in_a_table() -> None:
    prose = text_of(README)
    prose = tables.BLOCK.sub("", re.sub(r"doi:\S+|\d+\.\d+ or later", "", prose))
    decimals = set(re.findall(r"\d+\.\d+", prose))
    listed = "".join(page.read_text(encoding="utf-8") for page in (RESULTS_PAGE, REALISM_PAGE))
    made = "".join(match[0] for match in tables.BLOCK.finditer(listed))
    assert decimals
    assert not [number for number in decimals if not re.search(rf"(?<![\d.]){re.escape(number)}(?!\d)", made)]


def test_the_readme_is_short() -> None:
    text = README.read_text(encoding="utf-8")
    assert len(text.split()) <= README_WORDS
    for lines in table_rows(text):
        assert len(lines) - 2 <= README_ROWS
        assert all(line.count("|") - 1 <= README_COLUMNS for line in lines)


def command_words(line: str) -> list[str]:
    """A command's words, less where it writes to and what does not change the result."""
    words, skip = [], False
    for word in shlex.split(line):
        if skip or word in ("--out", "--laps", "--facts"):
            skip = not skip
        elif word not in ("--json", "--force"):
            words.append(word)
    return words


def without_search(words: list[str]) -> list[str]:
    """`words` with no strategist `search`: older files also ran a former one, whose rows are left out of every table."""
    return [",".join(one for one in word.split(",") if one != "search") for word in words]


WRITERS = {"season-2023.json": "season_table.py", "rivals.json": "rivals.py", "engine-ratio.json": "engine_ratio.py",
           "worth-of-thinking.json": "worth_of_thinking.py", "passes.json": "passes.py", "own-race-plans.json": "own_race_plans.py",
           "published-plans.json": "published_plans.py", "late-laps.json": "late_laps.py",
           "illustrations.json": "illustrations.py", "paper-agents-curves.json": "paper_agent_curves.py"}  # fmt: skip
"""Scripts that know where their result file lies."""


@pytest.mark.parametrize("path", RESULT_FILES, ids=str)
def test_each_result_file_is_made_by_a_command_of_remake(path: Path) -> None:
    assert any(WRITERS.get(path.name, path.name) in line for line in commands())


@pytest.mark.parametrize("path", [p for p in RESULT_FILES if p.suffix == ".json"], ids=str)
def test_the_command_a_result_file_names_stands_in_remake(path: Path) -> None:
    command = json.loads((ROOT / path).read_text(encoding="utf-8"))["provenance"]["command"]
    assert any(same_command(command, line) for line in commands()), command


LOOPS = {"$mode": ("forecast", "replay", "hindsight"), "$part": ("traffic", "safety-cars", "wear"), "$agent": ("dqn", "drqn")}


def commands() -> list[str]:
    """Lines of the scripts, continuation lines joined and loops written out."""
    seeds = re.search(r"^seeds=(\S+)$", SCRIPTS, re.MULTILINE)
    assert seeds is not None
    lines = SCRIPTS.replace("\\\n", " ").replace("$seeds", seeds[1]).splitlines()
    for name, values in LOOPS.items():
        lines = [line.replace(name, value) for line in lines for value in (values if name in line else ("",))]
    return lines


def same_command(command: str, line: str) -> bool:
    """Whether a line of a script runs a command: the same words, or the same script of benchmarks."""
    begin = re.search(r"(rsrl|python) ", line)
    if begin is None:
        return False
    typed = re.split(r"[>&]", line[begin.start() :])[0]
    if command.startswith("python"):
        return command.split()[1] in typed.split()
    return without_search(command_words(command)) == without_search(command_words(typed))
