"""The shape of the code: who may import whom, how long a module may be, and what must not be in any file."""

import ast
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "rsrl"
MODULES = sorted(SOURCE.rglob("*.py"))
PACKAGES = sorted(p.parent.name for p in SOURCE.glob("*/__init__.py"))
MAX_LINES = 400
FORBIDDEN_PAIRS = {("calibration", "simulator"), ("simulator", "calibration")}


def package_order() -> list[str]:
    """Packages from top to bottom of the table in docs/architecture.md."""
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    return re.findall(r"^\| `(\w+)` \|", text, flags=re.MULTILINE)


def imported_packages(source: str) -> Iterator[tuple[int, str]]:
    """Line and package under rsrl of each import in `source`, those inside functions included; "" is rsrl itself."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, f"line {node.lineno}: relative import; write the full name"
            names = [f"{node.module}.{alias.name}" for alias in node.names] if node.module == "rsrl" else [str(node.module)]
        else:
            continue
        for name in names:
            first, _, rest = name.partition(".")
            if first == "rsrl":
                yield node.lineno, rest.partition(".")[0]


def broken_rules(package: str, source: str, order: list[str]) -> list[str]:
    """Imports of `source`, a module of `package` ("" for the root), that go down the table."""
    row = order.index(package) if package else -1
    complaints = []
    for line, other in imported_packages(source):
        if other in order and order.index(other) > row:
            complaints.append(f"line {line}: {package or 'root'} imports {other}, which stands below it")
        elif (package, other) in FORBIDDEN_PAIRS:
            complaints.append(f"line {line}: {package} must not know {other}")
    return complaints


def tracked_files() -> list[Path]:
    """Text files under version control; every file of the project where there is no git."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=False)
    if listed.returncode == 0 and listed.stdout:
        paths = [ROOT / name.decode() for name in listed.stdout.split(b"\0") if name]
    else:
        paths = [p for folder in ("src", "tests", "docs", "benchmarks") for p in (ROOT / folder).rglob("*")]
    return [p for p in paths if p.is_file() and b"\0" not in p.read_bytes()[:1024]]


def test_order_is_the_table_of_the_document() -> None:
    order = package_order()
    assert order[:5] == ["statistics", "results", "laps", "season", "calibration"]
    assert order[-1] == "cli"
    assert set(PACKAGES) <= set(order), "a package is missing in the table of docs/architecture.md"


@pytest.mark.parametrize("module", MODULES, ids=lambda p: str(p.relative_to(SOURCE)))
def test_imports_go_up_the_table(module: Path) -> None:
    parts = module.relative_to(SOURCE).parts
    package = parts[0] if len(parts) > 1 else ""
    assert not broken_rules(package, module.read_text(encoding="utf-8"), package_order())


@pytest.mark.parametrize(
    "source",
    ["import rsrl.cli", "from rsrl.agents import train", "from rsrl import environment", "def f():\n    import rsrl.evaluation.paired"],
)
def test_an_import_down_the_table_is_noticed(source: str) -> None:
    assert broken_rules("simulator", source, package_order())


def test_calibration_and_simulator_must_not_know_each_other() -> None:
    order = package_order()
    assert broken_rules("simulator", "from rsrl.calibration import calibrate_race", order)
    assert broken_rules("calibration", "from rsrl.simulator import simulate", order)


def test_an_import_up_the_table_is_allowed() -> None:
    assert not broken_rules("simulator", "import numpy\nfrom rsrl.errors import RsrlError\nfrom rsrl.season import Figure", package_order())


@pytest.mark.parametrize("package", PACKAGES)
def test_each_package_lists_its_public_names(package: str) -> None:
    tree = ast.parse((SOURCE / package / "__init__.py").read_text(encoding="utf-8"))
    lists = [n.value for n in tree.body if isinstance(n, ast.Assign) and ast.unparse(n.targets[0]) == "__all__"]
    assert len(lists) == 1
    names = ast.literal_eval(lists[0])
    assert len(set(names)) == len(names) > 0
    bound = {alias.asname or alias.name for n in tree.body if isinstance(n, ast.ImportFrom) for alias in n.names}
    bound |= {n.name for n in tree.body if isinstance(n, ast.FunctionDef | ast.ClassDef)}
    bound |= {t.id for n in tree.body if isinstance(n, ast.Assign) for t in n.targets if isinstance(t, ast.Name)}
    assert set(names) <= bound


@pytest.mark.parametrize("module", MODULES, ids=lambda p: str(p.relative_to(SOURCE)))
def test_modules_are_short_and_documented(module: Path) -> None:
    text = module.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= MAX_LINES
    assert ast.get_docstring(ast.parse(text))


# Written in two halves, so that this file does not hold what it looks for.
@pytest.mark.parametrize(
    "pattern",
    [
        "py" + r"pi\.(org|python)",
        "python" + r"hosted\.org",
        "--(extra-)?index" + r"-url[ =]",
        r"(?<![\w.~])/" + r"(work|home|root|Users)/\w",
    ],
)
def test_no_file_names_a_package_index_or_a_path_of_one_machine(pattern: str) -> None:
    found = [
        f"{path.relative_to(ROOT)}:{number}"
        for path in tracked_files()
        for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), 1)
        if re.search(pattern, line)
    ]
    assert not found
