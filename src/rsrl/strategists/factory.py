"""Strategists by name."""

from collections.abc import Callable
from typing import Final

from rsrl.errors import RsrlError
from rsrl.season import RaceRecord
from rsrl.strategists.interface import Strategist
from rsrl.strategists.planned import FixedStrategist

STRATEGISTS: Final[dict[str, Callable[..., Strategist]]] = {
    "fixed": FixedStrategist,
}
"""Makers of the strategists that need no model, by name; called as maker(record, car, seed)."""


def make_strategist(name: str, record: RaceRecord, car: int, *, seed: int = 0) -> Strategist:
    """A strategist by name for one car of a race. `seed` names its own luck, never a race.

    Raises:
        RsrlError: unknown name.
    """
    if name not in STRATEGISTS:
        raise RsrlError(f"unknown strategist {name!r}; there are {', '.join(STRATEGISTS)}")
    return STRATEGISTS[name](record, car, seed)
