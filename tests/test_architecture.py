"""The shape of the code: who may import whom, how long modules and functions may be, and what must not be in any file."""

import ast
import graphlib
import re
import subprocess
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "rsrl"
MODULES = sorted(SOURCE.rglob("*.py"))
PACKAGES = sorted(p.parent.name for p in SOURCE.glob("*/__init__.py"))
MAX_LINES, MAX_FUNCTION_LINES, MAX_EQUAL_LINES = 400, 60, 5
FORBIDDEN_PAIRS = {("calibration", "simulator"), ("simulator", "calibration")}
RACE_KERNELS = {"advance", "advance_lap", "advance_batch", "classify", "draw_future"}
"""What it takes to drive a race: by name, wherever it is imported from."""

ROOT_ROWS = {"__init__": "api", "__main__": "cli"}
MAY_DRIVE = {"simulator", "environment", "rollouts"}


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


def row_of(module: Path) -> str:
    """The package whose row a module keeps to; "" for those at the root, which may import no package.

    The root's `__init__.py` shows what packages hold to type checkers, down to `api`; test_root_api.py sees that it imports none of them.
    `__main__.py` is the command line.
    """
    parts = module.relative_to(SOURCE).parts
    return parts[0] if len(parts) > 1 else ROOT_ROWS.get(module.stem, "")


@pytest.mark.parametrize("module", MODULES, ids=lambda p: str(p.relative_to(SOURCE)))
def test_imports_go_up_the_table(module: Path) -> None:
    package = row_of(module)
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


FACES = sorted(
    {*PACKAGES, *(str(p.parent.relative_to(SOURCE)) for p in SOURCE.glob("*/**/__init__.py") if "import" in p.read_text("utf-8"))}
)
"""Packages and those of their folders that others import as one, which is to say through `__init__.py`."""


@pytest.mark.parametrize("package", FACES)
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


def module_name(module: Path) -> str:
    """`rsrl.season.records` for its path; a package goes by its own name."""
    parts = module.relative_to(SOURCE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported_modules(node: ast.AST, known: Iterable[str]) -> Iterator[str]:
    """Modules of `known` that code imports when it runs, inside functions too; those for type checkers alone are left out."""
    if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
        return
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names if alias.name in known)
    elif isinstance(node, ast.ImportFrom):
        for alias in node.names:
            yield from [name for name in (f"{node.module}.{alias.name}", str(node.module)) if name in known][:1]
    for child in ast.iter_child_nodes(node):
        yield from imported_modules(child, known)


def import_circle(sources: Mapping[str, str]) -> list[str]:
    """Modules that import each other in a circle, given the source of each; empty where there is none."""
    graph = {name: set(imported_modules(ast.parse(source), sources)) - {name} for name, source in sources.items()}
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        return list(error.args[1])
    return []


def test_no_modules_import_each_other_in_a_circle() -> None:
    assert not import_circle({module_name(path): path.read_text(encoding="utf-8") for path in MODULES})


@pytest.mark.parametrize(
    ("back", "is_circle"),
    [
        ("from rsrl.a import f", True),
        ("def f():\n    from rsrl import a", True),
        ("if TYPE_CHECKING:\n    from rsrl.a import f", False),
        ("import numpy", False),
    ],
)
def test_a_circle_of_imports_is_noticed(back: str, is_circle: bool) -> None:
    assert bool(import_circle({"rsrl.a": "import rsrl.b", "rsrl.b": "from rsrl.c import x", "rsrl.c": back})) == is_circle


def imported_names(source: str) -> set[str]:
    """Names that a module imports from others."""
    return {alias.name for node in ast.walk(ast.parse(source)) if isinstance(node, ast.ImportFrom) for alias in node.names}


def test_rollouts_is_the_only_package_that_drives_on_from_a_state() -> None:
    """The simulator drives whole races, the environment a lap at a time; nobody else advances a race or draws a future of it."""
    drivers = {path for path in MODULES if imported_names(path.read_text(encoding="utf-8")) & RACE_KERNELS}
    packages = {path.relative_to(SOURCE).parts[0] for path in drivers}
    assert packages >= MAY_DRIVE, "one of these names no longer exists: this test would notice nothing"
    assert packages <= MAY_DRIVE, sorted(str(p.relative_to(SOURCE)) for p in drivers if p.relative_to(SOURCE).parts[0] not in MAY_DRIVE)


