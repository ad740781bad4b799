"""Writing what the user asked for, and nothing over what is already there unless told to."""

from pathlib import Path
from typing import Any

from rsrl.errors import RsrlError
from rsrl.results import to_json


def refuse_overwrite(path: Path, force: bool, option: str = "--out") -> None:
    """Raise RsrlError where `path` is a file, or a folder that holds something, unless `force`.

    To be called before the work, so that an hour's run does not end in a refusal. `option` named the path.
    """
    if force or not path.exists():
        return
    if path.is_dir() and not any(path.iterdir()):
        return
    raise RsrlError(f"{path} already exists; give another {option}, or --force to overwrite it")


def make_folder(path: Path, option: str = "--out") -> Path:
    """Make a folder and those above it; raises RsrlError where that cannot be, or nothing can be written in it."""
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
    """Write a text; raises RsrlError where the file cannot be written."""
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise RsrlError(f"{path}: cannot be written ({error.strerror}); choose another folder with {option}") from None


def check_file(path: Path, force: bool, option: str) -> None:
    """Raise RsrlError where the file an option names cannot be written; to be called before the work.

    Raises:
        RsrlError: it is a folder, is there already and `force` is not given, or its folder cannot be written to.
    """
    if path.is_dir():
        raise RsrlError(f"{path}: is a folder; name a file with {option}")
    refuse_overwrite(path, force, option)
    make_folder(path.parent, option)
