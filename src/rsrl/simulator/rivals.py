"""Rivals that react: what their lap-by-lap decision reads."""

from typing import Final

HAZARD_FEATURES: Final[tuple[str, ...]] = ()
"""Coefficients of the log-odds of boxing at the end of a lap, in the order of `Figures.hazard`."""

CHOICE_FEATURES: Final[tuple[str, ...]] = ()
"""Coefficients of the utility of a compound at a stop, in the order of `Figures.choice`."""
