"""The posterior of form and set luck from laps measured elsewhere, compiled: pace_posterior.py for a race that was not simulated."""

from typing import Final

import numpy as np

from rsrl.compiled import kernel
from rsrl.simulator import layout as at
from rsrl.simulator.lap_time import reference_lap
from rsrl.simulator.pace_posterior import learn_from_lap, start_new_set

# columns of a car's laps, float32: lap; its time and the gap at its beginning, s; wear of the set at its end; compound; and as 0 or 1
# whether there was no following aid, whether it shows the car's own pace, and whether a new set was fitted at its end
L_LAP, L_TIME, L_GAP, L_WEAR, L_COMPOUND, L_NO_AID, L_SHOWS, L_NEW_SET = range(8)
L_COLUMNS: Final = 8


@kernel()
def learn_laps(fig, rows, car, f, k, r):
    """F_FORM and F_LUCK of car `car` from its laps, float32 [n, L_COLUMNS] in order.

    `f`, `k`, `r`: arrays of a race (layout.py), working memory; r and the car's columns of f and k are zero at first.
    """
    for i in range(rows.shape[0]):
        if rows[i, L_SHOWS] > 0:
            f[at.F_LAP, car], f[at.F_GAP, car], f[at.F_WEAR, car] = rows[i, L_TIME], rows[i, L_GAP], rows[i, L_WEAR]
            k[at.K_COMPOUND, car] = np.int32(rows[i, L_COMPOUND])
            r[at.R_NO_DRS] = np.int32(rows[i, L_NO_AID])
            learn_from_lap(fig, f, k, r, car, reference_lap(fig, r, np.int32(rows[i, L_LAP])))
        if rows[i, L_NEW_SET] > 0:
            start_new_set(fig, f, car)
