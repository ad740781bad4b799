"""Ctrl-C while kernels are compiled: Python answers only when the compiler returns, which can take half a minute."""

import os
import signal
import socket
import sys
import threading
import time
from contextlib import suppress
from typing import Final

from rsrl.compile_watch import is_compiling
from rsrl.standard_error import at_terminal

EXIT_INTERRUPTED: Final = 130
GRACE_S: Final = 0.5
"""Time for Python's own handler to answer, which leaves everything tidy."""

_SHOW_CURSOR: Final = b"\r\x1b[K\x1b[?25h"


def answer_while_compiling() -> None:
    """From now on, Ctrl-C ends the process within a second also while kernels are compiled. For the main thread of a command.

    The process then ends at once: nothing but the cache is being written, and its files are renamed into place.
    """
    receiver, sender = socket.socketpair()
    sender.setblocking(False)
    signal.set_wakeup_fd(sender.fileno(), warn_on_full_buffer=False)
    threading.Thread(target=_listen, args=(receiver, sender), daemon=True).start()


def _listen(receiver: socket.socket, sender: socket.socket) -> None:
    """Wait for signals, which the interpreter writes to `sender` at once, whatever the main thread is doing."""
    with receiver, sender:
        while True:
            if signal.SIGINT in receiver.recv(64):
                time.sleep(GRACE_S)
                if is_compiling():
                    _end()


def _end() -> None:
    if sys.stderr is not None:  # else descriptor 2 may be a file of ours
        with suppress(OSError):
            os.write(2, (_SHOW_CURSOR if at_terminal() else b"") + b"rsrl: interrupted\n")
    os._exit(EXIT_INTERRUPTED)
