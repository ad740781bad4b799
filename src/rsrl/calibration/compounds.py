"""Hardness of Pirelli's compounds over the seasons, and the length of a lap from the number of laps."""

from typing import Final

REFERENCE_KM: Final = 5.2
"""Lap length at which the literature's figures per kg of fuel are taken: near the mean of the calendar."""

RACE_KM: Final = 305.0
SHORT_RACE_KM: Final = 262.0
LONGEST_KM: Final = 7.0  # Spa
SHORT_RACE_LAPS: Final = 76  # Monaco alone has more laps than that, over a shorter distance


def hardness(c_number: str, season: int) -> int:
    """Hardness of a C-number on the ladder of 2023: C0 is 0, higher is softer.

    For 2023 a new C1 came in between the old C1 and C2, and the old C1 became C0 (Pirelli's announcement for 2023), so an
    earlier C1 has hardness 0.
    """
    number = int(c_number[1])
    return 0 if number == 1 and season < 2023 else number


def lap_km(race_laps: int) -> float:
    """Length of a lap: a Grand Prix is the fewest laps beyond 305 km, at Monaco 260 km (sporting regulations).

    Clipped to the longest lap there is, for races that were cut short.
    """
    return min((SHORT_RACE_KM if race_laps > SHORT_RACE_LAPS else RACE_KM + 2.5) / race_laps, LONGEST_KM)
