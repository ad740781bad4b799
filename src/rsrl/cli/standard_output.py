"""Standard output that may be closed, full, or of an encoding that lacks our signs: no traceback, and no broken text."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout, suppress
from typing import Any, Final

from rsrl.plain_signs import plain_signs

EXIT_READER_GONE: Final = 141
"""128 and the number of SIGPIPE: what a shell reports of other tools whose reader has gone."""


STDOUT_DESCRIPTOR: Final = 1


class StandardOutputError(Exception):
    """Nothing more can be printed; `reader_gone` where the program at the other end of a pipe has ended, which is no fault."""

    def __init__(self, reason: str, *, reader_gone: bool = False) -> None:
        super().__init__(f"standard output: cannot be written to ({reason})")
        self.reader_gone = reader_gone


@contextmanager
def guarded_stdout() -> Iterator[None]:
    """Within the block, printing uses plain signs where the stream lacks ours, and a failure raises `StandardOutputError`.

    It is no OSError, so that nothing on the way takes it for a fault of a file.
    """
    guard = _Guard(sys.stdout)
    with redirect_stdout(guard):
        yield
        guard.flush()


class _Guard:
    """Stands before a text stream; None where the process was started with standard output closed."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream
        self.encoding: str = getattr(stream, "encoding", None) or "utf-8"

    def write(self, text: str) -> int:
        if self._stream is None:
            raise StandardOutputError("it is closed")
        try:
            self._stream.write(plain_signs(text, self.encoding))
        except OSError as error:
            self._fail(error)
        return len(text)

    def flush(self) -> None:
        if self._stream is None:
            return
        try:
            self._stream.flush()
        except OSError as error:
            self._fail(error)

    def isatty(self) -> bool:
        return self._stream is not None and bool(self._stream.isatty())

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def _fail(self, error: OSError) -> None:
        """Send what is still buffered nowhere, since the interpreter flushes it when it ends, and raise."""
        with suppress(OSError):
            if self._stream.fileno() == STDOUT_DESCRIPTOR:
                with open(os.devnull, "wb") as nowhere:
                    os.dup2(nowhere.fileno(), STDOUT_DESCRIPTOR)
        raise StandardOutputError(error.strerror or str(error), reader_gone=isinstance(error, BrokenPipeError)) from None
