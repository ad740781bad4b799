"""What a command says: one result on standard output, as tables or as JSON; remarks on standard error."""

import json
import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from rich import box
from rich.console import Console, RenderableType
from rich.table import Table

WIDTH_IN_FILES: Final = 120
"""Columns of text where the output goes to a file or a pipe."""


class Output:
    """The voice of one command: `result` once, `note` as often as needed."""

    def __init__(self, as_json: bool) -> None:
        self.as_json = as_json

    def result(self, result: Mapping[str, Any], *tables: RenderableType) -> None:
        """Print the result: `result` as JSON alone where that was asked for, else the tables."""
        if self.as_json:
            print(json.dumps(plain(result), indent=2, allow_nan=False))
            return
        console = Console(highlight=False, width=None if sys.stdout.isatty() else WIDTH_IN_FILES)
        for table in tables:
            console.print(table)

    def note(self, text: str) -> None:
        """Tell the user something in passing, on standard error."""
        print(text, file=sys.stderr)


def table(title: str, columns: Sequence[str], rows: Iterable[Sequence[object]], left: int = 1) -> Table:
    """A plain table; the first `left` columns are words and aligned left, the others numbers and aligned right."""
    built = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
    for i, name in enumerate(columns):
        built.add_column(name, justify="left" if i < left else "right")
    for row in rows:
        built.add_row(*[str(cell) for cell in row])
    return built


def plain(value: Any) -> Any:
    """`value` in types JSON has: arrays become lists, paths become strings, what is not a number becomes null."""
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "tolist"):  # NumPy arrays and numbers, told without importing NumPy
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
