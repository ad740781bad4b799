"""The result files of a study folder: which are there, and that each is one this version can show."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple, NoReturn

from rsrl import __version__
from rsrl.errors import RsrlError
from rsrl.report.shapes import EVALUATION, EXPLANATION, GENERALISE, ROBUSTNESS, ShapeError, check

Json = Mapping[str, Any]

FORMAT: Final = 1
"""Of `generalise.json`, as `rsrl.evaluation.study` writes it."""


class Kind(NamedTuple):
    """A kind of result file: its name, the command that makes it, what it must hold."""

    file: str
    command: str
    shape: Mapping[str, Any]


KINDS: Final = (
    Kind("generalise.json", "rsrl study generalise", GENERALISE),
    Kind("evaluation.json", "rsrl evaluate --out", EVALUATION),
    Kind("robustness.json", "rsrl study robustness --out", ROBUSTNESS),
    Kind("explanation.json", "rsrl explain --json", EXPLANATION),
)


class Results(NamedTuple):
    """What a folder holds, each None where its file is not there."""

    generalise: Json | None
    evaluation: Json | None
    robustness: Json | None
    explanation: Json | None = None

    def files(self) -> dict[str, Json]:
        """Contents by name of file, of those there are."""
        return {kind.file: document for kind, document in zip(KINDS, self, strict=True) if document is not None}


def read_results(folder: Path) -> Results:
    """Read the result files of a folder.

    Raises:
        RsrlError: no such folder, none of the files in it, or one that cannot be read or is another version's.
    """
    if not folder.is_dir():
        raise RsrlError(f"{folder}: no such folder; name one made by rsrl study or rsrl evaluate --out")
    found = Results(*(_read(folder / kind.file, kind) if (folder / kind.file).exists() else None for kind in KINDS))
    if not found.files():
        raise RsrlError(f"{folder}: nothing to report; it holds none of {', '.join(kind.file for kind in KINDS)}")
    return found


def _read(path: Path, kind: Kind) -> Json:
    try:
        document = json.loads(path.read_text(encoding="utf-8"), parse_constant=_no_number)
    except OSError as error:
        raise RsrlError(f"{path}: cannot be read ({error.strerror})") from None
    except ValueError as error:  # of JSON and of UTF-8 alike
        raise RsrlError(f"{path}: is no JSON ({error}); make it again with {kind.command}") from None
    if kind.shape is GENERALISE:
        _check_format(path, document, kind)
    try:
        check(document, kind.shape)
    except ShapeError as error:
        raise RsrlError(
            f"{path}: {error}; this is no result of {kind.command} as RSRL {__version__} writes it{_made_by(document)}; make it again"
        ) from None
    return dict(document)


def _check_format(path: Path, document: Any, kind: Kind) -> None:
    format_ = document.get("format") if isinstance(document, Mapping) else None
    if format_ is not None and format_ != FORMAT:
        raise RsrlError(
            f"{path}: is of format {format_}, RSRL {__version__} reads format {FORMAT}{_made_by(document)}; "
            f"make it again with {kind.command}, or the report with that version"
        )


def _made_by(document: Any) -> str:
    """Which version made a file, as far as it says so."""
    provenance = document.get("provenance") if isinstance(document, Mapping) else None
    version = provenance.get("version") if isinstance(provenance, Mapping) else None
    return f" (it was made by RSRL {version})" if isinstance(version, str) else ""


def _no_number(text: str) -> NoReturn:
    raise ValueError(f"{text} is no number")
