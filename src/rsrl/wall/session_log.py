"""The log of views: one JSON line whenever what a viewer looks at changes, from which a server that was killed goes on."""

import json
from pathlib import Path
from typing import Final

from rsrl.cache_folder import cache_folder
from rsrl.errors import RsrlError
from rsrl.wall.settings import View

FORMAT: Final = 1
MOST_BYTES: Final = 1_000_000
"""A longer log begins anew with its last line."""


def log_file(port: int) -> Path | None:
    """The log of the server on a port, in the cache folder; None where nothing can be kept."""
    folder = cache_folder()
    return None if folder is None else folder / "wall" / f"session-{port}.jsonl"


class SessionLog:
    """Appends views to a file; a disk that is full or read-only costs the log, not the server."""

    def __init__(self, path: Path | None) -> None:
        self._path = path
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)

    def note(self, view: View) -> None:
        """Write a view."""
        if self._path is None:
            return
        line = json.dumps({"format": FORMAT, **view._asdict()}) + "\n"
        try:
            anew = self._path.is_file() and self._path.stat().st_size > MOST_BYTES
            with self._path.open("w" if anew else "a", encoding="utf-8") as file:
                file.write(line)
        except OSError:
            self._path = None


def last_view(path: Path | None) -> View:
    """The view of the log's last whole line; one cut short by the end of the process is passed over.

    Raises:
        RsrlError: there is no log, or nothing in it.
    """
    try:
        lines = [] if path is None else path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        lines = []
    for line in reversed(lines):
        try:
            document = json.loads(line)
            if document.pop("format") == FORMAT:
                return View(**document)
        except (ValueError, KeyError, TypeError, AttributeError):
            continue
    raise RsrlError("--resume: there is no session to go on with; leave it out")
