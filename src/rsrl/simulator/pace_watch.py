"""What lap times show of every car's pace, compiled: the form of the day, and the luck of the set it is on.

A car's laps differ from what the season's figures expect by its form, which stays, by the luck of its present set, drawn anew at
every stop, and by noise. A pit wall hears all of it in the lap times that show a car's own pace: racing laps without a stop, a
change of place, or another car right ahead. The rows kept are the exact posterior of form and luck under normal laws.
"""

import numpy as np

from rsrl.compiled import kernel
from rsrl.simulator import layout as at

ZERO, ONE = np.float32(0.0), np.float32(1.0)
HELD_S = np.float32(0.05)  # a lap that ends within so much of the least gap was not the car's own
MOST_S = np.float32(1.5)  # what is further from the expected is a mistake or a blue flag
LEAST_VARIANCE = np.float32(1.0e-6)


@kernel(inline="always")
def note_places(k):
    """Remember the places at the start of the lap, in the scratch row K_BITS, which the lap no longer needs."""
    for car in range(at.CARS):
        k[at.K_BITS, car] = k[at.K_PLACE, car]


@kernel(inline="always")
def expected_lap_s(fig, f, k, r, car):
    """What the figures expect of a racing lap just driven, beyond the race's reference lap: car, tyre, dirty air, DRS."""
    t = fig.track
    wear = f[at.F_WEAR, car] - ONE
    c = k[at.K_COMPOUND, car]
    gap = f[at.F_GAP, car]
    worn = wear * (fig.tyres[c, at.Y_LINEAR] + wear * fig.tyres[c, at.Y_QUADRATIC])
    expected = fig.cars[at.C_PACE, car] + fig.tyres[c, at.Y_OFFSET] + worn
    expected += max(t[at.T_DIRTY] * (ONE - gap / t[at.T_DIRTY_WINDOW]), ZERO)
    return expected - (t[at.T_DRS] if r[at.R_NO_DRS] == 0 and gap < t[at.T_DRS_WINDOW] else ZERO)


@kernel(inline="always")
def watch_pace(fig, f, k, r, reference):
    """Take in a racing lap of every car; `reference` is the race's reference lap. Call it once the order is known."""
    held = fig.track[at.T_FOLLOW] + HELD_S
    ahead = -MOST_S
    for p in range(r[at.R_RUNNING]):
        car = k[at.K_ORDER, p]
        here = f[at.F_TIME, car]
        alone = p == 0 or here - ahead > held
        ahead = here
        if alone and k[at.K_BITS, car] == p and k[at.K_STOPPED, car] == 0 and (k[at.K_AGE, car] > 1 or k[at.K_STOPS, car] == 0):
            surprise = f[at.F_LAP, car] - reference - expected_lap_s(fig, f, k, r, car)
            if abs(surprise) < MOST_S:
                f[at.F_SHOWN_SUM, car] += surprise
                f[at.F_SHOWN_LAPS, car] += ONE
                believe(fig, f, car)


@kernel(inline="always")
def believe(fig, f, car):
    """F_FORM and F_LUCK: posterior means from the sets before and the laps on this one."""
    form = fig.cars[at.C_FORM, car] * fig.cars[at.C_FORM, car]
    luck = fig.track[at.T_STINT] * fig.track[at.T_STINT]
    noise = fig.cars[at.C_NOISE, car] * fig.cars[at.C_NOISE, car]
    precision = ONE / max(form, LEAST_VARIANCE) + f[at.F_FORM_WEIGHT, car]
    before = f[at.F_FORM_SUM, car] / precision
    n = f[at.F_SHOWN_LAPS, car]
    f[at.F_FORM, car], f[at.F_LUCK, car] = before, ZERO
    if n > ZERO:
        surprise = f[at.F_SHOWN_SUM, car] / n - before
        total = max(ONE / precision + luck + noise / n, LEAST_VARIANCE)
        f[at.F_FORM, car] += surprise / (precision * total)
        f[at.F_LUCK, car] = surprise * luck / total


@kernel(inline="always")
def change_set(fig, f, car):
    """A new set: what the old one showed speaks of the form alone."""
    n = f[at.F_SHOWN_LAPS, car]
    if n > ZERO:
        luck = fig.track[at.T_STINT] * fig.track[at.T_STINT]
        variance = max(luck + fig.cars[at.C_NOISE, car] * fig.cars[at.C_NOISE, car] / n, LEAST_VARIANCE)
        f[at.F_FORM_WEIGHT, car] += ONE / variance
        f[at.F_FORM_SUM, car] += f[at.F_SHOWN_SUM, car] / n / variance
    f[at.F_SHOWN_SUM, car], f[at.F_SHOWN_LAPS, car] = ZERO, ZERO
    believe(fig, f, car)
