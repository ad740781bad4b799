"""Output of a command: one result on standard output, as tables or as JSON; notes on standard error."""

import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

from rich import box
from rich.console import Console, RenderableType
from rich.table import Table

from rsrl.cli.provenance import assumptions
from rsrl.results import Result, to_json

WIDTH_IN_FILES: Final = 120
"""Columns of text where the output goes to a file or a pipe."""


class Output:
    """Output of one command: `result` once, `note` as often as needed."""

    def __init__(self, as_json: bool) -> None:
        self.as_json = as_json

    def result(self, result: Result | Mapping[str, Any], *tables: RenderableType) -> None:
        """Print the result: as JSON alone where that was asked for, else as tables."""
        if self.as_json:
            print(to_json(result), end="")
            return
        if assumptions():
            print(f"Assumed: {', '.join(assumptions())}")
        console = Console(highlight=False, width=None if sys.stdout.isatty() else WIDTH_IN_FILES)
        for table in tables:
            console.print(table)

    def note(self, text: str) -> None:
        """Print a note on standard error."""
        print(text, file=sys.stderr)


def table(title: str, columns: Sequence[str], rows: Iterable[Sequence[object]], left: int = 1) -> Table:
    """A plain table; the first `left` columns are words and aligned left, the others numbers and aligned right."""
    built = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
    for i, name in enumerate(columns):
        built.add_column(name, justify="left" if i < left else "right")
    for row in rows:
        built.add_row(*[str(cell) for cell in row])
    return built
