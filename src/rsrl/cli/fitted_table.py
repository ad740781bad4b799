"""A table that fits the width it is printed at.

Heads are wrapped first, then cells of words. Where that is not enough, columns are left out, those of the highest priority number first,
and a line below says which. Nothing is ever cut to an ellipsis: in the last resort a cell goes on in the next line.
"""

import textwrap
from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

from rich import box
from rich.console import Console, ConsoleOptions, RenderResult
from rich.table import Table
from rich.text import Text

from rsrl.plain_signs import has_signs, plain_signs

GAP: Final = 2
"""Characters between two columns."""

LEAST_WORDS: Final = 14
LONGEST_WORD: Final = 30
"""A column of words is no narrower than the first, or than its longest word up to the second; longer words, such as paths, are folded."""

RULED: Final = box.Box("    \n    \n ── \n    \n    \n    \n    \n    \n")
RULED_PLAIN: Final = box.Box("    \n    \n -- \n    \n    \n    \n    \n    \n", ascii=True)
"""A line below the heads and nothing else; the second where the stream has no box characters."""


class Column(NamedTuple):
    """A column of a table.

    Attributes:
        head: wrapped between words where it is wider than its cells.
        priority: 0 for a column that is always shown; of the others, those with the highest number are left out first.
        words: the cells are text, aligned left and wrapped between words.
    """

    head: str
    priority: int = 0
    words: bool = False


class FittedTable:
    """A table as rich prints it: title, heads, rows, captions, and what was left out.

    Args:
        rows: cells; what is not a `Text`, which has a style, is printed as it is, brackets and all.
        left: number of first columns that are aligned left; the others hold numbers and are aligned right.
        captions: lines below the table.
    """

    def __init__(
        self, title: str, columns: Sequence[str | Column], rows: Iterable[Sequence[object]], left: int = 1, captions: Sequence[str] = ()
    ) -> None:
        self.title, self.left, self.captions = title, left, list(captions)
        self.columns = [one if isinstance(one, Column) else Column(one) for one in columns]
        self.rows = [[cell if isinstance(cell, Text) else Text(str(cell)) for cell in row] for row in rows]

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        encoding = options.encoding
        cells = [[_with_signs_of(encoding, cell) for cell in row] for row in self.rows]
        shown, widths = self._fit(cells, options.max_width)
        yield Text(plain_signs(self.title, encoding), style="bold", overflow="fold")
        yield self._built(cells, shown, widths, encoding)
        names = [name for i, column in enumerate(self.columns) if i not in shown and (name := column.head)]
        missing = [f"Left out at this width: {', '.join(dict.fromkeys(names))}; --wide shows every column"] if names else []
        for line in (*self.captions, *missing):
            yield Text(plain_signs(line, encoding), style="italic dim", overflow="fold")
        yield Text("")

    def natural_width(self) -> int:
        """Width at which no column is left out and no cell is wrapped."""
        return _total([self._natural(self.rows, i) for i in range(len(self.columns))])

    def _fit(self, cells: list[list[Text]], width: int) -> tuple[list[int], list[int]]:
        """Indices of the columns shown at a width, and the width of each."""
        shown = list(range(len(self.columns)))
        least = [self._least(cells, i) for i in shown]
        while _total([least[i] for i in shown]) > width:
            i = max(shown, key=lambda i: (self.columns[i].priority, i))
            if not self.columns[i].priority:
                break
            shown.remove(i)
        widths = [self._natural(cells, i) for i in shown]
        bare = [_widest(cells, i) for i in shown]
        for floors in ([max(a, least[i]) for a, i in zip(bare, shown, strict=True)], [least[i] for i in shown], [1] * len(shown)):
            while _total(widths) > width and any(a > floor for a, floor in zip(widths, floors, strict=True)):
                widest = max((i for i in range(len(shown)) if widths[i] > floors[i]), key=lambda i: widths[i])
                widths[widest] -= 1
        return shown, widths

    def _natural(self, cells: list[list[Text]], i: int) -> int:
        return max(len(self.columns[i].head), _widest(cells, i), 1)

    def _least(self, cells: list[list[Text]], i: int) -> int:
        """The narrowest that column `i` reads well: a word of its head, and a whole number or name, or a few words of text."""
        head = max((len(word) for word in self.columns[i].head.split()), default=1)
        widest = _widest(cells, i)
        if not self.columns[i].words:
            return max(head, widest)
        longest = max((len(word) for row in cells for word in row[i].plain.split()), default=1)
        return max(head, min(widest, max(LEAST_WORDS, min(longest, LONGEST_WORD))))

    def _built(self, cells: list[list[Text]], shown: list[int], widths: list[int], encoding: str) -> Table:
        built = Table(box=RULED if has_signs(encoding, "─") else RULED_PLAIN, show_edge=False, pad_edge=False, padding=(0, GAP - 1, 0, 0))
        heads = [textwrap.wrap(plain_signs(self.columns[i].head, encoding), width) or [""] for i, width in zip(shown, widths, strict=True)]
        tallest = max(len(lines) for lines in heads)
        for i, width, lines in zip(shown, widths, heads, strict=True):
            left = i < self.left or self.columns[i].words
            head = Text("\n".join([""] * (tallest - len(lines)) + lines))
            built.add_column(head, justify="left" if left else "right", width=width, overflow="fold")
        for row in cells:
            built.add_row(*(row[i] for i in shown))
        return built


def _with_signs_of(encoding: str, cell: Text) -> Text:
    """A cell with plain signs for those that the encoding lacks, each part in its style."""
    if has_signs(encoding, cell.plain):
        return cell
    edges = sorted({edge for span in cell.spans for edge in (span.start, span.end)})
    parts = cell.divide(edges)
    return Text.assemble(*((plain_signs(part.plain, encoding), part.spans[-1].style if part.spans else cell.style) for part in parts))


def _widest(cells: list[list[Text]], i: int) -> int:
    """Widest line of the cells of a column."""
    return max((line.cell_len for row in cells for line in row[i].split("\n", allow_blank=True)), default=0)


def _total(widths: Sequence[int]) -> int:
    return sum(widths) + GAP * max(len(widths) - 1, 0)
