"""Who wants to know when kernels are being compiled.

`compiled` reports here. This module imports nothing heavy, so that the command line can subscribe before Numba is imported. A program of
the user's own is told by one line, which the functions of `import rsrl` and the environments ask for.
"""

from typing import Final, Protocol

from rsrl.standard_error import tell

__all__ = ["COMPILING", "Watcher", "announce", "compilation_begins", "compilation_ends", "is_compiling", "watch"]


COMPILING: Final = "compiling the simulator (once, about a minute) ..."


class Watcher(Protocol):
    """Is told when compilation begins and when it ends, in the thread that compiles."""

    def begin(self) -> None:
        """A kernel is going to be compiled, with those that it calls."""

    def end(self) -> None:
        """It has been compiled, or compilation has failed."""


class _Line:
    """The watcher of a program of the user's own."""

    def __init__(self) -> None:
        self._told = False

    def begin(self) -> None:
        if not self._told:
            self._told = True
            tell(f"rsrl: {COMPILING}")

    def end(self) -> None:
        pass


_watchers: list[Watcher] = []
_depth = 0
"""Kernels being compiled, each called by the one before. Numba compiles in one thread at a time."""


def watch(watcher: Watcher) -> None:
    """Tell `watcher` from now on."""
    _watchers.append(watcher)


def announce() -> None:
    """From now on say once, on standard error, that kernels are compiled; a command, which watches already, says it in its own way."""
    if not _watchers:
        watch(_Line())


def is_compiling() -> bool:
    """Whether a kernel is being compiled, in any thread."""
    return _depth > 0


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
