"""Values as live timing writes them: numbers as text, gaps in seconds or laps, truth in four spellings."""

import re
from collections.abc import Mapping
from typing import Any, Final

__all__ = ["decimal", "flag", "lap_time_s", "mapping", "parse_gap", "whole"]

_LAPS_DOWN: Final = re.compile(r"\+?\s*(\d{1,3})\s*L(?:AP|APS)?", re.ASCII)
_LEADER: Final = re.compile(r"LAP\s+\d{1,3}", re.ASCII)
_SECONDS: Final = re.compile(r"\+?(?:(\d{1,2}):)?(\d{1,4}(?:\.\d{1,6})?)", re.ASCII)
_LAP_TIME: Final = re.compile(r"(?:(?:(\d{1,2}):)?(\d{1,2}):)?(\d{1,2}(?:\.\d{1,6})?)", re.ASCII)
_NOTHING: Final[dict[str, Any]] = {}


def mapping(value: object) -> Mapping[str, Any]:
    """The value where it is a mapping, a list as a mapping by index, else an empty one."""
    if isinstance(value, dict):
        return value
    if isinstance(value, list):
        return {str(i): one for i, one in enumerate(value)}
    return _NOTHING


def whole(value: object, most: int) -> int | None:
    """A whole number from 0 to `most`, written as a number or as text; None for anything else."""
    if isinstance(value, str) and value.isascii() and value.isdecimal() and len(value) < 10:
        value = int(value)
    return value if isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= most else None


def decimal(value: object) -> float | None:
    """A number of at most four digits before the point, written as a number or as text; None for anything else."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value) if abs(value) < 10_000 else None  # not true of NaN either
    if isinstance(value, str) and re.fullmatch(r"-?\d{1,4}(\.\d{1,6})?", value, re.ASCII):
        return float(value)
    return None


def flag(value: object) -> bool | None:
    """Truth as the feed writes it: true and false, "true" and "false", "1" and "0"; None for anything else."""
    if isinstance(value, bool):
        return value
    return {"true": True, "1": True, "false": False, "0": False}.get(value.lower()) if isinstance(value, str) else None


def parse_gap(value: object) -> tuple[float | None, int | None]:
    """Seconds and laps behind, each None where it is not given.

    "+1.685" is a gap in seconds on the same lap; "1L", "1 L" and "+1 LAP" are laps; "LAP 23" stands beside the leader; "" and null say
    nothing.
    """
    if not isinstance(value, str):
        return None, None
    if value[:1] == "+" and value[-4:-3] == "." and 6 <= len(value) < 10 and value.isascii() and (value[1:-4] + value[-3:]).isdecimal():
        return float(value), 0  # as most gaps are written
    text = value.strip().upper()
    if seconds := _SECONDS.fullmatch(text):
        return 60.0 * int(seconds[1] or 0) + float(seconds[2]), 0
    if laps := _LAPS_DOWN.fullmatch(text):
        return None, int(laps[1])
    return (0.0, 0) if _LEADER.fullmatch(text) else (None, None)


def lap_time_s(value: object) -> float | None:
    """Seconds of a lap time such as "1:47.017", "59.123" or, under a red flag, "1:02:03.456"; None for anything else."""
    match = _LAP_TIME.fullmatch(value) if isinstance(value, str) else None
    if not match:
        return None
    return 3600.0 * int(match[1] or 0) + 60.0 * int(match[2] or 0) + float(match[3])
