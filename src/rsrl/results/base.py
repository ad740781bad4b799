"""What all result files have in common: structs, intervals, provenance, and the one way to read and to write them.

A result file is JSON. A field that may be absent has the default None and is then left out; NaN is written as null and read as None.
"""

import json
import math
import re
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from rsrl import __version__
from rsrl.errors import RsrlError
from rsrl.text_files import read_text

Number = float | None
"""A figure; null in the file where it cannot be told."""

Interval = tuple[Number, Number]
"""Both ends of a 95 % interval."""


class Result(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Base of everything that stands in a result file; fields without a default must be there, further ones are ignored."""


T = TypeVar("T", bound=Result)


class Machine(Result, frozen=True):
    """Processor, cores the process could use, Python version and operating system."""

    cpu: str
    cores: int
    python: str
    platform: str


class Provenance(Result, frozen=True):
    """Where a result comes from.

    Attributes:
        command: as it can be typed again.
        seed: None for a command without one.
        version: of RSRL.
        date: date and time in ISO format, in UTC.
        engine: that ran the cells of a study.
        assumptions: of the race that were changed, such as `pit_loss_s=+1`, in the order in which they were.
        note: what the reader of an older result should know, such as code that has changed since.
    """

    command: str
    seed: int | None
    version: str
    machine: Machine
    date: str
    engine: str | None = None
    assumptions: tuple[str, ...] = ()
    note: str | None = None

    def __post_init__(self) -> None:
        try:
            datetime.fromisoformat(self.date)
        except ValueError:
            raise ValueError(f"{self.date!r} is not a date") from None


class _Header(Result, frozen=True):
    """What the file of another version still tells of itself."""

    class _Version(Result, frozen=True):
        version: str

    format: int | None = None
    provenance: _Version | None = None


def known(ends: Interval | None) -> tuple[float, float] | None:
    """Both ends of an interval as numbers; None where either cannot be told."""
    if ends is None:
        return None
    low, high = (math.nan if end is None else end for end in ends)
    return None if math.isnan(low) or math.isnan(high) else (low, high)


def half_width(value: float, ends: Interval | None) -> float:
    """Distance from a value to the upper end of its interval; NaN where that cannot be told."""
    both = known(ends)
    return math.nan if both is None else both[1] - value


def plain(value: Any) -> Any:
    """`value` in types that JSON has: structs become objects, arrays lists, paths strings; NaN and infinity become None."""
    if isinstance(value, msgspec.Struct):
        return plain(msgspec.to_builtins(value))
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "tolist"):  # arrays and numbers of NumPy, recognised without importing it
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def to_json(content: Any) -> str:
    """A result as the text of its file."""
    return json.dumps(plain(content), indent=2, allow_nan=False) + "\n"


def read_result(path: Path, kind: type[T], made_by: str, format_: int | None = None) -> T:
    """Read a result file.

    Args:
        kind: the struct of the file.
        made_by: the command that writes such files, for messages.
        format_: number of the file format that this version reads, where such files have one.

    Raises:
        RsrlError: the file cannot be read, is of another format, or a field is missing or wrong; names the file and the field.
    """
    try:
        header = msgspec.json.decode(read_text(path))
    except OSError as error:
        raise RsrlError(f"{path}: cannot be read ({error.strerror})") from None
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise RsrlError(f"{path}: is no JSON ({error}); make it again with {made_by}") from None
    about = _header(header)
    version = f" (it was made by RSRL {about.provenance.version})" if about.provenance else ""
    if format_ is not None and about.format not in (None, format_):
        raise RsrlError(
            f"{path}: is of format {about.format}, RSRL {__version__} reads format {format_}{version}; "
            f"make it again with {made_by}, or read it with that version"
        )
    try:
        return from_plain(header, kind)
    except RsrlError as error:
        raise RsrlError(
            f"{path}: {error}; this is no result of {made_by} as RSRL {__version__} writes it{version}; make it again"
        ) from None


def from_plain(content: Any, kind: type[T]) -> T:
    """A struct from parsed JSON; raises RsrlError that names the first field that is missing or wrong."""
    try:
        return msgspec.convert(content, kind)
    except msgspec.ValidationError as error:
        raise RsrlError(_complaint(str(error))) from None


def _header(content: Any) -> _Header:
    try:
        return msgspec.convert(content, _Header)
    except msgspec.ValidationError:
        return _Header()


def _complaint(message: str) -> str:
    """`rows[1].ci95: expected float, got str` of msgspec's "Expected `float`, got `str` - at `$.rows[1].ci95`"."""
    what, _, where = message.partition(" - at `$")
    place = where.rstrip("`").lstrip(".") or "the whole"
    return f"{place}: {re.sub('`', '', what[:1].lower() + what[1:])}"
