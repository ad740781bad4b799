"""The clean-air outlook: what each call costs to the flag with the track to oneself, by dynamic programming.

Lap by lap from the flag back: the least remaining time from (laps done, compound, tyre age, whether two compounds
were used), with stops at the green pit loss, no stop on the last lap, and no lap beyond what a set may run. It knows nothing of the
sets left, of traffic and of what is random; a policy weighs those. Later stops are for the freshest set that a car began with.
"""

import numpy as np
from numpy.typing import NDArray

from rsrl.compiled import kernel
from rsrl.season import GREEN, RED
from rsrl.simulator import layout as at
from rsrl.simulator.figures import Figures

IMPOSSIBLE_S = np.float32(1.0e5)  # a finish on one compound, or a lap beyond what a set may run


def outlook_table(figures: Figures, stop_s: float, car: int) -> NDArray[np.float32]:
    """Least remaining time in s beyond the reference laps, float32 [laps + 1, 2, 3, laps + 1].

    Indices: laps done, two compounds used, compound, tyre age in laps (beyond the distance: as at the distance).
    `stop_s`: expected loss of a green stop; `car`: whose sets they are.
    """
    laps = int(figures.whole[at.I_LAPS])
    table = np.zeros((laps + 1, 2, 3, laps + 1), np.float32)
    table[laps, 0] = IMPOSSIBLE_S
    fresh = np.ascontiguousarray(figures.laps_before[:, 0, car])
    _fill(figures.tyres, np.float32(stop_s), int(figures.whole[at.I_MAX_LAPS_PER_SET]), fresh, table)
    return table


def expected_stop_s(figures: Figures, car: int, status: int = GREEN) -> float:
    """Mean loss of a stop of a car under a track status, s, without waiting for the team's other car; 0 under a red flag."""
    if status == RED:
        return 0.0
    return float(figures.track[at.T_PIT + status] + figures.cars[at.C_STOP, car] + figures.tail.mean() * figures.cars[at.C_TAIL, car])


@kernel()
def lap_cost(tyres, compound, age):
    """Part of a lap time that is due to the tyre, s."""
    wear = np.float32(age)
    return tyres[compound, at.Y_OFFSET] + wear * (tyres[compound, at.Y_LINEAR] + wear * tyres[compound, at.Y_QUADRATIC])


@kernel()
def _fill(tyres, stop_s, max_laps_per_set, fresh, table):
    laps = table.shape[0] - 1
    for lap in range(laps - 1, -1, -1):
        for valid in range(2):
            for compound in range(3):
                for age in range(laps + 1):
                    if max_laps_per_set > 0 and age >= max_laps_per_set:
                        table[lap, valid, compound, age] = IMPOSSIBLE_S
                        continue
                    best = table[lap + 1, valid, compound, min(age + 1, laps)]
                    if lap + 1 < laps:
                        for new in range(3):
                            used = 1 if valid == 1 or new != compound else 0
                            best = min(best, stop_s + tyres[new, at.Y_COLD] + table[lap + 1, used, new, fresh[new]])
                    table[lap, valid, compound, age] = lap_cost(tyres, compound, age) + best
