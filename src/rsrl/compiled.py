"""How RSRL compiles its kernels: one decorator, one cache that notices every change of a kernel's source.

Numba's own cache looks at one file only, so a change in a module it imports would go unseen. The cache folder
is therefore named by a hash of all kernel sources; it stands in the user's cache folder, so a read-only
installation works as well.
"""

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba

__all__ = ["kernel", "kernel_source_hash"]

_WHOLE_PACKAGES = ("simulator", "state", "environment", "rollouts")
_PACKAGES_WITH_SOME = ("explanation",)
_MARK = b"from rsrl.compiled import"


def kernel_source_hash() -> str:
    """Hash of the sources that hold kernels, or figures compiled into them: names the compiled code."""
    root = Path(__file__).parent
    digest = hashlib.sha256()
    for package in _WHOLE_PACKAGES:
        for path in sorted((root / package).glob("*.py")):
            digest.update(path.read_bytes())
    for package in _PACKAGES_WITH_SOME:
        for path in sorted((root / package).rglob("*.py")):
            source = path.read_bytes()
            if _MARK in source:
                digest.update(source)
    return digest.hexdigest()[:16]


if "NUMBA_CACHE_DIR" not in os.environ:
    _base = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    numba.config.CACHE_DIR = str(_base / "rsrl" / kernel_source_hash())


def kernel(**options: Any) -> Callable[[Any], Any]:
    """Decorator for compiled code: cached, free of the interpreter lock, and without fast-math, so that bits are reproducible.

    `_nrt=False` leaves out reference counting of arrays, which costs more than the race itself (five times on 20 cars); in return
    a kernel cannot allocate: its caller hands it every array.
    """
    return numba.njit(cache=True, nogil=True, error_model="numpy", _nrt=False, **options)
