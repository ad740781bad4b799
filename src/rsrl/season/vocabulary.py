"""Names every package shares: tyre compounds, track status, Grands Prix and the points table."""

from typing import Final

COMPOUNDS: Final = ("S", "M", "H")
"""Dry compounds by colour, softest first; a compound's index in this tuple is its code everywhere."""

COMPOUND_NAMES: Final = ("soft", "medium", "hard")

GREEN, VSC, SC, RED = 0, 1, 2, 3
"""Codes of the track status of a lap: racing, virtual safety car, full safety car, red flag."""

TRACK_STATUS_NAMES: Final = ("none", "virtual", "full", "red")

POINTS: Final = (25, 18, 15, 12, 10, 8, 6, 4, 2, 1)
"""Points for P1 to P10 (FIA sporting regulations; fastest-lap point left out, as in the paper)."""

FIELD_SIZE: Final = 20
"""Cars of a full field until 2025: shares by place and axes of places run so far, further for a larger field only."""

MAX_CARS: Final = 24
"""Cars that a race may have; two at least. The compiled race has as many slots, and a smaller field leaves the last ones empty."""

FEWEST_SETS: Final = 2
"""Sets that a car uses in a dry race: the rules ask for two compounds."""

FOLLOWING_AIDS: Final = ("drs", "overtake", "none")
"""What the rules give a car close behind another: DRS until 2025, from 2026 the overtake mode (more electric power), or nothing."""

GRAND_PRIX: Final = (
    "abu-dhabi", "australia", "austria", "azerbaijan", "bahrain", "belgium", "brazil", "canada", "china",
    "eifel", "emilia-romagna", "france", "germany", "great-britain", "hungary", "italy", "japan", "las-vegas",
    "mexico", "miami", "monaco", "netherlands", "portugal", "qatar", "russia", "sakhir", "saudi-arabia",
    "singapore", "spain", "styria", "turkey", "tuscany", "united-states", "seventieth-anniversary",
)  # fmt: skip
"""Grands Prix of 2018-2024, the categories of the paper's one-hot track; order is part of the feature schema. Any other is none of them."""
