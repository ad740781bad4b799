"""Numbers as the report writes them: one way for each kind, so that a figure reads the same wherever it stands."""

from datetime import datetime
from typing import Final

from rsrl.results import Interval, known

MINUS: Final = "\N{MINUS SIGN}"
MISSING: Final = "\N{EN DASH}"
"""Stands for a value that is missing."""

ROUND: Final = 1000
"""From here on values have no decimals."""


def verdict(ends: Interval | None) -> int:
    """1 where an interval lies above zero, -1 below, 0 where it includes zero or cannot be told."""
    both = known(ends)
    return 0 if both is None else int(both[0] > 0) - int(both[1] < 0)


def place(value: float) -> str:
    """A mean finishing position: `6.21`."""
    return f"{value:.2f}"


def signed(value: float) -> str:
    """A difference in places with its sign: `+0.12`; zero has none."""
    text = f"{abs(value):.2f}"
    return text if not float(text) else ("+" if value > 0 else MINUS) + text


def half_width(value: float, ends: Interval | None) -> str:
    """Half the width of an interval, as read from its upper end: `±0.24`."""
    both = known(ends)
    return "" if both is None else f"±{both[1] - value:.2f}"


def half_percent(value: float | None, ends: Interval | None) -> str:
    """Half the width of an interval of a share: `±5 %`."""
    both = known(ends)
    return "" if both is None or value is None else f"±{100 * (both[1] - value):.0f} %"


def place_range(ends: Interval | None) -> str:
    """An interval of a position: `5.97 to 6.45`."""
    both = known(ends)
    return MISSING if both is None else f"{place(both[0])} to {place(both[1])}"


def signed_range(ends: Interval | None) -> str:
    """An interval of a difference: `+0.02 to +0.22`."""
    both = known(ends)
    return MISSING if both is None else f"{signed(both[0])} to {signed(both[1])}"


def percent(value: float | None, digits: int = 0) -> str:
    """A share: `35 %`."""
    return MISSING if value is None else f"{_hundred(value, digits)} %"


def _hundred(value: float, digits: int = 0) -> str:
    text = f"{abs(100 * value):.{digits}f}"
    return MINUS + text if value < 0 and float(text) else text


def percent_range(ends: Interval | None) -> str:
    """An interval of a share: `30 to 40 %`."""
    both = known(ends)
    return MISSING if both is None else f"{_hundred(both[0])} to {_hundred(both[1])} %"


def three(value: float | None, *, sign: bool = False) -> str:
    """A value of any kind in three digits: `0.0123`, `+1.23`, `145`."""
    if value is None:
        return MISSING
    text = f"{abs(value):.3g}" if abs(value) < ROUND else f"{abs(value):,.0f}"
    if not value:
        return text
    return (MINUS if value < 0 else "+" if sign else "") + text


def whole(value: int) -> str:
    """A count: `1,920`."""
    return f"{value:,}"


def counted(count: int, what: str) -> str:
    """`1 track`, `14 tracks`."""
    return f"{whole(count)} {what}{'' if count == 1 else 's'}"


def date(text: str) -> str:
    """A moment of a provenance: `24 November 2026, 15:57 UTC`."""
    moment = datetime.fromisoformat(text)
    return f"{moment.day} {moment:%B %Y, %H:%M} {moment.tzname() or ''}".rstrip()


def race_title(name: str) -> str:
    """`Great Britain 2023` of `great-britain-2023`."""
    return " ".join(word[:1].upper() + word[1:] for word in name.split("-"))
