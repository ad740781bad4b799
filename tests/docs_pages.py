"""README and the pages of docs, as tests read them."""

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).parents[1]
PAGES = [
    *sorted(p for p in (ROOT / "docs").rglob("*.md") if not {"_build", "packages"} & set(p.parts)),
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")),
]
BLOCK = re.compile(r"^```([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def name_of(page: Path) -> str:
    """A page's path, as the id of a test."""
    return str(page.relative_to(ROOT))


def text_of(page: Path) -> str:
    """What a page says, without its code blocks."""
    return BLOCK.sub("", page.read_text(encoding="utf-8"))


def code_of(page: Path, language: str) -> list[str]:
    """Code blocks of a language, in order."""
    return [code for found, code in BLOCK.findall(page.read_text(encoding="utf-8")) if found == language]


def benchmark(name: str) -> ModuleType:
    """A script of benchmarks, imported; it finds its neighbours as when it is run."""
    folder = str(ROOT / "benchmarks")
    if folder not in sys.path:
        sys.path.append(folder)
    spec = importlib.util.spec_from_file_location(name, ROOT / "benchmarks" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
