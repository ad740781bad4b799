"""TimingAppData to events: the sets of tyres, as the feed learns of them."""

from collections.abc import Iterator, Mapping
from typing import Any, Final

from rsrl.feeds.events import Event, TyreFitted
from rsrl.feeds.live_timing.values import flag, mapping, whole
from rsrl.laps.schema import COMPOUND_LETTERS, MOST_LAPS

__all__ = ["OldCompounds", "stint_events"]

MOST_STINTS: Final = 30

SOFTEST_FIRST: Final = ("HYPERSOFT", "ULTRASOFT", "SUPERSOFT", "SOFT", "MEDIUM", "HARD", "SUPERHARD")
"""Dry compounds of 2018, seven by name; a race had three of them."""

LAST_OLD_SEASON: Final = 2018


class OldCompounds:
    """Letters of a race of 2018: of the three names it had, the softest is S, the hardest H. None until three have been seen.

    Three names and no more are ranked: a fourth one is a fault of the feed, and then none has a letter.
    """

    def __init__(self) -> None:
        self.seen: set[str] = set()

    def letter(self, name: str) -> str | None:
        """Letter of a name among those seen so far, which it joins."""
        if name in SOFTEST_FIRST:
            self.seen.add(name)
            ranked = sorted(self.seen, key=SOFTEST_FIRST.index)
            return "SMH"[ranked.index(name)] if len(ranked) == 3 else None
        return COMPOUND_LETTERS.get(name)


def stint_events(
    car: int,
    stints: Mapping[str, Any],
    told: dict[tuple[int, int], TyreFitted],
    old: OldCompounds | None,
    time_s: float,
    snapshot: bool,
) -> Iterator[Event]:
    """What is new about the stints of a car.

    Args:
        stints: all that is known of them, by index from "0".
        told: the last event of each car and stint, brought up to date.
        old: what names mean in 2018; None from 2019 on.
        snapshot: they are of the past: when each set was fitted follows from the laps on those before it.

    A stint that is marked as on the tyres before it (`TyresNotChanged`) has no event, the first one apart.
    """
    for index, value in stints.items():
        number = whole(index, MOST_STINTS)
        stint = mapping(value)
        if number is None or not stint or (number and flag(stint.get("TyresNotChanged"))):
            continue
        name = stint.get("Compound")
        letter = None
        if isinstance(name, str):
            letter = old.letter(name.upper()) if old else COMPOUND_LETTERS.get(name.upper())
        fitted_lap = _laps_on(stints, number) if snapshot or not number else None
        event = TyreFitted(time_s, car, number + 1, letter, flag(stint.get("New")), whole(stint.get("StartLaps"), MOST_LAPS), fitted_lap)
        before = told.get((car, number))
        if before is None or (before.compound, before.new, before.laps_before) != (event.compound, event.new, event.laps_before):
            told[car, number] = event
            yield event


def _laps_on(stints: Mapping[str, Any], number: int) -> int | None:
    """Laps of the race on the stints before `number`; None where one of them is not known."""
    laps = 0
    for index in range(number):
        stint = mapping(stints.get(str(index)))
        total, start = whole(stint.get("TotalLaps"), MOST_LAPS), whole(stint.get("StartLaps"), MOST_LAPS)
        if total is None or start is None:
            return None
        laps += total - start
    return laps
