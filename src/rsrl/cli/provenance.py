"""Where a result comes from: command, seed, version, machine and date, and nothing that identifies the machine."""

import os
import platform
import shlex
from collections.abc import Sequence
from contextvars import ContextVar
from datetime import UTC, datetime
from pathlib import Path

from rsrl import __version__
from rsrl.results import Machine, Provenance

_command_line: ContextVar[str] = ContextVar("command line", default="rsrl")
_assumptions: ContextVar[tuple[str, ...]] = ContextVar("assumptions", default=())


def remember_command_line(arguments: Sequence[str]) -> None:
    """Keep the words typed after `rsrl` for the provenance of what they make; no assumption is changed yet."""
    _command_line.set(shlex.join(["rsrl", *arguments]))
    _assumptions.set(())


def command_line() -> str:
    """The command being run, as it can be typed again."""
    return _command_line.get()


def remember_assumptions(changes: Sequence[str]) -> None:
    """Keep the assumptions that the command changes, for its tables and for the provenance of its result."""
    _assumptions.set(tuple(changes))


def assumptions() -> tuple[str, ...]:
    """The assumptions that the command being run changes, such as `pit_loss_s=+1`."""
    return _assumptions.get()


def provenance(seed: int | None, *, command: str | None = None, engine: str | None = None) -> Provenance:
    """The block that every result carries; `command` is the command line unless given, `engine` ran the cells of a study."""
    return Provenance(
        command=command or command_line(),
        seed=seed,
        version=__version__,
        machine=machine(),
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        engine=engine,
        assumptions=assumptions(),
    )


def machine() -> Machine:
    """Processor, cores this process may use, Python version and operating system; no name that identifies the machine."""
    return Machine(
        cpu=_cpu_name(),
        cores=cores(),
        python=platform.python_version(),
        platform=f"{platform.system()} {platform.machine()}",
    )


def cores() -> int:
    """Cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _cpu_name() -> str:
    cpuinfo = Path("/proc/cpuinfo")  # Linux; elsewhere `platform` knows
    if cpuinfo.is_file():
        for line in cpuinfo.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
