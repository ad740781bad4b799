"""What a pit wall believes of every car's form and set, from the rows of the race's state that follow lap times."""

import numpy as np
from numpy.typing import NDArray

from rsrl.simulator import Figures, prior_belief
from rsrl.simulator import layout as at
from rsrl.simulator.futures import B_PACE, B_PACE_SD, B_STINT, B_STINT_BY_PACE, B_STINT_SD
from rsrl.simulator.pace_watch import LEAST_VARIANCE


def belief_of_state(figures: Figures, f: NDArray[np.float32]) -> NDArray[np.float32]:
    """Belief float32 [B_ROWS, 20] of a race's state f [F_ROWS, 20], as `simulator.run_on` reads it.

    The exact posterior of form (normal about 0, variance form_sd^2) and set luck (stint_sd^2), given laps whose surprise is their sum plus
    noise: its means are the rows F_FORM and F_LUCK (`simulator.pace_watch`), its variances follow from how many laps each set has shown.
    A state in which nobody watched gives the prior.
    """
    form = figures.cars[at.C_FORM].astype(np.float64) ** 2
    luck = np.full(at.CARS, float(figures.track[at.T_STINT]) ** 2)
    noise = figures.cars[at.C_NOISE].astype(np.float64) ** 2
    laps = f[at.F_SHOWN_LAPS].astype(np.float64)
    form = 1.0 / (1.0 / np.maximum(form, LEAST_VARIANCE) + f[at.F_FORM_WEIGHT]) * (form > 0)  # by the sets before
    shown = laps > 0
    total = np.maximum(form + luck + noise / np.where(shown, laps, 1.0), LEAST_VARIANCE)
    gain = np.where(shown, 1.0 / total, 0.0)
    form_sd = np.sqrt(np.maximum(form - form * form * gain, 0.0))
    by_form = np.divide(-form * luck * gain, form_sd, out=np.zeros(at.CARS), where=form_sd > 0)
    belief = prior_belief(figures)
    belief[B_PACE] = figures.cars[at.C_PACE] + f[at.F_FORM]
    belief[B_PACE_SD] = form_sd
    belief[B_STINT] = f[at.F_LUCK]
    belief[B_STINT_BY_PACE] = by_form
    belief[B_STINT_SD] = np.sqrt(np.maximum(luck - luck * luck * gain - by_form**2, 0.0))
    return belief
