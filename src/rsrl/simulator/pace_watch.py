"""What lap times show of every car's pace, compiled: the form of the day, and the luck of the set it is on.

A car's laps differ from what the season's figures expect by its form, which stays, by the luck of its present set, drawn anew at
every stop, and by noise. A pit wall hears all of it in the lap times that show a car's own pace: racing laps without a stop, a
change of place, or another car right ahead. The rows kept are the exact posterior of form and luck under normal laws.
"""

import numpy as np

from rsrl.compiled import kernel
from rsrl.simulator.layout import (
    C_FORM,
    C_NOISE,
    C_PACE,
    CARS,
    F_FORM,
    F_FORM_SUM,
    F_FORM_WEIGHT,
    F_GAP,
    F_LAP,
    F_LUCK,
    F_SHOWN_LAPS,
    F_SHOWN_SUM,
    F_TIME,
    F_WEAR,
    K_AGE,
    K_BITS,
    K_COMPOUND,
    K_ORDER,
    K_PLACE,
    K_STOPPED,
    K_STOPS,
    R_NO_DRS,
    R_RUNNING,
    T_DIRTY,
    T_DIRTY_WINDOW,
    T_DRS,
    T_DRS_WINDOW,
    T_FOLLOW,
    T_STINT,
    Y_LINEAR,
    Y_OFFSET,
    Y_QUADRATIC,
)

ZERO, ONE = np.float32(0.0), np.float32(1.0)
HELD_S = np.float32(0.05)  # a lap that ends within so much of the least gap was not the car's own
MOST_S = np.float32(1.5)  # what is further from the expected is a mistake or a blue flag
LEAST_VARIANCE = np.float32(1.0e-6)


@kernel(inline="always")
def note_places(k):  # type: ignore[no-untyped-def]
    """Remember the places at the start of the lap, in the scratch row K_BITS, which the lap no longer needs."""
    for car in range(CARS):
        k[K_BITS, car] = k[K_PLACE, car]


@kernel(inline="always")
def expected_lap_s(fig, f, k, r, car):  # type: ignore[no-untyped-def]
    """What the figures expect of a racing lap just driven, beyond the race's reference lap: car, tyre, dirty air, DRS."""
    t = fig.track
    wear = f[F_WEAR, car] - ONE
    c = k[K_COMPOUND, car]
    gap = f[F_GAP, car]
    expected = fig.cars[C_PACE, car] + fig.tyres[c, Y_OFFSET] + wear * (fig.tyres[c, Y_LINEAR] + wear * fig.tyres[c, Y_QUADRATIC])
    expected += max(t[T_DIRTY] * (ONE - gap / t[T_DIRTY_WINDOW]), ZERO)
    return expected - (t[T_DRS] if r[R_NO_DRS] == 0 and gap < t[T_DRS_WINDOW] else ZERO)


@kernel(inline="always")
def watch_pace(fig, f, k, r, reference):  # type: ignore[no-untyped-def]
    """Take in a racing lap of every car; `reference` is the race's reference lap. Call it once the order is known."""
    held = fig.track[T_FOLLOW] + HELD_S
    ahead = -MOST_S
    for p in range(r[R_RUNNING]):
        car = k[K_ORDER, p]
        here = f[F_TIME, car]
        alone = p == 0 or here - ahead > held
        ahead = here
        if alone and k[K_BITS, car] == p and k[K_STOPPED, car] == 0 and (k[K_AGE, car] > 1 or k[K_STOPS, car] == 0):
            surprise = f[F_LAP, car] - reference - expected_lap_s(fig, f, k, r, car)
            if abs(surprise) < MOST_S:
                f[F_SHOWN_SUM, car] += surprise
                f[F_SHOWN_LAPS, car] += ONE
                believe(fig, f, car)


@kernel(inline="always")
def believe(fig, f, car):  # type: ignore[no-untyped-def]
    """F_FORM and F_LUCK: posterior means from the sets before and the laps on this one."""
    form = fig.cars[C_FORM, car] * fig.cars[C_FORM, car]
    luck = fig.track[T_STINT] * fig.track[T_STINT]
    noise = fig.cars[C_NOISE, car] * fig.cars[C_NOISE, car]
    precision = ONE / max(form, LEAST_VARIANCE) + f[F_FORM_WEIGHT, car]
    before = f[F_FORM_SUM, car] / precision
    n = f[F_SHOWN_LAPS, car]
    f[F_FORM, car], f[F_LUCK, car] = before, ZERO
    if n > ZERO:
        surprise = f[F_SHOWN_SUM, car] / n - before
        total = max(ONE / precision + luck + noise / n, LEAST_VARIANCE)
        f[F_FORM, car] += surprise / (precision * total)
        f[F_LUCK, car] = surprise * luck / total


@kernel(inline="always")
def change_set(fig, f, car):  # type: ignore[no-untyped-def]
    """A new set: what the old one showed speaks of the form alone."""
    n = f[F_SHOWN_LAPS, car]
    if n > ZERO:
        luck = fig.track[T_STINT] * fig.track[T_STINT]
        variance = max(luck + fig.cars[C_NOISE, car] * fig.cars[C_NOISE, car] / n, LEAST_VARIANCE)
        f[F_FORM_WEIGHT, car] += ONE / variance
        f[F_FORM_SUM, car] += f[F_SHOWN_SUM, car] / n / variance
    f[F_SHOWN_SUM, car], f[F_SHOWN_LAPS, car] = ZERO, ZERO
    believe(fig, f, car)
