"""Who wants to know when kernels are being compiled.

`compiled` reports here. This module imports nothing heavy, so that the command line can subscribe before Numba is imported. A program of
the user's own is told by one line, which the functions of `import rsrl` and the environments ask for.
"""

import threading
import time
from typing import Final, Protocol

from rsrl.standard_error import tell

__all__ = [
    "COMPILING",
    "Line",
    "Watcher",
    "announce",
    "compilation_begins",
    "compilation_ends",
    "is_compiling",
    "update_compilation_begins",
    "update_compilation_ends",
    "watch",
]


COMPILING: Final = "compiling the simulator (once, a minute or more) ..."
REMIND_S: Final = 20.0
"""Seconds of compiling without a word."""


class Watcher(Protocol):
    """Is told when compilation begins and when it ends, in the thread that compiles."""

    def begin(self) -> None:
        """A kernel is going to be compiled, with those that it calls."""

    def end(self) -> None:
        """It has been compiled, or compilation has failed."""


class Line:
    """The watcher where nobody looks at a terminal: a line at the first kernel, and one for every 20 s more of compiling."""

    def __init__(self) -> None:
        self._told = False
        self._compiled_s = 0.0
        self._begun: float | None = None

    def begin(self) -> None:
        """Say it, the first time."""
        self._begun = time.monotonic()
        if not self._told:
            self._told = True
            tell(f"rsrl: {COMPILING}")
            threading.Thread(target=self._remind, daemon=True).start()

    def end(self) -> None:
        """Count the seconds."""
        if self._begun is not None:
            self._compiled_s += time.monotonic() - self._begun
            self._begun = None

    def _remind(self) -> None:
        told_s = 0.0
        while True:
            time.sleep(1.0)
            begun = self._begun
            seconds = self._compiled_s + (time.monotonic() - begun if begun is not None else 0.0)
            if begun is not None and seconds >= told_s + REMIND_S:
                told_s = seconds
                tell(f"rsrl: still compiling, {seconds:.0f} s so far ...")


_watchers: list[Watcher] = []
_updates = 0
"""Updates of networks being compiled; they take seconds and are not announced."""

_depth = 0
"""Kernels being compiled, each called by the one before. Numba compiles in one thread at a time."""


def watch(watcher: Watcher) -> None:
    """Tell `watcher` from now on."""
    _watchers.append(watcher)


def announce() -> None:
    """From now on say once, on standard error, that kernels are compiled; a command, which watches already, says it in its own way."""
    if not _watchers:
        watch(Line())


def is_compiling() -> bool:
    """Whether a kernel or an update of a network is being compiled, in any thread, so that Python answers no signal."""
    return _depth > 0 or _updates > 0


def compilation_begins() -> None:
    """Called by the compiler, once for each kernel."""
    global _depth
    _depth += 1
    if _depth == 1:
        for watcher in _watchers:
            watcher.begin()


def compilation_ends() -> None:
    """Called by the compiler as often as `compilation_begins`."""
    global _depth
    _depth -= 1
    if _depth == 0:
        for watcher in _watchers:
            watcher.end()


def update_compilation_begins() -> None:
    """Called when JAX compiles."""
    global _updates
    _updates += 1


def update_compilation_ends() -> None:
    """Called as often as `update_compilation_begins`."""
    global _updates
    _updates -= 1
