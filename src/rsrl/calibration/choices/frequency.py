"""The baseline `frequency`: how often each sequence was run at a circuit in earlier seasons, shrunk to how often it was run anywhere."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from rsrl.calibration.choices.parameters import NEW_RULES, OLD_WEIGHT
from rsrl.calibration.choices.sequences import SEQUENCES

if TYPE_CHECKING:
    from rsrl.calibration.choices.arrays import Setting
    from rsrl.calibration.choices.observed import RaceChoices

ANYWHERE_CARS: Final = 6.0  # what the frequencies of all circuits count for
EVERY_SEQUENCE: Final = 0.1  # cars, so that no sequence is impossible


def log_frequencies(setting: "Setting", history: "Sequence[RaceChoices]") -> NDArray[np.float64]:
    """Log share of every sequence, float64 [sequences], from the clean races of `history` in seasons before the race's own."""
    here, anywhere = np.zeros(len(SEQUENCES)), np.full(len(SEQUENCES), EVERY_SEQUENCE)
    seen = False
    for race in history:
        if race.key.season >= setting.season or not race.clean:
            continue
        seen = True
        weight = 1.0 if race.key.season >= NEW_RULES or setting.season < NEW_RULES else OLD_WEIGHT
        run = weight * np.bincount([c.sequence for c in race.cars if c.own], minlength=len(SEQUENCES))
        anywhere += run
        if race.key.circuit == setting.circuit:
            here += run
    if not seen:
        return np.full(len(SEQUENCES), -np.log(len(SEQUENCES)))
    share = here + ANYWHERE_CARS * anywhere / anywhere.sum()
    return np.asarray(np.log(share / share.sum()))
