"""Where RSRL keeps what it can make again: compiled kernels and fitted trees. The only module that looks for a cache folder."""

import os
import stat
import tempfile
from pathlib import Path

from rsrl.standard_error import tell

__all__ = ["cache_folder", "can_write"]


def cache_folder() -> Path | None:
    """`rsrl` in the user's cache folder, made if it does not exist, or else in a temporary folder; None where nothing can be written.

    The temporary folder is announced once on standard error. From then on it stands in `XDG_CACHE_HOME`, so that this process and those it
    starts go on with it.
    """
    user = _users_cache()
    if user is not None and can_write(user / "rsrl"):
        return user / "rsrl"
    temporary = _temporary_cache()
    where = "the user's cache folder" if user is None else str(user / "rsrl")
    if temporary is None:
        tell(f"rsrl: cannot write to {where} nor to a temporary folder; every run compiles again")
        return None
    tell(f"rsrl: cannot write to {where}; compiled code is kept in {temporary} (XDG_CACHE_HOME names another folder)")
    os.environ["XDG_CACHE_HOME"] = str(temporary)
    os.environ.setdefault("MPLCONFIGDIR", str(temporary / "matplotlib"))  # which would warn of the same
    return temporary / "rsrl"


def can_write(folder: Path) -> bool:
    """Whether files can be made in a folder, which is made if it does not exist."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


def _users_cache() -> Path | None:
    """`XDG_CACHE_HOME` or `~/.cache`; None without a home. The XDG specification ignores an empty value and a relative path."""
    named = os.environ.get("XDG_CACHE_HOME", "")
    if os.path.isabs(named):
        return Path(named)
    try:
        return Path.home() / ".cache"
    except RuntimeError:  # neither HOME nor an entry for this user
        return None


def _temporary_cache() -> Path | None:
    """A folder of this user among the temporary files, the same one in later runs; None where there can be none."""
    try:
        folder = Path(tempfile.gettempdir()) / f"rsrl-{os.getuid() if hasattr(os, 'getuid') else 'cache'}"
        folder.mkdir(mode=0o700, exist_ok=True)
        if not _is_ours(folder):  # compiled code is loaded from there, so nobody else may have put it there
            folder = Path(tempfile.mkdtemp(prefix="rsrl-"))
    except OSError:
        return None
    return folder if can_write(folder / "rsrl") else None


def _is_ours(folder: Path) -> bool:
    about = folder.lstat()
    if not hasattr(os, "getuid"):
        return stat.S_ISDIR(about.st_mode)
    return stat.S_ISDIR(about.st_mode) and about.st_uid == os.getuid() and not about.st_mode & 0o022
