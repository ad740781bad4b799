"""Colours that every figure shares, those of matplotlib and those of the report alike."""

from typing import Final

from rsrl.season import RED, SC, VSC

INK: Final = "#1b1f24"
FAINT: Final = "#d4d8dd"
SOFT: Final = "#6b7480"
"""Lines and words of less weight."""

COMPOUND_COLOURS: Final = ("#c8281c", "#ffd12e", "#f6f6f4")
"""Soft red, medium yellow, hard white, as on the tyres; dark to bright, so that they differ in grey too. The letter stands with them."""

COMPOUND_INKS: Final = ("#ffffff", INK, INK)
"""Of the letter on each compound's colour."""

CALL_COLOURS: Final = (FAINT, *COMPOUND_COLOURS)
"""Of a call: stay out, then the stop for each compound."""

CALL_INKS: Final = (INK, *COMPOUND_INKS)
"""Of words on each call's colour."""

SERIES_COLOURS: Final = ("#12406b", "#c06a10", "#6b7480", "#2e8b6e", "#8a3b7a", "#8a5a2b", "#1793a8")
"""Of strategists, agents or modes, in their order; the first is the model's. Brightness differs between neighbours."""

STATUS_COLOURS: Final = {VSC: "#fff3c4", SC: "#ffe08a", RED: "#f4c1bb"}
"""Of bands behind a race, by track status; green laps have none."""

VERDICT_COLOURS: Final = {
    "better": "#2e8b6e",
    "worse": "#c8281c",
    "equal": "#12406b",
    "undecided": SOFT,
    "itself": INK,
}
"""Of an option against the policy's call."""

PART_COLOURS: Final = ("#c8281c", "#12406b", "#c06a10", "#8a3b7a")
"""Of what race time is made of: pit stops, tyres, traffic, safety cars."""

CALL_BAND: Final = "#e3f1eb"
"""Behind a row or cell in which a call stands out."""
