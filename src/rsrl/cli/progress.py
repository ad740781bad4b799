"""Progress of long work: a bar on standard error for a person at a terminal, else one line."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rsrl.cli.output import Output

Report = Callable[[int, int], None]
"""Called by the work as `report(done, total)`."""


@contextmanager
def progress(output: Output, label: str) -> Iterator[Report]:
    """Show how far the work is, while the block runs. The bar goes away at its end."""
    if output.as_json or not sys.stderr.isatty():
        output.note(f"{label} ...")
        yield lambda done, total: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(label, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