def comparable_lines(source: str) -> list[tuple[int, str]]:
    """Stripped lines by number that may not stand twice in a row: without blank lines, comments, imports and tables.

    A table is an assignment at the top of a module, or the annotated fields of a class: equal lists of fields or bounds are data.
    """
    tree = ast.parse(source)
    left_out: list[ast.stmt] = [node for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom)]
    left_out += [node for node in tree.body if isinstance(node, ast.Assign | ast.AnnAssign)]
    left_out += [field for node in tree.body if isinstance(node, ast.ClassDef) for field in node.body if isinstance(field, ast.AnnAssign)]
    skipped = {line for node in left_out for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)}
    lines = ((number, line.strip()) for number, line in enumerate(source.splitlines(), 1) if number not in skipped)
    return [(number, line) for number, line in lines if line and not line.startswith("#")]


def repeated_blocks(sources: Mapping[str, str], most: int = MAX_EQUAL_LINES) -> list[str]:
    """Where more than `most` lines in a row are equal to others: `file:line and file:line`, each pair of places once."""
    seen: dict[tuple[str, ...], tuple[str, int]] = {}
    found: list[str] = []
    before = ("", 0, "", 0)
    for name, source in sources.items():
        lines = comparable_lines(source)
        for i in range(len(lines) - most):
            block = tuple(text for _, text in lines[i : i + most + 1])
            first = seen.setdefault(block, (name, i))
            if first != (name, i):
                if before != (first[0], first[1] - 1, name, i - 1):  # else the block found last goes on
                    found.append(f"{first[0]}:{comparable_lines(sources[first[0]])[first[1]][0]} and {name}:{lines[i][0]}")
                before = (*first, name, i)
    return found


def test_no_block_of_six_lines_stands_twice() -> None:
    assert not repeated_blocks({str(path.relative_to(SOURCE)): path.read_text(encoding="utf-8") for path in MODULES})


def test_a_repeated_block_is_noticed_and_a_table_is_none() -> None:
    code = "".join(f"    x = f(x, {i})\n" for i in range(6))
    twice = {"one.py": f"def a(x):\n{code}", "two.py": f"import os\n\n# other\ndef b(x):\n    # as above\n{code}    return x\n"}
    assert repeated_blocks(twice) == ["one.py:2 and two.py:6"]
    assert not repeated_blocks(twice, most=6)
    assert repeated_blocks({"one.py": f"def a(x):\n{code}def b(x):\n{code}"}) == ["one.py:2 and one.py:9"]
    table = "TABLE = {\n" + "".join(f"    {i}: {i},\n" for i in range(9)) + "}\n"
    fields = "class C:\n" + "".join(f"    field_{i}: int\n" for i in range(9))
    assert not repeated_blocks({"one.py": table + fields, "two.py": table + fields})


@pytest.mark.parametrize("module", MODULES, ids=lambda p: str(p.relative_to(SOURCE)))
def test_functions_are_short(module: Path) -> None:
    functions = (n for n in ast.walk(ast.parse(module.read_text(encoding="utf-8"))) if isinstance(n, ast.FunctionDef))
    lengths = {function.name: (function.end_lineno or 0) - function.lineno + 1 for function in functions}
    assert not {name: lines for name, lines in lengths.items() if lines > MAX_FUNCTION_LINES}


@pytest.mark.parametrize(
    ("pattern", "home"),
    [
        (r"\b1\.96\b|\b1\.9599|\.ppf\(", "statistics"),
        (r"\"#(?!f{6}\")[0-9a-fA-F]{6}\"", "drawing"),
    ],
    ids=["intervals", "colours"],
)
def test_intervals_and_colours_have_one_home(pattern: str, home: str) -> None:
    found = [
        f"{module.relative_to(SOURCE)}:{number}"
        for module in MODULES
        if home not in module.relative_to(SOURCE).parts
        for number, line in enumerate(module.read_text(encoding="utf-8").splitlines(), 1)
        if re.search(pattern, line)
    ]
    assert not found, f"belongs in rsrl.{home}"


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
