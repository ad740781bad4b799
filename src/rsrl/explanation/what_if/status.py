"""The same moment with another track status: "if a safety car came out now"."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rsrl.environment.kernels import observe_race, write_legal
from rsrl.errors import RsrlError
from rsrl.explanation.moment import Arrays, Moment
from rsrl.season import GREEN, SC, VSC
from rsrl.simulator import layout as at
from rsrl.state import RAW_SIZE, Observer


def under_status(moment: Moment, status: int, observer: Observer | None = None) -> Moment:
    """The moment, had the track status of the coming lap just become `status`: 0 green, 1 virtual safety car, 2 safety car.

    How long it lasts is drawn with every future. A safety car that may turn out to be a red flag is not told from one that does not.

    Args:
        observer: of the race and car, where one is at hand.

    Raises:
        RsrlError: another status, or before lap 2: no safety car comes out on the grid.
    """
    if status not in (GREEN, VSC, SC):
        raise RsrlError(f"track status {status} cannot be asked for; 0 green, 1 virtual safety car, 2 safety car")
    if moment.lap < 2:
        raise RsrlError("no safety car comes out before lap 1; ask about lap 2 or a later one")
    r = moment.arrays[2].copy()
    r[at.R_STATUS], r[at.R_SINCE], r[at.R_RESTART] = status, 0, 0
    r[at.R_LEFT] = 0 if status == GREEN else 1
    return reobserved(moment, (*moment.arrays[:2], r), observer or Observer(moment.record, moment.car))


def reobserved(moment: Moment, arrays: Arrays, observer: Observer) -> Moment:
    """The moment with other arrays: its last observation and legal calls are made from them."""
    raw, legal = moment.raw.copy(), np.zeros(4, np.bool_)
    raw[-1] = observed(arrays, observer)
    write_legal(observer.figures.whole, arrays[1], arrays[2], moment.car, legal)
    return replace(moment, raw=raw, legal=legal, arrays=arrays, seed=None, race=None)


def observed(arrays: Arrays, observer: Observer) -> NDArray[np.float32]:
    """Raw row float32 [RAW_SIZE] of a race's arrays."""
    row = np.zeros(RAW_SIZE, np.float32)
    observe_race(observer.figures, row, *arrays, observer.car, observer.context)
    return row
