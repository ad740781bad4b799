"""One drawing style: colours shared by matplotlib and the report, figures made off screen, race traces, and strategies as stint bars."""

from rsrl.drawing.canvas import new_figure, save_figure
from rsrl.drawing.labels import spread
from rsrl.drawing.race_trace import TracePanel, gaps_to_reference, plot_race_trace
from rsrl.drawing.stints import StintBar, pages_of, plot_strategies
from rsrl.drawing.style import (
    CALL_BAND,
    CALL_COLOURS,
    CALL_INKS,
    COMPOUND_COLOURS,
    COMPOUND_INKS,
    FAINT,
    INK,
    PART_COLOURS,
    SERIES_COLOURS,
    STATUS_COLOURS,
    VERDICT_COLOURS,
)
from rsrl.drawing.teams import CarStyle, car_styles, team_colour

__all__ = [
    "CALL_BAND",
    "CALL_COLOURS",
    "CALL_INKS",
    "COMPOUND_COLOURS",
    "COMPOUND_INKS",
    "FAINT",
    "INK",
    "PART_COLOURS",
    "SERIES_COLOURS",
    "STATUS_COLOURS",
    "VERDICT_COLOURS",
    "CarStyle",
    "StintBar",
    "TracePanel",
    "car_styles",
    "gaps_to_reference",
    "new_figure",
    "pages_of",
    "plot_race_trace",
    "plot_strategies",
    "save_figure",
    "spread",
    "team_colour",
]
