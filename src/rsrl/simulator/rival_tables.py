"""A record's reactive rivals as small tables: the parts of a call that depend on tyres and laps alone, worked out once a race.

With them a lap costs a car three look-ups; `rivals.py` adds what goes on around it.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rsrl.errors import RsrlError
from rsrl.season import CHOICE_FEATURES, HAZARD_FEATURES, LIFE_NAMES, Figure, RaceRecord
from rsrl.season.rival_features import (
    AGE_CAP,
    AGE_KNOTS,
    CHOICE_LEFT_KNOTS,
    LEFT_KNOTS,
    MOST_STOPPED,
    REACH_KNOTS,
    SLOW_AGE_KNOTS,
    SLOW_LEFT_KNOTS,
    STOPS_LEVELS,
)

FloatArray = NDArray[np.float32]
NEVER: Final = -100.0
"""Log-odds of a set nobody takes off."""

SINGLES: Final = (
    "one_compound", "near_ahead", "near_behind", "ahead_stopped", "behind_stopped", "window_open", "mate_stopped",
    "sc_first", "sc_second", "sc_later", "vsc_first", "vsc_later", "sc_one_compound", "vsc_one_compound",
)  # fmt: skip
(
    ONE_COMPOUND, NEAR_AHEAD, NEAR_BEHIND, AHEAD_STOPPED, BEHIND_STOPPED, WINDOW_OPEN, MATE_STOPPED,
    SC_FIRST, SC_SECOND, SC_LATER, VSC_FIRST, VSC_LATER, SC_ONE_COMPOUND, VSC_ONE_COMPOUND, NEAR_MOST, STIR_MOST,
) = range(len(SINGLES) + 2)  # fmt: skip


SAME, SECOND, LIFE_SPREAD, STOP_LOSS, YOUNGEST = range(5)
T_LAPS, T_LIMIT = range(2)


class RivalTables(NamedTuple):
    """Log-odds and utilities; all empty where the record has no reactive rivals.

    Attributes:
        age: flat [3 track status x 4 stops made x 3 compounds x (laps + 1)] by laps on the set at the end of the lap.
        left: [3, laps + 1] by laps left after the lap.
        reach: flat [2 first or later stint x 3 compounds x (2 x laps + 1)] by laps on the set at the flag without a stop.
        singles: coefficients of `SINGLES`, then the most that cars near and stops of the last lap can add.
        choice: [3, laps + 1] utility of a compound by laps left.
        extra: utility of the compound coming off, of the second one the rules ask for, and how far off the usual stints may be
            in a race, the same for all its cars: the spread of their logarithm; then the usual loss of a stop on a racing lap, s;
            laps below which nobody takes any set off on a racing lap.
        whole: laps of the race, laps allowed on a set.
        mates: [20] index of the team's other car, -1 none.
    """

    age: FloatArray
    left: FloatArray
    reach: FloatArray
    singles: FloatArray
    choice: FloatArray
    extra: FloatArray
    whole: NDArray[np.int32]
    mates: NDArray[np.int32]


def rival_tables(record: RaceRecord, mates: NDArray[np.int32], stop_loss_s: float) -> RivalTables:
    """Tables of a record; `stop_loss_s` is the usual loss of a stop on a racing lap.

    Raises:
        RsrlError: a coefficient or a usual stint is missing or unknown.
    """
    rivals = record.rivals
    whole = np.array([record.laps, record.max_laps_per_set], np.int32)
    if not rivals.hazard:
        flat, square = np.zeros(0, np.float32), np.zeros((0, 0), np.float32)
        return RivalTables(flat, square, flat, flat, square, flat, whole, mates)
    hazard = _values(rivals.hazard, HAZARD_FEATURES, f"{record.name}: rivals.hazard")
    choice = _values(rivals.choice, CHOICE_FEATURES, f"{record.name}: rivals.choice")
    named = _values(rivals.life_laps, LIFE_NAMES, f"{record.name}: rivals.life_laps")
    lives = np.array([named[n] for n in LIFE_NAMES]).reshape(2, 3)
    laps = record.laps
    left = np.arange(laps + 1) / lives[1].max()
    green_left = _curve(hazard, "left", LEFT_KNOTS, left)
    ages = [_age_table(hazard, lives, laps, status).reshape(-1, laps + 1) for status in ("green", "vsc", "sc")]
    slow_left = [green_left + _curve(hazard, f"{status}_left", SLOW_LEFT_KNOTS, left) for status in ("vsc", "sc")]
    usual = (choice["usual_soft"], choice["usual_medium"], choice["usual_hard"])
    worth = [u + _curve(choice, "left", CHOICE_LEFT_KNOTS, np.arange(laps + 1) / n) for u, n in zip(usual, lives[1], strict=True)]
    spread = min(f.se / f.value for f in rivals.life_laps.values())
    return RivalTables(
        age=_table(np.concatenate(ages).ravel()),
        left=_table([green_left, *slow_left]),
        reach=_table(_curve(hazard, "reach", REACH_KNOTS, np.arange(2 * laps + 1) / lives.reshape(6, 1)).ravel()),
        singles=_table([*(hazard[n] for n in SINGLES), *_most(hazard)]),
        choice=_table(worth),
        extra=_table([choice["same"], choice["second_compound"], spread, stop_loss_s, AGE_KNOTS[0] * lives.min()]),
        whole=whole,
        mates=mates,
    )


def _table(values: ArrayLike) -> FloatArray:
    return np.ascontiguousarray(values, np.float32)


def _most(hazard: dict[str, float]) -> tuple[float, float]:
    """The most that cars near, and that stops of the last lap, can add to the log-odds."""
    above = {name: max(value, 0.0) for name, value in hazard.items()}
    stops = MOST_STOPPED * (above["ahead_stopped"] + above["behind_stopped"])
    return above["near_ahead"] + above["near_behind"], stops + above["window_open"] + above["mate_stopped"]


def _age_table(hazard: dict[str, float], lives: NDArray[np.float64], laps: int, status: str) -> NDArray[np.float64]:
    table = np.empty((STOPS_LEVELS, 3, laps + 1))
    for made in range(STOPS_LEVELS):
        for compound in range(3):
            x = np.arange(laps + 1) / lives[min(made, 1), compound]
            logit = hazard[f"stops_{made}"] + hazard[f"age_{made}"] * np.minimum(x, AGE_CAP)
            logit += (hazard["soft"], 0.0, hazard["hard"])[compound]
            if status == "green":
                logit = np.where(x < AGE_KNOTS[0], NEVER, logit + _curve(hazard, "green_age", AGE_KNOTS, x))
            else:
                logit += _curve(hazard, f"{status}_age", SLOW_AGE_KNOTS, x)
            table[made, compound] = logit
    return table


def _curve(values: dict[str, float], name: str, knots: tuple[float, ...], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sum of a piecewise-linear feature's parts."""
    total = np.zeros_like(x, np.float64)
    for low, high in zip(knots, knots[1:], strict=False):
        total += values[f"{name}_to_{round(100 * high)}"] * np.clip(x - low, 0.0, high - low)
    return total


def _values(figures: dict[str, Figure], names: tuple[str, ...], where: str) -> dict[str, float]:
    if set(figures) != set(names):
        odd = sorted(set(figures) ^ set(names))[0]
        raise RsrlError(f"{where} has {'an unknown' if odd in figures else 'no'} figure {odd!r}; it needs {', '.join(names)}")
    return {name: figures[name].value for name in names}
