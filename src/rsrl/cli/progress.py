"""Progress of long tasks: a bar on standard error at a terminal, plain lines elsewhere."""

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rsrl.cli.output import Output

PATIENCE_S = 8.0
"""Seconds after which a task that is usually quick is announced."""

FIRST_TIME = "the first run on a machine compiles the simulator, which takes a few minutes"

Report = Callable[[int, int], None]
"""Called by the task as `report(done, total)`."""


@contextmanager
def progress(output: Output, label: str) -> Iterator[Report]:
    """Show the progress of the task in the `with` block; the bar disappears when it ends."""
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
    """Show the current step of the task in the `with` block, which calls the yielded function with the name of each step."""
    if output.as_json or not sys.stderr.isatty():
        yield lambda step: output.note(f"{label}: {step} ...")
        return
    from rich.console import Console

    with Console(stderr=True).status(f"{label} ...") as status:
        yield lambda step: status.update(f"{label}: {step} ...")


@contextmanager
def brief(output: Output, label: str) -> Iterator[Callable[[str], None]]:
    """Progress of a task that takes seconds once its kernels are compiled: steps at a terminal, elsewhere one line if it takes longer.

    The task calls the yielded function with the name of each step. Must not be nested.
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
