"""Lines for people on standard error, which may be closed or full, or lack our signs.

A line that cannot be printed is lost: it ends no command, and it never stands among the results on standard output, which is where `print`
puts it when standard error is closed.
"""

import sys
from contextlib import suppress

from rsrl.plain_signs import plain_signs

__all__ = ["at_terminal", "tell"]


def tell(text: str) -> None:
    """Print a line on standard error."""
    stream = sys.stderr
    if stream is not None:
        with suppress(OSError):
            print(plain_signs(text, getattr(stream, "encoding", None) or "utf-8"), file=stream, flush=True)


def at_terminal() -> bool:
    """Whether standard error is a terminal."""
    return sys.stderr is not None and sys.stderr.isatty()
