"""Finished cells on disk, so that a study that was killed goes on where it was."""

import json
import re
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from rsrl import __version__
from rsrl.agents.checkpoint import replace_file
from rsrl.errors import RsrlError
from rsrl.evaluation.study.cells import Cell
from rsrl.text_files import read_text

FORMAT: Final = 1
SETTINGS_FILE, CELLS_FOLDER = "study.json", "cells"


class Store:
    """A study's folder: `study.json` says what it is, `cells/` holds a file for each finished cell, named by its key.

    A file is written beside its place and renamed, so there is a whole one or none.

    Args:
        settings: what every cell of the folder has in common; a folder begun with others is refused.
        force: take over a folder of other settings or of another version. Its cells stay; those that fit are used.

    Raises:
        RsrlError: the folder belongs to another study, version or settings, or cannot be written.
    """

    def __init__(self, folder: Path, settings: Mapping[str, Any], *, force: bool = False) -> None:
        self.folder = folder
        self._cells = folder / CELLS_FOLDER
        wanted = {"format": FORMAT, "version": __version__, **settings}
        path = folder / SETTINGS_FILE
        if path.exists() and not force:
            self._compare(path, wanted)
        try:
            self._cells.mkdir(parents=True, exist_ok=True)
            replace_file(path, (json.dumps(wanted, indent=1) + "\n").encode())
        except OSError as error:
            raise RsrlError(f"{folder}: cannot be written to ({error.strerror}); choose another folder with --out") from None

    def get(self, cell: Cell) -> dict[str, Any] | None:
        """The result of a cell, None where it is not finished; raises RsrlError for a file that is broken."""
        path = self._path(cell)
        if not path.is_file():
            return None
        try:
            result = json.loads(read_text(path))["result"]
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise RsrlError(f"{path}: not the result of a cell ({error}); delete it and run the study again") from None
        return dict(result)

    def put(self, cell: Cell, result: Mapping[str, Any]) -> None:
        """Keep the result of a cell; raises RsrlError where it cannot be written."""
        path = self._path(cell)
        try:
            replace_file(path, json.dumps({"cell": asdict(cell), "result": result}).encode())
        except OSError as error:
            raise RsrlError(
                f"{path}: cannot be written ({error.strerror}); make room and run the study again, it goes on from here"
            ) from None

    def _path(self, cell: Cell) -> Path:
        return self._cells / (re.sub(r"[^\w.-]", "-", cell.key) + ".json")

    def _compare(self, path: Path, wanted: Mapping[str, Any]) -> None:
        try:
            found = json.loads(read_text(path))
            odd = [name for name in wanted if found.get(name) != wanted[name]]
        except (OSError, ValueError, AttributeError) as error:
            raise RsrlError(f"{path}: cannot be read ({error}); choose another folder with --out") from None
        if odd:
            told = ", ".join(f"{name} {found.get(name)!r}, not {wanted[name]!r}" for name in odd)
            raise RsrlError(f"{self.folder}: holds a study of {told}; choose another --out, or take the folder over with --force")
