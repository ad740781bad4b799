"""Output of a command: one result on standard output, as tables or as JSON; notes on standard error."""

import shutil
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

from rich.console import Console
from rich.text import Text

from rsrl.cli.fitted_table import Column, FittedTable
from rsrl.cli.provenance import assumptions
from rsrl.plain_signs import plain_signs
from rsrl.results import Result, to_json
from rsrl.standard_error import tell

__all__ = ["Column", "FittedTable", "Output", "Shown", "table"]

WIDTH_IN_FILES: Final = 120
"""Columns of text where the output goes to a file or a pipe and the environment does not set COLUMNS."""

Shown = FittedTable | Text | str
"""What a command prints: tables and lines of text; a `Text` that is not to be wrapped, such as a path to copy, stays on its line."""


class Output:
    """Output of one command: `result` once, `note` as often as needed.

    Args:
        as_json: print JSON instead of tables.
        wide: print every column of every table, however wide the terminal is.
    """

    def __init__(self, as_json: bool, wide: bool = False) -> None:
        self.as_json, self.wide = as_json, wide

    def result(self, result: Result | Mapping[str, Any], *shown: Shown) -> None:
        """Print the result: as JSON alone where that was asked for, else as tables and lines."""
        if self.as_json:
            print(to_json(result), end="")
            return
        console = Console(highlight=False, emoji=False, width=self._width(shown))
        if assumptions():
            console.print(_line(f"Assumed: {', '.join(assumptions())}", console.encoding))
        for one in shown:
            if isinstance(one, FittedTable):
                console.print(one)
            else:
                console.print(_line(one, console.encoding), soft_wrap=isinstance(one, Text) and bool(one.no_wrap))

    def note(self, text: str) -> None:
        """Print a note on standard error; where that is closed or full, the note is lost and the result is not."""
        tell(text)

    def _width(self, shown: Sequence[Shown]) -> int:
        width = shutil.get_terminal_size((WIDTH_IN_FILES, 24)).columns
        return max([width, *(one.natural_width() for one in shown if isinstance(one, FittedTable))]) if self.wide else width


def table(
    title: str, columns: Sequence[str | Column], rows: Iterable[Sequence[object]], left: int = 1, captions: Sequence[str] = ()
) -> FittedTable:
    """A table; the first `left` columns are words and aligned left, the others numbers and aligned right."""
    return FittedTable(title, columns, rows, left, captions)


def _line(line: str | Text, encoding: str) -> Text:
    """A line of text, with its style where it has one."""
    text, style = (line.plain, line.style) if isinstance(line, Text) else (line, "")
    return Text(plain_signs(text, encoding), style=style, overflow="fold")
