"""The belief that futures are drawn from, read from a single state: what the race's own rows of pace tell of every car.

For a state whose earlier laps are not at hand. A filter that follows the race from its start (`pace_filter`) knows more: its error of a
car's pace is 6 to 12 % smaller.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.rollouts.futures import B_PACE, B_PACE_SD, B_STINT, B_STINT_BY_PACE, B_STINT_SD, prior_belief
from rsrl.simulator import Figures
from rsrl.simulator import layout as at

LEAST_VARIANCE: Final = 1.0e-6
TINY: Final = 1.0e-9


def belief_of(figures: Figures, f: NDArray[np.float32]) -> NDArray[np.float32]:
    """The belief float32 [B_ROWS, CARS] (`rollouts.futures`) of a state's arrays `f` float32 [F_ROWS, CARS].

    Means stand in the rows of pace; variances follow from how many laps those rest on, by the normal laws of `simulator.pace_posterior`.
    """
    belief = prior_belief(figures)
    form, noise = figures.cars[at.C_FORM].astype(np.float64) ** 2, figures.cars[at.C_NOISE].astype(np.float64) ** 2
    luck, laps = float(figures.track[at.T_STINT]) ** 2, f[at.F_SHOWN_LAPS].astype(np.float64)
    before = 1.0 / (1.0 / np.maximum(form, LEAST_VARIANCE) + f[at.F_FORM_WEIGHT]) * (form > 0)  # variance of the form, by the sets before
    shown = np.maximum(before + luck + noise / np.maximum(laps, 1.0), LEAST_VARIANCE)  # of what the present set has shown
    shown[laps == 0] = np.inf
    form_sd = np.sqrt(np.maximum(before - before**2 / shown, 0.0))
    by_form = np.where(form_sd > TINY, -before * luck / shown / np.maximum(form_sd, TINY), 0.0)
    belief[B_PACE] += f[at.F_FORM]
    belief[B_PACE_SD] = form_sd
    belief[B_STINT], belief[B_STINT_BY_PACE] = f[at.F_LUCK], by_form
    belief[B_STINT_SD] = np.sqrt(np.maximum(luck - luck**2 / shown - by_form**2, 0.0))
    return belief
