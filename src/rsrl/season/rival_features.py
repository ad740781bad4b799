"""Features of a reactive rival's decision: their names, order and knots, shared by the fit and by the compiled race.

The log-odds of boxing at the end of a lap are a sum of coefficients times features, one value a lap and car. `x`: laps on the set at the
end of this lap over its usual stint; `left`: laps left after this one over the longest usual later stint; `reach`: laps on the set at
the flag without another stop over its usual stint. A feature `<what>_to_<n>` is piecewise linear: the part of `what` between the
previous knot and n hundredths. Features of other cars count on racing laps only.
"""

from typing import Final

AGE_KNOTS: Final = (0.35, 0.6, 0.8, 0.95, 1.1, 1.3, 1.7)
"""Of `x` on racing laps; below the first knot a set is young and nobody is called in."""

LEFT_KNOTS: Final = (0.0, 0.5, 0.8, 1.1, 1.5)
REACH_KNOTS: Final = (0.6, 0.9, 1.2, 1.8)
SLOW_AGE_KNOTS: Final = (0.05, 0.4, 0.7, 1.0)
SLOW_LEFT_KNOTS: Final = (0.0, 0.3, 1.0)
CHOICE_LEFT_KNOTS: Final = (0.0, 0.5, 0.8, 1.0, 1.3, 1.8)

AGE_CAP: Final = 1.2
"""Largest value of x in `age_<stops>`."""

NEAR_S: Final = 3.0
"""A car within this gap counts, fading linearly."""

UNDERCUT_S: Final = 5.0
"""A car that has just stopped threatens an undercut, or is to be covered, if it was within this gap before its stop."""

MOST_STOPPED: Final = 2
"""Largest number of such cars that count."""

WINDOW_CARS: Final = 5.0
"""With this many cars in on one lap the pit window is fully open."""


def _pieces(name: str, knots: tuple[float, ...]) -> tuple[str, ...]:
    return tuple(f"{name}_to_{round(100 * k)}" for k in knots[1:])


STOPS_LEVELS: Final = 4
"""Stops made: 0, 1, 2, three or more; these coefficients carry how many stops the race usually takes."""

HAZARD_FEATURES: Final[tuple[str, ...]] = (
    *(f"stops_{m}" for m in range(STOPS_LEVELS)),
    *(f"age_{m}" for m in range(STOPS_LEVELS)),
    *_pieces("green_age", AGE_KNOTS),
    *_pieces("left", LEFT_KNOTS),
    *_pieces("reach", REACH_KNOTS),
    "one_compound",
    "soft",
    "hard",
    "near_ahead",
    "near_behind",
    "ahead_stopped",
    "behind_stopped",
    "window_open",
    "mate_stopped",
    "sc_first",
    "sc_second",
    "sc_later",
    "vsc_first",
    "vsc_later",
    *_pieces("sc_age", SLOW_AGE_KNOTS),
    *_pieces("vsc_age", SLOW_AGE_KNOTS),
    *_pieces("sc_left", SLOW_LEFT_KNOTS),
    *_pieces("vsc_left", SLOW_LEFT_KNOTS),
    "sc_one_compound",
    "vsc_one_compound",
)
"""Coefficients of the log-odds of boxing at the end of a lap."""

CHOICE_FEATURES: Final[tuple[str, ...]] = (
    "usual_soft",
    "usual_medium",
    "usual_hard",
    *_pieces("left", CHOICE_LEFT_KNOTS),
    "same",
    "second_compound",
)
"""Coefficients of the utility of a compound at a stop: how usual it is here, laps left over its usual later stint, whether it is the
compound coming off, and whether it is the second compound that the rules require."""

LIFE_NAMES: Final[tuple[str, ...]] = ("S", "M", "H", "S2", "M2", "H2")
"""Usual stints in laps: of a race's first stint by compound, then of later ones."""
