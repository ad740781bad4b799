"""A car's own sets of tyres for a race: how they are written, and what is possible."""

import re
from collections.abc import Mapping
from typing import Final

from rsrl.season.vocabulary import COMPOUNDS

TyreSets = dict[str, tuple[int, ...]]
"""Sets by compound letter: the laps that each has run before the race, the freshest set first."""

MAX_SETS: Final = 20
"""Most sets of one compound; a weekend's allotment is 8 softs, 3 mediums and 2 hards, or 6, 4 and 2 with a sprint."""

MAX_LAPS_BEFORE: Final = 30
"""Most laps that a set may have run before it is fitted. In 2022-2024 it was 25, a set fitted a second time in the race."""

SETS_FORM: Final = "S2M1H2 (sets of soft, medium and hard) or S1S2u3M1H2 (one new soft and two that have run 3 laps)"
_GROUP: Final = re.compile(r"([SMH])(\d{1,2})(?:U(\d{1,2}))?")
_SETS: Final = re.compile(f"(?:{_GROUP.pattern})+")


def read_sets(text: str) -> TyreSets | None:
    """Read sets such as `S1S2u3M1H2`: one new soft, two softs that have run 3 laps, one medium, two hards. None where it does not parse.

    All three compounds must be named; upper or lower case.
    """
    plain = text.strip().upper()
    if not _SETS.fullmatch(plain):
        return None
    found: dict[str, list[int]] = {}
    for letter, count, laps in _GROUP.findall(plain):
        found.setdefault(letter, []).extend([int(laps or 0)] * int(count))
    return {c: tuple(sorted(found[c])) for c in COMPOUNDS} if set(found) == set(COMPOUNDS) else None


def write_sets(sets: Mapping[str, tuple[int, ...]]) -> str:
    """Sets as `read_sets` reads them."""
    return "".join(_group(letter, sets[letter]) for letter in COMPOUNDS)


def _group(letter: str, laps: tuple[int, ...]) -> str:
    kinds = [f"{letter}{laps.count(used)}" + (f"u{used}" if used else "") for used in sorted(set(laps))]
    return "".join(kinds) or f"{letter}0"


def impossible_sets(sets: Mapping[str, tuple[int, ...]], race_laps: int, max_laps_per_set: int) -> str:
    """Why a car cannot have these sets for a race; "" where it can."""
    if set(sets) != set(COMPOUNDS):
        return f"there must be a number of sets for each of {', '.join(COMPOUNDS)}"
    if any(len(laps) > MAX_SETS for laps in sets.values()):
        return f"a car has {MAX_SETS} sets of a compound at most"
    if sum(1 for laps in sets.values() if laps) < 2:
        return "a dry race needs sets of two compounds"
    used = max(max(laps, default=0) for laps in sets.values())
    most = min(MAX_LAPS_BEFORE, race_laps - 1)
    if used > most or min(min(laps, default=0) for laps in sets.values()) < 0:
        return f"a set may have run 0 to {most} laps before the race"
    if used and max_laps_per_set:
        return f"used sets are not supported where a set may run {max_laps_per_set} laps only"
    return ""
