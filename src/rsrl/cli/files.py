"""Writing result files; existing files are overwritten only with --force."""

from pathlib import Path
from typing import Any

from rsrl.errors import RsrlError
from rsrl.results import to_json


def refuse_overwrite(path: Path, force: bool, option: str = "--out") -> None:
    """Raise RsrlError where `path` is an existing file or a non-empty folder, unless `force`.

    Called before the work starts, so that a long run does not end in a refusal. `option` is the option that gave the path.
    """
    if force or not path.exists():
        return
    if path.is_dir() and not any(path.iterdir()):
        return
    raise RsrlError(f"{path} already exists; give another {option}, or --force to overwrite it")


def make_folder(path: Path, option: str = "--out") -> Path:
    """Make a folder and its parents; raises RsrlError where that fails or the folder is not writable."""
    probe = path / ".rsrl-write-test"
    try:
        path.mkdir(parents=True, exist_ok=True)
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise RsrlError(f"{path}: cannot be written to ({error.strerror}); choose another folder with {option}") from None
    return path


def write_json(path: Path, content: Any) -> None:
    """Write a result as JSON; raises RsrlError where the file cannot be written."""
    write_text(path, to_json(content))


def write_text(path: Path, text: str, option: str = "--out") -> None:
    """Write a text file; raises RsrlError where the file cannot be written."""
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise RsrlError(f"{path}: cannot be written ({error.strerror}); choose another folder with {option}") from None


def check_file(path: Path, force: bool, option: str) -> None:
    """Check, before the work starts, that the file given by an option can be written.

    Raises:
        RsrlError: it is a folder, it exists and `force` is not set, or its folder is not writable.
    """
    if path.is_dir():
        raise RsrlError(f"{path}: is a folder; name a file with {option}")
    refuse_overwrite(path, force, option)
    make_folder(path.parent, option)
