"""What lap times show of every car's pace, compiled: its form of the day, and the random pace of the set it is on.

A car's laps differ from what the season's figures expect by its form, drawn once a race, by the pace of its present set, drawn anew at
every stop (F_LUCK), and by noise, drawn every lap. A pit wall can infer both from the laps that show a car's own pace: racing laps
without a stop, a change of place, or another car right ahead. All three are normal, so the posterior is exact and needs only sums:
with v the variance of the form given the sets before, l that of a set's pace and s squared that of the noise, a mean surprise x over n
laps has the variance v + l + s^2 / n about the form's mean b, and the posterior means are b + (x - b) v / (v + l + s^2 / n) for the
form and (x - b) l / (v + l + s^2 / n) for the set (Bayes' rule for normal laws). Cars are inferred one by one: where team mates share
form (C_TEAM_FORM), what the other car's laps say of it is not used.
"""

import numpy as np

from rsrl.compiled import kernel
from rsrl.simulator import layout as at
from rsrl.simulator.tyres import stint_laps

ZERO, ONE = np.float32(0.0), np.float32(1.0)
HELD_S = np.float32(0.05)  # a lap that ends this close to the following gap was not the car's own
MOST_S = np.float32(1.5)  # a larger surprise is a mistake or a blue flag, not pace
LEAST_VARIANCE = np.float32(1.0e-6)


@kernel(inline=True)
def note_places(k):
    """Remember the places at the start of the lap, in the scratch row K_BITS, which the lap no longer needs."""
    for car in range(at.CARS):
        k[at.K_BITS, car] = k[at.K_PLACE, car]


@kernel(inline=True)
def expected_lap_s(fig, f, k, r, car):
    """What the figures expect of the racing lap just driven, s, relative to the reference lap: car, tyre, dirty air, DRS."""
    # means only: the random pace of set and form is what the surprise is to show, so F_OFFSET and F_PACE, which hold it, are not read
    t = fig.track
    wear = f[at.F_WEAR, car] - ONE  # the lap just driven has been added already
    c = k[at.K_COMPOUND, car]
    gap = f[at.F_GAP, car]
    worn = wear * (fig.tyres[c, at.Y_LINEAR] + wear * fig.tyres[c, at.Y_QUADRATIC])
    expected = fig.cars[at.C_PACE, car] + fig.tyres[c, at.Y_OFFSET] + worn
    expected += max(t[at.T_DIRTY] * (ONE - gap / t[at.T_DIRTY_WINDOW]), ZERO)
    return expected - (t[at.T_DRS] if r[at.R_NO_DRS] == 0 and gap < t[at.T_DRS_WINDOW] else ZERO)


@kernel(inline=True)
def observe_lap(fig, f, k, r, reference):
    """Update every car's posterior with a racing lap. `reference`: the reference lap, s. Call it once the new order is known."""
    held = fig.track[at.T_FOLLOW] + HELD_S
    ahead = -MOST_S
    for p in range(r[at.R_RUNNING]):
        car = k[at.K_ORDER, p]
        here = f[at.F_TIME, car]
        alone = p == 0 or here - ahead > held
        ahead = here
        # an out-lap (the first on a set after a stop) has cold tyres and part of the stop's loss in it
        if alone and k[at.K_BITS, car] == p and k[at.K_STOPPED, car] == 0 and (stint_laps(k, car) > 1 or k[at.K_STOPS, car] == 0):
            learn_from_lap(fig, f, k, r, car, reference)


@kernel(inline=True)
def learn_from_lap(fig, f, k, r, car, reference):
    """Update a car's posterior with a racing lap that nothing but its own pace can have decided, unless the surprise is too large."""
    surprise = f[at.F_LAP, car] - reference - expected_lap_s(fig, f, k, r, car)
    if abs(surprise) < MOST_S:
        f[at.F_SHOWN_SUM, car] += surprise
        f[at.F_SHOWN_LAPS, car] += ONE
        update_posterior(fig, f, car)


@kernel(inline=True)
def update_posterior(fig, f, car):
    """F_FORM and F_LUCK: posterior means from the sets before and the laps on this one."""
    form = fig.cars[at.C_FORM, car] * fig.cars[at.C_FORM, car]
    luck = fig.track[at.T_STINT] * fig.track[at.T_STINT]
    noise = fig.cars[at.C_NOISE, car] * fig.cars[at.C_NOISE, car]
    # of the form before this set: the prior's precision and that of the earlier sets add up
    precision = ONE / max(form, LEAST_VARIANCE) + f[at.F_FORM_WEIGHT, car]
    before = f[at.F_FORM_SUM, car] / precision
    n = f[at.F_SHOWN_LAPS, car]
    # a surprise is shared between form and set in proportion to their variances
    f[at.F_FORM, car], f[at.F_LUCK, car] = before, ZERO
    if n > ZERO:
        surprise = f[at.F_SHOWN_SUM, car] / n - before
        total = max(ONE / precision + luck + noise / n, LEAST_VARIANCE)
        f[at.F_FORM, car] += surprise / (precision * total)
        f[at.F_LUCK, car] = surprise * luck / total


@kernel(inline=True)
def start_new_set(fig, f, car):
    """A new set: the laps on the old one now count as one measurement of the form, the old set's pace being part of its error."""
    n = f[at.F_SHOWN_LAPS, car]
    if n > ZERO:
        luck = fig.track[at.T_STINT] * fig.track[at.T_STINT]
        variance = max(luck + fig.cars[at.C_NOISE, car] * fig.cars[at.C_NOISE, car] / n, LEAST_VARIANCE)
        f[at.F_FORM_WEIGHT, car] += ONE / variance
        f[at.F_FORM_SUM, car] += f[at.F_SHOWN_SUM, car] / n / variance
    f[at.F_SHOWN_SUM, car], f[at.F_SHOWN_LAPS, car] = ZERO, ZERO
    update_posterior(fig, f, car)
