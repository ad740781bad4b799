"""Columns of explanations as people read them, on a page and on a terminal alike: a head, and one way to write the numbers of each."""

from collections.abc import Callable
from typing import Any, Final, NamedTuple

from rsrl.report.numbers import MINUS, MISSING, percent, place, signed, three, whole
from rsrl.season import COMPOUND_NAMES

CALLS: Final = {"no pit": "stay out"} | {f"pit {name}": f"box for {name}" for name in COMPOUND_NAMES}
"""Calls by their names in JSON, as a pit wall says them."""

SHARE_UNIT: Final = "share of states"


class Column(NamedTuple):
    """How a column reads: its head, how its entries are written, and whether they are words, to be aligned as such."""

    head: str
    write: Callable[[Any], str]
    words: bool = False


def call(name: str) -> str:
    """A call in words."""
    return CALLS.get(name, name)


def amount(value: float | None, unit: str, *, sign: bool = True) -> str:
    """A value in the unit of its explanation: places and the like with two decimals, shares as percent."""
    if value is None:
        return MISSING
    text = _signed_percent(value) if unit == SHARE_UNIT else signed(value)
    return text if sign else text.lstrip("+")


def entry(value: Any) -> str:
    """An entry of a column of which nothing is known, whatever JSON has there."""
    if value is None:
        return MISSING
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return three(value)
    if isinstance(value, int):
        return whole(value)
    if isinstance(value, list):
        return " to ".join(entry(part) for part in value) if len(value) == 2 else ", ".join(entry(part) for part in value)
    return call(str(value))


def tenths(value: float) -> str:
    """Seconds, or a mean of places or laps: `1.2`."""
    return f"{value:.1f}" if value >= 0 or abs(value) < 0.05 else f"{MINUS}{-value:.1f}"


def signed_tenths(value: float) -> str:
    """A difference in seconds: `+1.2`; nil has no sign."""
    text = f"{abs(value):.1f}"
    return text if not float(text) else ("+" if value > 0 else MINUS) + text


def _signed_percent(value: float) -> str:
    text = percent(abs(value))
    return text if text.startswith("0 ") else ("+" if value > 0 else MINUS) + text


def _verdict(value: str) -> str:
    return "its call" if value == "itself" else value


def _or_missing(write: Callable[[Any], str]) -> Callable[[Any], str]:
    return lambda value: MISSING if value is None else write(value)


_NUMBERS: Final[dict[str, tuple[str, Callable[[Any], str]]]] = {
    "mean_position": ("mean place", place),
    "points": ("points", signed),
    "chance_gain": ("better", percent),
    "chance_lose": ("worse", percent),
    "stop_lap": ("boxes on lap", tenths),
    "rejoin_place": ("rejoins in place", tenths),
    "rejoin_gap_ahead_s": ("gap ahead, s", tenths),
    "rejoin_gap_behind_s": ("gap behind, s", tenths),
    "time_s": ("in all", signed_tenths),
    "pit_s": ("stops", signed_tenths),
    "tyre_s": ("tyres", signed_tenths),
    "traffic_s": ("traffic", signed_tenths),
    "safety_car_s": ("safety cars", signed_tenths),
    "for_a_stop": ("best stop over staying out", signed),
    "position": ("place", entry),
    "tyre_age_laps": ("tyre age, laps", entry),
}

_WORDS: Final[dict[str, tuple[str, Callable[[Any], str]]]] = {
    "verdict": ("verdict", _verdict),
    "call": ("call", call),
    "tyre": ("tyre", str),
    "status": ("track", str),
    "mattered": ("why it mattered", str),
    "value_here": ("here", str),
    "value_reference": ("compared with", str),
    "here": ("here", str),
    "condition": ("condition", str),
    "from": ("from", entry),
    "to": ("to", entry),
    "unit": ("unit", str),
}

_KNOWN: Final = {name: Column(head, _or_missing(write)) for name, (head, write) in _NUMBERS.items()} | {
    name: Column(head, _or_missing(write), True) for name, (head, write) in _WORDS.items()
}


def column(name: str) -> Column:
    """The column of a name of JSON; one that is not known reads as it is."""
    return _KNOWN.get(name) or Column(name.replace("_", " "), entry)
