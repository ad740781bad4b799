"""Lines for people on standard error, which may be closed or full, or lack our signs.

A line that cannot be printed is lost: it ends no command, and it never stands among the results on standard output, which is where `print`
puts it when standard error is closed.
"""

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from rsrl.plain_signs import plain_signs

__all__ = ["at_terminal", "reminded", "tell"]


def tell(text: str) -> None:
    """Print a line on standard error."""
    stream = sys.stderr
    if stream is not None:
        with suppress(OSError):
            print(plain_signs(text, getattr(stream, "encoding", None) or "utf-8"), file=stream, flush=True)


def at_terminal() -> bool:
    """Whether standard error is a terminal."""
    return sys.stderr is not None and sys.stderr.isatty()


@contextmanager
def reminded(say: Callable[[], None], first_s: float, every_s: float) -> Iterator[None]:
    """Call `say` from a thread of its own while the block runs: after `first_s` seconds, then every `every_s`."""
    over = threading.Event()

    def remind() -> None:
        wait_s = first_s
        while not over.wait(wait_s):
            say()
            wait_s = every_s

    threading.Thread(target=remind, daemon=True).start()
    try:
        yield
    finally:
        over.set()
