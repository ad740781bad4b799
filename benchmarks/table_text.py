"""Tables and intervals as Markdown."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from rsrl.statistics import mean_interval


def markdown(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown, a line each."""
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def interval(value: float, ends: Sequence[float], digits: int = 2) -> str:
    """A signed value and its interval."""
    return f"{value:+.{digits}f} [{ends[0]:+.{digits}f}, {ends[1]:+.{digits}f}]"


def over_tracks(values: Sequence[float]) -> tuple[float, tuple[float, float]]:
    """Mean and interval, taking tracks for the sample."""
    array = np.array(values)
    return float(array.mean()), mean_interval(array)


def with_nan(item: dict[str, Any]) -> dict[str, Any]:
    """The same with NaN for null, in nested tables too."""
    filled = {key: with_nan(value) if isinstance(value, dict) else value for key, value in item.items()}
    return {key: float("nan") if value is None else value for key, value in filled.items()}
