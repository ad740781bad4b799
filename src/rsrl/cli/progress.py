"""Progress of long tasks: a bar on standard error at a terminal, plain lines elsewhere."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rsrl.cli.output import Output
from rsrl.compile_watch import COMPILING, Line, is_compiling
from rsrl.standard_error import at_terminal, reminded

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

PATIENCE_S = 8.0
"""Seconds after which a task that is usually quick is announced."""

REMIND_S = 25.0
"""Seconds after which a task says again, where there is no bar, that it goes on."""

_shown: "list[Console]" = []
"""Consoles with a bar or spinner on them at the moment; two at a time would write over each other."""

Report = Callable[[int, int], None]
"""Called by the task as `report(done, total)`."""


@contextmanager
def progress(output: Output, label: str) -> Iterator[Report]:
    """Show the progress of the task in the `with` block; the bar disappears when it ends."""
    if output.as_json or not at_terminal():
        output.note(f"{label} ...")
        at = [""]
        with _reminded(lambda: output.note(f"{label} ...{at[0]}"), REMIND_S):
            yield lambda done, total: at.__setitem__(0, f" {100 * done // total} %" if total else "")
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
    """Progress of a task that takes seconds once its kernels are compiled: steps at a terminal, elsewhere a line if it takes longer.

    The task calls the yielded function with the name of each step. Must not be nested.
    """
    if not output.as_json and at_terminal():
        with steps(output, label) as show:
            yield show
        return
    at = [label]
    with _reminded(lambda: output.note(f"{at[0]} ..."), PATIENCE_S):
        yield lambda step: at.__setitem__(0, f"{label}: {step}")


class CompileNotice:
    """A `compile_watch.Watcher` of the command line: lines as of `Line`, at a terminal a spinner with the seconds so far."""

    def __init__(self) -> None:
        self._line = Line()
        self._told_above_bar = False
        self._spinner: Progress | None = None

    def begin(self) -> None:
        """Say it, the first time; at a terminal turn a spinner unless a bar is there already."""
        if not at_terminal():
            self._line.begin()
        elif _shown:
            if not self._told_above_bar:
                self._told_above_bar = True
                _shown[-1].print(f"rsrl: {COMPILING}")
        else:
            self._spinner = self._spinner or _spinner()
            self._spinner.start()

    def end(self) -> None:
        """Stop the spinner; it leaves no trace."""
        if self._spinner is not None:
            self._spinner.stop()
        self._line.end()


@contextmanager
def _reminded(say: Callable[[], None], first_s: float) -> Iterator[None]:
    """Call `say` now and then while the block runs, but for the time in which kernels are compiled, which `CompileNotice` tells of."""
    with reminded(lambda: None if is_compiling() else say(), first_s, REMIND_S):
        yield


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
