"""Reactive rivals of a record as small tables: the parts of the log-odds that depend on tyres and laps alone, computed before the race.

With them a lap costs a car three look-ups; `rivals.py` adds the traffic and the stops around it.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rsrl.errors import RsrlError
from rsrl.season import CHOICE_FEATURES, HAZARD_FEATURES, LIFE_NAMES, Figure, RaceRecord
from rsrl.season import rival_features as features

FloatArray = NDArray[np.float32]
NEVER: Final = -100.0
"""Log-odds of boxing on a set too young for anyone to change."""

SINGLES: Final = (
    "one_compound", "near_ahead", "near_behind", "ahead_stopped", "behind_stopped", "window_open", "mate_stopped",
    "sc_first", "sc_second", "sc_later", "vsc_first", "vsc_later", "sc_one_compound", "vsc_one_compound",
)  # fmt: skip
(
    ONE_COMPOUND, NEAR_AHEAD, NEAR_BEHIND, AHEAD_STOPPED, BEHIND_STOPPED, WINDOW_OPEN, MATE_STOPPED,
    SC_FIRST, SC_SECOND, SC_LATER, VSC_FIRST, VSC_LATER, SC_ONE_COMPOUND, VSC_ONE_COMPOUND, NEAR_MOST, STOPS_MOST,
) = range(len(SINGLES) + 2)  # fmt: skip

# columns of `RivalTables.extra` and of `RivalTables.whole`
SAME, SECOND, LIFE_SPREAD, STOP_LOSS, YOUNGEST = range(5)
W_LAPS, W_LIMIT, W_STOPS_ASKED = range(3)


class RivalTables(NamedTuple):
    """Log-odds and utilities; all empty where the record has no reactive rivals.

    Attributes:
        age: log-odds by laps on the set at the end of the lap, flat [3 track status x 4 stops made x 3 compounds x (laps + 1)].
        left: log-odds by track status and laps left after the lap, [3, laps + 1].
        reach: log-odds by laps on the set at the flag without another stop, flat [2 first or later stint x 3 compounds x (2 x laps + 1)].
        singles: coefficients of `SINGLES`, then the most that cars near, and stops of the last lap, can add.
        choice: utility of a compound by laps left, [3, laps + 1].
        extra: utility of the compound coming off (SAME) and of a second compound where the rules still require one (SECOND); spread of
            the logarithm of `use`, the race's factor on laps run (LIFE_SPREAD); usual loss of a stop on a racing lap, s (STOP_LOSS);
            laps below which nobody changes any set on a racing lap (YOUNGEST).
        whole: laps of the race (W_LAPS), laps allowed on a set, 0 for no limit (W_LIMIT), `stops_asked` of the record (W_STOPS_ASKED).
        mates: [CARS] index of the team's other car, -1 none.
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
    whole = np.array([record.laps, record.max_laps_per_set, record.stops_asked], np.int32)
    if not rivals.hazard:
        flat, square = np.zeros(0, np.float32), np.zeros((0, 0), np.float32)
        return RivalTables(flat, square, flat, flat, square, flat, whole, mates)
    hazard = _values(rivals.hazard, HAZARD_FEATURES, f"{record.name}: rivals.hazard")
    choice = _values(rivals.choice, CHOICE_FEATURES, f"{record.name}: rivals.choice")
    named = _values(rivals.life_laps, LIFE_NAMES, f"{record.name}: rivals.life_laps")
    stint_laps = np.array([named[n] for n in LIFE_NAMES]).reshape(2, 3)
    laps = record.laps
    left = np.arange(laps + 1) / stint_laps[1].max()
    green_left = _curve(hazard, "left", features.LEFT_KNOTS, left)
    ages = [_age_table(hazard, stint_laps, laps, status).reshape(-1, laps + 1) for status in ("green", "vsc", "sc")]
    slow_left = [green_left + _curve(hazard, f"{status}_left", features.SLOW_LEFT_KNOTS, left) for status in ("vsc", "sc")]
    usual = (choice["usual_soft"], choice["usual_medium"], choice["usual_hard"])
    worth = [
        u + _curve(choice, "left", features.CHOICE_LEFT_KNOTS, np.arange(laps + 1) / n) for u, n in zip(usual, stint_laps[1], strict=True)
    ]
    spread = min(f.se / f.value for f in rivals.life_laps.values())
    return RivalTables(
        age=_table(np.concatenate(ages).ravel()),
        left=_table([green_left, *slow_left]),
        reach=_table(_curve(hazard, "reach", features.REACH_KNOTS, np.arange(2 * laps + 1) / stint_laps.reshape(6, 1)).ravel()),
        singles=_table([*(hazard[n] for n in SINGLES), *_most(hazard)]),
        choice=_table(worth),
        extra=_table([choice["same"], choice["second_compound"], spread, stop_loss_s, features.AGE_KNOTS[0] * stint_laps.min()]),
        whole=whole,
        mates=mates,
    )


def _table(values: ArrayLike) -> FloatArray:
    return np.ascontiguousarray(values, np.float32)


def _most(hazard: dict[str, float]) -> tuple[float, float]:
    """The most that cars near, and that stops of the last lap, can add to the log-odds."""
    above = {name: max(value, 0.0) for name, value in hazard.items()}
    stops = features.MOST_STOPPED * (above["ahead_stopped"] + above["behind_stopped"])
    return above["near_ahead"] + above["near_behind"], stops + above["window_open"] + above["mate_stopped"]


def _age_table(hazard: dict[str, float], stint_laps: NDArray[np.float64], laps: int, status: str) -> NDArray[np.float64]:
    table = np.empty((features.STOPS_LEVELS, 3, laps + 1))
    for made in range(features.STOPS_LEVELS):
        for compound in range(3):
            x = np.arange(laps + 1) / stint_laps[min(made, 1), compound]
            logit = hazard[f"stops_{made}"] + hazard[f"age_{made}"] * np.minimum(x, features.AGE_CAP)
            logit += (hazard["soft"], 0.0, hazard["hard"])[compound]
            if status == "green":
                logit = np.where(x < features.AGE_KNOTS[0], NEVER, logit + _curve(hazard, "green_age", features.AGE_KNOTS, x))
            else:
                logit += _curve(hazard, f"{status}_age", features.SLOW_AGE_KNOTS, x)
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
