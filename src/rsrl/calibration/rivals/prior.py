"""Prior of the rivals' decisions: what the dry races of 2018-2021 say, so that a few races of a new season are enough to go on.

Made by `fit_logistic` and `fit_choice` on those four seasons' 1,736 stops with centre zero and precision 0.1. The precisions were chosen in
2022 and 2023 by the log-loss of decisions in races not fitted. Per stop, hazard then choice, against a ridge of 0.1 about zero: 3.18 and
0.93 against 3.21 and 0.93 (2023 from 2022), 3.07 and 1.06 against 3.19 and 1.05 (2022 from 2023); from the first three races of a season
3.38 and 1.08 against 4.30 and 1.06 (2022), 3.40 and 1.18 against 4.21 and 1.29 (2023).
"""

from typing import Final

import numpy as np

HAZARD: Final = np.array([
    -5.43, -3.97, -4.95, -7.59,  # stops made: 0, 1, 2, three or more
    -3.14, -0.06, -0.82,  # stops still to come, by `STILL_TO_COME`
    0.87, 0.07, 1.65, 0.98,  # age of the set; by stops still to come
    4.14, 1.66, 4.27, 0.14, -1.02, 0.54,  # then `HAZARD_FEATURES` from green_age_to_60 on
    5.48, -0.47, 0.52, -0.41,
    -2.70, 2.90, 0.06,
    0.37, 0.23, 0.06, -0.23, 0.79, -0.01, 1.20, 0.76, 0.73,
    3.17, 2.22, 0.48, 1.55, 0.16,
    5.79, 0.87, -2.76, 6.54, 1.07, -5.05,
    0.24, -0.96, 2.01, -3.03,
    0.70, 2.44,
])  # fmt: skip
"""Coefficients of `hazard_design`."""

HAZARD_PRECISION: Final = 10.0

CHOICE: Final = np.array([0.33, -1.32, 2.24, 11.84, 1.09, -6.20, -4.44, -2.09, -1.03, 1.74])
"""Coefficients of `choice_design`."""

CHOICE_PRECISION: Final = 1.0

SPREAD: Final = (0.24, 20)
"""Spread of green stops about the usual stint, as a share of it, and how many stops that counts as."""
