"""Rules that differ between races and seasons, and nominations that no table given has: facts, each with its source.

Every rule ends up in the season file, where it can be changed; a race that is not listed here has the usual rules.
"""

from typing import Final, NamedTuple

from rsrl.season import FEWEST_SETS, Figure


class RaceRules(NamedTuple):
    """What one race asks of everybody's tyres, beyond two compounds."""

    source: str
    max_laps_per_set: int = 0  # 0: no such rule
    min_sets: int = FEWEST_SETS


USUAL: Final = RaceRules("sporting regulations: two compounds in a dry race")

RULES: Final = {
    (2023, "qatar"): RaceRules("FIA, 8 October 2023: 18 laps a set, for fear of the kerbs' effect on side walls", max_laps_per_set=18),
    (2025, "monaco"): RaceRules("sporting regulations 2025, article 30.5: three sets at least in the race at Monaco", min_sets=3),
    (2025, "qatar"): RaceRules("Pirelli and FIA, November 2025: 25 laps a set at most over the weekend", max_laps_per_set=25),
}
"""Rules by season and Grand Prix."""

FOLLOWING_GAIN: Final = {
    "drs": Figure(0.5, 0.1, 0, "0.46-0.54 s in Heilmeier et al. 2020; not identifiable: cars within 1 s are also held up"),
    "overtake": Figure(0.5, 0.25, 0, "the overtake mode is taken to give what DRS gave: not measured yet"),
    "none": Figure(0.0, 0.0, 0, "no aid for a following car"),
}
"""Gain per lap of a car close behind another, by `season.FOLLOWING_AIDS`."""


def rules_of(season: int, grand_prix: str) -> RaceRules:
    """The rules of a race."""
    return RULES.get((season, grand_prix), USUAL)


def following_aid(season: int) -> str:
    """What a following car may use: DRS from 2011 to 2025, the overtake mode from 2026; `season.FOLLOWING_AIDS` has the names."""
    return "overtake" if season >= 2026 else "drs" if season >= 2011 else "none"


def drs_off_laps(season: int) -> int:
    """Laps without the aid after the start and after a safety car: two until 2023, one from 2024.

    Source: FIA Formula One Sporting Regulations of the season, article on driver adjustable bodywork (DRS). In China 2026 race control
    enabled the overtake mode at the end of lap 1, and on the first racing lap after the safety car.
    """
    return 2 if season <= 2023 else 1


def softest(season: int) -> int:
    """C-number of the softest compound there was in a season: C6 in 2025 only."""
    return 6 if season == 2025 else 5


_HARDEST_IN_2021: Final = {
    1: ("portugal", "spain", "great-britain", "netherlands", "qatar"),
    3: ("monaco", "azerbaijan", "austria", "russia", "abu-dhabi"),
}


def announced(season: int, grand_prix: str) -> dict[str, str]:
    """C-number by colour of a race of 2021, of which no table has the nominations; empty for any other season.

    Source: Pirelli's announcements of 19 February 2021 and, for Austria, Turkey and Qatar, of the races' own (RaceFans, 19 February and
    1 October 2021; f1chronicle.com on the Austrian and Styrian Grands Prix).
    """
    if season != 2021:
        return {}
    hardest = next((c for c, races in _HARDEST_IN_2021.items() if grand_prix in races), 2)
    return {"S": f"C{hardest + 2}", "M": f"C{hardest + 1}", "H": f"C{hardest}"}
