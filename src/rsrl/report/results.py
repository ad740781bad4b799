"""The result files of a study folder: which are there, and that each is one this version can show."""

from pathlib import Path
from typing import Any, Final, NamedTuple

from rsrl.errors import RsrlError
from rsrl.results import FORMAT, Evaluation, Explained, Robustness, StudyResult, read_result


class Kind(NamedTuple):
    """A kind of result file: its name, the command that makes it, its struct, and the number of its format where it has one."""

    file: str
    command: str
    struct: type[Any]
    format: int | None = None


KINDS: Final = (
    Kind("generalise.json", "rsrl study generalise", StudyResult, FORMAT),
    Kind("evaluation.json", "rsrl evaluate --out", Evaluation),
    Kind("robustness.json", "rsrl study robustness --out", Robustness),
    Kind("explanation.json", "rsrl explain --json", Explained),
)

Document = StudyResult | Evaluation | Robustness | Explained


class Results(NamedTuple):
    """What a folder holds, each None where its file is not there."""

    generalise: StudyResult | None
    evaluation: Evaluation | None
    robustness: Robustness | None
    explanation: Explained | None = None

    def files(self) -> dict[str, Document]:
        """Contents by name of file, of those there are."""
        return {kind.file: document for kind, document in zip(KINDS, self, strict=True) if document is not None}


def read_results(folder: Path) -> Results:
    """Read the result files of a folder.

    Raises:
        RsrlError: no such folder, none of the files in it, or one that cannot be read or is another version's.
    """
    if not folder.is_dir():
        raise RsrlError(f"{folder}: no such folder; name one made by rsrl study or rsrl evaluate --out")
    found = Results(*(_read(folder / kind.file, kind) for kind in KINDS))
    if not found.files():
        raise RsrlError(f"{folder}: nothing to report; it holds none of {', '.join(kind.file for kind in KINDS)}")
    return found


def _read(path: Path, kind: Kind) -> Any:
    return read_result(path, kind.struct, kind.command, kind.format) if path.exists() else None
