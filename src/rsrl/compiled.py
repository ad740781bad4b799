"""How RSRL compiles its kernels: one decorator, one cache that notices every change of a kernel's source.

Numba's own cache looks at one file only, so a change in a module it imports would go unseen. The cache folder
is therefore named by a hash of all kernel sources; it stands in the user's cache folder (`cache_folder`), so a read-only
installation works as well.
"""

import functools
import glob
import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core import event
from numba.core.caching import FunctionCache
from numba.core.registry import CPUDispatcher

from rsrl import compile_watch
from rsrl.cache_folder import cache_folder, can_write
from rsrl.standard_error import tell

__all__ = ["kernel", "kernel_source_hash"]

_WHOLE_PACKAGES = ("simulator", "state", "environment", "rollouts")
_PACKAGES_WITH_SOME = ("explanation",)
_CONSTANTS = ("season/vocabulary.py", "season/rival_features.py")  # read by kernels, and compiled into them
_MARK = b"from rsrl.compiled import"


def kernel_source_hash() -> str:
    """Hash of the sources that hold kernels, or figures compiled into them, and of how they are compiled: names the compiled code."""
    root = Path(__file__).parent
    digest = hashlib.sha256(Path(__file__).read_bytes())
    for package in _WHOLE_PACKAGES:
        for path in sorted((root / package).glob("*.py")):
            digest.update(path.read_bytes())
    for name in _CONSTANTS:
        digest.update((root / name).read_bytes())
    for package in _PACKAGES_WITH_SOME:
        for path in sorted((root / package).rglob("*.py")):
            source = path.read_bytes()
            if _MARK in source:
                digest.update(source)
    return digest.hexdigest()[:16]


def _code_folder() -> Path | None:
    """Where Numba keeps the compiled code: the folder the user has named for it, or one of our own; None where nothing can be written."""
    named = os.environ.get("NUMBA_CACHE_DIR")
    if named and can_write(Path(named)):
        return Path(named)
    folder = cache_folder()
    return folder / kernel_source_hash() if folder else None


class _Reporter(event.Listener):  # type: ignore[misc]  # Numba has no types
    """Passes on that kernels are being compiled; kernels loaded from the cache are not."""

    def on_start(self, event: Any) -> None:
        compile_watch.compilation_begins()

    def on_end(self, event: Any) -> None:
        compile_watch.compilation_ends()


class _KernelCache(FunctionCache):  # type: ignore[misc]
    """Numba's cache of one kernel, without which the kernel is compiled again: so neither damaged files nor a full disk end the run."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # what a damaged pickle raises can be anything
            _warn(f"removed damaged files of compiled code from {_folder}")
            for path in Path(self.cache_path).glob(f"{glob.escape(self._impl.filename_base)}.*"):
                path.unlink(missing_ok=True)
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        try:
            super().save_overload(sig, data)
        except OSError as error:
            _warn(f"cannot keep compiled code in {_folder} ({error.strerror}); the next run compiles again")


@functools.cache  # once for each text
def _warn(text: str) -> None:
    tell(f"rsrl: {text}")


_folder = _code_folder()
numba.config.CACHE_DIR = str(_folder or "")
event.register("numba:compile", _Reporter())


class _Inlined(CPUDispatcher):  # type: ignore[misc]
    """A kernel that its callers take in whole; it has no entry for Python, whose absence Numba would answer with a crash."""

    def __call__(self, *_: object) -> None:
        raise TypeError(f"{self.py_func.__qualname__} is inlined: call it from a kernel, or declare it `@kernel()`")


def kernel(*, inline: bool = False) -> Callable[[Any], Any]:
    """Decorator for compiled code: cached, free of the interpreter lock, and without fast-math, so that bits are reproducible.

    Args:
        inline: compile the kernel once for each list of argument types and let LLVM copy it into its callers. Numba's own way,
            `inline=True`, copies it before types are inferred: two thirds of all time to compile went into that. An inlined kernel
            cannot be called from Python.

    `_nrt=False` leaves out reference counting of arrays, which costs more than the race itself (five times on 20 cars); in return
    a kernel cannot allocate: its caller hands it every array.
    """
    options = {"nopython": True, "nogil": True, "error_model": "numpy", "_nrt": False, "boundscheck": None, "no_cfunc_wrapper": True}

    def decorate(function: Any) -> Any:
        if numba.config.DISABLE_JIT:
            return function
        if inline:
            compiled = _Inlined(function, targetoptions=options | {"forceinline": True, "no_cpython_wrapper": True})
        else:
            compiled = CPUDispatcher(function, targetoptions=options)
        if _folder is not None:
            compiled._cache = _KernelCache(function)  # as `njit(cache=True)` does with Numba's own
        return compiled

    return decorate
