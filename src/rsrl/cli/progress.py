"""Progress of long tasks: a bar on standard error at a terminal, plain lines elsewhere."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rsrl.cli.output import Output
from rsrl.compile_watch import COMPILING
from rsrl.standard_error import at_terminal, tell

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

PATIENCE_S = 8.0
"""Seconds after which a task that is usually quick is announced."""

_shown: "list[Console]" = []
"""Consoles with a bar or spinner on them at the moment; two at a time would write over each other."""

Report = Callable[[int, int], None]
"""Called by the task as `report(done, total)`."""


@contextmanager
def progress(output: Output, label: str) -> Iterator[Report]:
    """Show the progress of the task in the `with` block; the bar disappears when it ends."""
    if output.as_json or not at_terminal():
        output.note(f"{label} ...")
        yield lambda done, total: None
        return
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with _live() as console, Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(label, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@contextmanager
def steps(output: Output, label: str) -> Iterator[Callable[[str], None]]:
    """Show the current step of the task in the `with` block, which calls the yielded function with the name of each step."""
    if output.as_json or not at_terminal():
        yield lambda step: output.note(f"{label}: {step} ...")
        return
    from rich.text import Text

    with _live() as console, console.status(Text(f"{label} ...")) as status:
        yield lambda step: status.update(Text(f"{label}: {step} ..."))


@contextmanager
def brief(output: Output, label: str) -> Iterator[Callable[[str], None]]:
    """Progress of a task that takes seconds once its kernels are compiled: steps at a terminal, elsewhere one line if it takes longer.

    The task calls the yielded function with the name of each step. Must not be nested.
    """
    at, told = [label], output.as_json or not at_terminal()
    timer = threading.Timer(PATIENCE_S, lambda: output.note(f"{at[0]} ..."))
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


class CompileNotice:
    """A `compile_watch.Watcher` that says on standard error that kernels are compiled: one line, at a terminal with the seconds so far."""

    def __init__(self) -> None:
        self._told = False
        self._spinner: Progress | None = None

    def begin(self) -> None:
        """Say it, the first time; at a terminal turn a spinner unless a bar is there already."""
        if not at_terminal():
            self._tell(tell)
        elif _shown:
            self._tell(_shown[-1].print)
        else:
            self._spinner = self._spinner or _spinner()
            self._spinner.start()

    def end(self) -> None:
        """Stop the spinner; it leaves no trace."""
        if self._spinner is not None:
            self._spinner.stop()

    def _tell(self, say: Callable[[str], None]) -> None:
        if not self._told:
            self._told = True
            say(f"rsrl: {COMPILING}")


@contextmanager
def _live() -> "Iterator[Console]":
    """A console on standard error for a bar or a spinner."""
    from rich.console import Console

    console = Console(stderr=True)
    _shown.append(console)
    try:
        yield console
    finally:
        _shown.remove(console)


def _spinner() -> "Progress":
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (SpinnerColumn("line"), TextColumn("{task.description}"), TimeElapsedColumn())
    spinner = Progress(*columns, console=Console(stderr=True), transient=True)
    spinner.add_task(COMPILING)
    return spinner
