"""Sets of tyres, compiled: fitting one, what it costs a lap as it wears, sets left, and the rules: sets used, laps a set.

A stop fits the freshest set left of its compound, which may have run laps before the race: its age and wear begin there.
"""

import numpy as np

from rsrl.compiled import kernel
from rsrl.simulator import layout as at
from rsrl.simulator import random as rng


@kernel()
def next_set(sets, left, columns):
    """Which set of a compound a stop fits, 0 for the freshest. `sets` at the start, `left` of them; `columns` of the table to look up."""
    return min(max(sets - left, 0), columns - 1)


@kernel(inline=True)
def laps_on_next_set(fig, k, car, compound):
    """Laps that the freshest set left of a compound has run before the race."""
    n = next_set(fig.sets[compound, car], k[at.K_SOFT_SETS + compound, car], fig.laps_before.shape[1])
    return fig.laps_before[compound, n, car]


@kernel(inline=True)
def stint_laps(k, car):
    """Laps since a car's set was fitted."""
    return k[at.K_AGE, car] - k[at.K_BEFORE, car]


@kernel(inline=True)
def fit_tyre(fig, f, k, car, compound, key0, key1):
    """Fit a set: its figures, wear and age, sets left, compounds used. F_OFFSET holds the set's random pace as well."""
    # Drawn for the car's stint number, not for the lap of the stop: two strategies that stop on different laps are compared on the
    # same draws.
    z = rng.from_table(rng.draw(key0, key1, k[at.K_STOPS, car], car, rng.STINT), rng.NORMAL)
    f[at.F_OFFSET, car] = fig.tyres[compound, at.Y_OFFSET] + z * fig.track[at.T_STINT]
    f[at.F_LINEAR, car] = fig.tyres[compound, at.Y_LINEAR]
    f[at.F_QUADRATIC, car] = fig.tyres[compound, at.Y_QUADRATIC]
    before = laps_on_next_set(fig, k, car, compound)
    f[at.F_WEAR, car] = np.float32(before)
    k[at.K_COMPOUND, car] = compound
    k[at.K_AGE, car] = before
    k[at.K_BEFORE, car] = before
    k[at.K_USED, car] |= 1 << compound  # for the two-compound rule
    k[at.K_SOFT_SETS + compound, car] -= 1


@kernel(inline=True)
def two_used(mask):
    """Whether a bit mask of compounds holds two or more."""
    # clearing the lowest bit leaves nothing where one bit or none was set
    return (mask & (mask - 1)) != 0


@kernel(inline=True)
def stops_owed(whole, k, car):
    """Stops that the rules still ask of a car: for a second compound, and for as many sets as the race asks for."""
    return max(np.int32(not two_used(k[at.K_USED, car])), whole[at.I_STOPS_ASKED] - k[at.K_STOPS, car])


@kernel(inline=True)
def tyre_loss(f, car):
    """What a car's set costs it on the coming lap, s: offset of the compound, cold tyres, and wear, linear and quadratic."""
    wear = f[at.F_WEAR, car]
    return f[at.F_OFFSET, car] + f[at.F_COLD, car] + wear * (f[at.F_LINEAR, car] + wear * f[at.F_QUADRATIC, car])


@kernel(inline=True)
def wear_tyre(f, k, car, wear):
    """A lap on a car's set: `wear` is 1 on a racing lap, less behind a safety car. Its age counts every lap."""
    f[at.F_WEAR, car] += wear
    k[at.K_AGE, car] += 1


@kernel(inline=True)
def spare_set(k, car):
    """The hardest compound a car has a set of, -1 for none."""
    for compound in range(2, -1, -1):
        if k[at.K_SOFT_SETS + compound, car] > 0:
            return compound
    return -1


@kernel(inline=True)
def forced_set(k, car):
    """Compound for a car that must box: the hardest spare one, but one not used yet if it has run on one only; -1 for none."""
    used = k[at.K_USED, car]
    if (used & (used - 1)) == 0:
        for compound in range(2, -1, -1):
            if k[at.K_SOFT_SETS + compound, car] > 0 and (used >> compound) & 1 == 0:
                return compound
    return spare_set(k, car)


@kernel(inline=True)
def worn_out(fig, k, car):
    """Whether a car's set may not run beyond the coming lap."""
    limit = fig.whole[at.I_MAX_LAPS_PER_SET]
    return (limit > 0) & (k[at.K_AGE, car] + 1 >= limit)
