"""Progress of long work: a bar on standard error for a person at a terminal, else plain lines."""

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rsrl.cli.output import Output

PATIENCE_S = 8.0
"""Seconds after which work that is quick as a rule is told of."""

FIRST_TIME = "a first run on a machine compiles the simulator, which takes some minutes"

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


@contextmanager
def brief(output: Output, label: str) -> Iterator[Callable[[str], None]]:
    """Show work that takes seconds once its kernels are compiled: its steps at a terminal; elsewhere one line, only if it takes longer.

    The work calls what is given with each step's name. Not to be opened within another of these.
    """
    at, told = [label], output.as_json or not sys.stderr.isatty()
    timer = threading.Timer(PATIENCE_S, lambda: output.note(f"{at[0]} ... ({FIRST_TIME})"))
    timer.daemon = True
    timer.start()
    try:
        if told:
            yield lambda step: at.__setitem__(0, f"{label}: {step}")
        else:
            with steps(output, label) as show:
                yield lambda step: (at.__setitem__(0, f"{label}: {step}"), show(step))[1]
    finally:
        timer.cancel()
