"""Progress of long work: a bar on standard error for a person at a terminal, else plain lines."""

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


@contextmanager
def steps(output: Output, label: str) -> Iterator[Callable[[str], None]]:
    """Show which step the work is at, while the block runs; the work calls what is given with each step's name."""
    if output.as_json or not sys.stderr.isatty():
        yield lambda step: output.note(f"{label}: {step} ...")
        return
    from rich.console import Console

    with Console(stderr=True).status(f"{label} ...") as status:
        yield lambda step: status.update(f"{label}: {step} ...")
