"""Features of real decisions, as the compiled race computes them (`season.rival_features` names them)."""

import numpy as np
import polars as pl
from numpy.typing import NDArray

from rsrl.season import GREEN, SC, VSC
from rsrl.season.rival_features import (
    AGE_CAP,
    AGE_KNOTS,
    CHOICE_LEFT_KNOTS,
    LEFT_KNOTS,
    MOST_STOPPED,
    NEAR_S,
    REACH_KNOTS,
    SLOW_AGE_KNOTS,
    SLOW_LEFT_KNOTS,
    STOPS_LEVELS,
    WINDOW_CARS,
)

Matrix = NDArray[np.float64]


def pieces(values: Matrix, knots: tuple[float, ...]) -> Matrix:
    """Piecewise-linear features, [n, len(knots) - 1]."""
    return np.stack([np.clip(values - a, 0.0, b - a) for a, b in zip(knots, knots[1:], strict=False)], axis=1)


def numbers(rows: pl.DataFrame, name: str) -> Matrix:
    """A column as float64."""
    return rows[name].cast(pl.Float64).to_numpy()


def one_compound(rows: pl.DataFrame) -> Matrix:
    """1 where the car has run on one dry compound only."""
    used = rows["used"].to_numpy()
    return ((used & (used - 1)) == 0).astype(np.float64)


def usual_stint(rows: pl.DataFrame, stint_laps: Matrix) -> Matrix:
    """Usual stint on the set each car has, laps, [n]. `stint_laps` [n, 2, 3]: first and later stints by compound."""
    later = (rows["made"].to_numpy() > 0).astype(np.int64)
    picked: Matrix = stint_laps[np.arange(rows.height), later, rows["compound"].to_numpy()]
    return picked


def is_young(rows: pl.DataFrame, stint_laps: Matrix) -> NDArray[np.bool_]:
    """On a racing lap with a set so new that only damage takes it off."""
    young: NDArray[np.bool_] = (rows["status"].to_numpy() == GREEN) & (
        (numbers(rows, "age") + 1) / usual_stint(rows, stint_laps) < AGE_KNOTS[0]
    )
    return young


def hazard_features(rows: pl.DataFrame, stint_laps: Matrix) -> Matrix:
    """`HAZARD_FEATURES` of decisions, [n, features]."""
    age, left_laps = numbers(rows, "age") + 1, numbers(rows, "laps_left")
    life = usual_stint(rows, stint_laps)
    x, reach, left = age / life, (age + left_laps) / life, left_laps / stint_laps[:, 1].max(axis=1)
    status, since = rows["status"].to_numpy(), rows["since"].to_numpy()
    green, sc, vsc = (np.asarray(status == s, np.float64) for s in (GREEN, SC, VSC))
    one = one_compound(rows)
    compound = rows["compound"].to_numpy()
    made = np.minimum(rows["made"].to_numpy(), STOPS_LEVELS - 1)
    levels = np.asarray(made[:, None] == np.arange(STOPS_LEVELS), np.float64)
    singles = [
        one,
        compound == 0,
        compound == 2,
        green * np.clip(1 - numbers(rows, "gap_ahead_s") / NEAR_S, 0, 1),
        green * np.clip(1 - numbers(rows, "gap_behind_s") / NEAR_S, 0, 1),
        green * np.minimum(numbers(rows, "ahead_stopped"), MOST_STOPPED),
        green * np.minimum(numbers(rows, "behind_stopped"), MOST_STOPPED),
        green * np.minimum(numbers(rows, "stopped") / WINDOW_CARS, 1),
        green * numbers(rows, "mate_stopped"),
        sc * (since == 0),
        sc * (since == 1),
        sc * (since > 1),
        vsc * (since == 0),
        vsc * (since > 0),
    ]
    slow_age, slow_left = pieces(x, SLOW_AGE_KNOTS), pieces(left, SLOW_LEFT_KNOTS)
    return np.hstack(
        [
            levels,
            levels * np.minimum(x, AGE_CAP)[:, None],
            green[:, None] * pieces(x, AGE_KNOTS),
            pieces(left, LEFT_KNOTS),
            pieces(reach, REACH_KNOTS),
            np.stack(singles, axis=1),
            sc[:, None] * slow_age,
            vsc[:, None] * slow_age,
            sc[:, None] * slow_left,
            vsc[:, None] * slow_left,
            (sc * one)[:, None],
            (vsc * one)[:, None],
        ]
    )


def choice_features(rows: pl.DataFrame, stint_laps: Matrix) -> Matrix:
    """`CHOICE_FEATURES` of every compound at a stop, [n, 3, features]."""
    n = rows.height
    same = np.asarray(rows["compound"].to_numpy()[:, None] == np.arange(3), np.float64)
    new = np.asarray((rows["used"].to_numpy()[:, None] >> np.arange(3)) & 1 == 0, np.float64)
    left = numbers(rows, "laps_left")[:, None] / stint_laps[:, 1]
    shape = pieces(left.ravel(), CHOICE_LEFT_KNOTS).reshape(n, 3, -1)
    usual = np.broadcast_to(np.eye(3), (n, 3, 3))
    return np.concatenate([usual, shape, same[:, :, None], (new * one_compound(rows)[:, None])[:, :, None]], axis=2)
