"""What the package declares about its surroundings is true, as far as can be told without installing it again."""

import ast
import re
import tomllib

import pytest
from docs_pages import ROOT, benchmark

lower_bounds = benchmark("lowest").lower_bounds
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
PINS = dict(re.findall(r"^([\w.-]+)==([\w.]+)$", (ROOT / "requirements.txt").read_text(encoding="utf-8"), flags=re.MULTILINE))


def numbers(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", version))


def every_requirement() -> list[str]:
    return [*PROJECT["dependencies"], *(line for extra in PROJECT["optional-dependencies"].values() for line in extra)]


def test_each_dependency_has_a_lower_bound() -> None:
    assert {re.split(r"[^\w.-]", line)[0] for line in PROJECT["dependencies"]} <= set(lower_bounds())


@pytest.mark.parametrize("requirement", every_requirement())
def test_each_pin_lies_within_its_bound(requirement: str) -> None:
    name, _, bound = requirement.partition(">=")
    if bound:
        assert numbers(PINS[name]) >= numbers(bound)
    else:
        assert re.split(r"\W", name)[0] in PINS, "an extra of a package that is pinned"


def test_every_declared_python_is_allowed_and_the_lowest_is_the_one_tools_check_for() -> None:
    declared = [numbers(line) for line in PROJECT["classifiers"] if line.startswith("Programming Language :: Python :: 3.")]
    assert declared == [(3, 11), (3, 12), (3, 13)]
    assert numbers(PROJECT["requires-python"]) == declared[0]
    tools = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
    assert numbers(tools["mypy"]["python_version"]) == declared[0]
    assert tools["ruff"]["target-version"] == "py311"


def test_no_message_points_to_a_file_that_is_not_installed() -> None:
    """Documentation is no part of a wheel; docstrings and comments are for readers of the repository."""
    for module in (ROOT / "src" / "rsrl").rglob("*.py"):
        tree = ast.parse(module.read_text(encoding="utf-8"))
        bare = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        texts = [node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and id(node) not in bare]
        assert not [text for text in texts if isinstance(text, str) and "docs/" in text], module
