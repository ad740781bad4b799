"""Who wants to know when kernels are being compiled.

`compiled` reports here. This module imports nothing heavy, so that the command line can subscribe before Numba is imported.
"""

from typing import Protocol

__all__ = ["Watcher", "compilation_begins", "compilation_ends", "is_compiling", "watch"]


class Watcher(Protocol):
    """Is told when compilation begins and when it ends, in the thread that compiles."""

    def begin(self) -> None:
        """A kernel is going to be compiled, with those that it calls."""

    def end(self) -> None:
        """It has been compiled, or compilation has failed."""


_watchers: list[Watcher] = []
_depth = 0
"""Kernels being compiled, each called by the one before. Numba compiles in one thread at a time."""


def watch(watcher: Watcher) -> None:
    """Tell `watcher` from now on."""
    _watchers.append(watcher)


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
