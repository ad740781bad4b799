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
"""Cars in every compiled race; a smaller real field leaves the last slots as non-starters."""

GRAND_PRIX: Final = (
    "abu-dhabi", "australia", "austria", "azerbaijan", "bahrain", "belgium", "brazil", "canada", "china",
    "eifel", "emilia-romagna", "france", "germany", "great-britain", "hungary", "italy", "japan", "las-vegas",
    "mexico", "miami", "monaco", "netherlands", "portugal", "qatar", "russia", "sakhir", "saudi-arabia",
    "singapore", "spain", "styria", "turkey", "tuscany", "united-states", "seventieth-anniversary",
)  # fmt: skip
"""Grands Prix of 2018-2024, the categories of the paper's one-hot track; order is part of the feature schema."""

EVENT_SLUGS: Final = {
    "70th Anniversary Grand Prix": "seventieth-anniversary",
    "Abu Dhabi Grand Prix": "abu-dhabi",
    "Australian Grand Prix": "australia",
    "Austrian Grand Prix": "austria",
    "Azerbaijan Grand Prix": "azerbaijan",
    "Bahrain Grand Prix": "bahrain",
    "Belgian Grand Prix": "belgium",
    "Brazilian Grand Prix": "brazil",
    "British Grand Prix": "great-britain",
    "Canadian Grand Prix": "canada",
    "Chinese Grand Prix": "china",
    "Dutch Grand Prix": "netherlands",
    "Eifel Grand Prix": "eifel",
    "Emilia Romagna Grand Prix": "emilia-romagna",
    "French Grand Prix": "france",
    "German Grand Prix": "germany",
    "Hungarian Grand Prix": "hungary",
    "Italian Grand Prix": "italy",
    "Japanese Grand Prix": "japan",
    "Las Vegas Grand Prix": "las-vegas",
    "Mexican Grand Prix": "mexico",
    "Mexico City Grand Prix": "mexico",
    "Miami Grand Prix": "miami",
    "Monaco Grand Prix": "monaco",
    "Portuguese Grand Prix": "portugal",
    "Qatar Grand Prix": "qatar",
    "Russian Grand Prix": "russia",
    "Sakhir Grand Prix": "sakhir",
    "Saudi Arabian Grand Prix": "saudi-arabia",
    "Singapore Grand Prix": "singapore",
    "Spanish Grand Prix": "spain",
    "Styrian Grand Prix": "styria",
    "São Paulo Grand Prix": "brazil",
    "Turkish Grand Prix": "turkey",
    "Tuscan Grand Prix": "tuscany",
    "United States Grand Prix": "united-states",
}
"""Event name in the lap files to the first part of a race's name."""
