"""The options of a what-if: box now for each compound, stay out and box some laps later, and the policy's own call."""

import numpy as np
from numpy.typing import NDArray

from rsrl.environment.kernels import write_legal
from rsrl.errors import RsrlError
from rsrl.explanation.moment import Moment
from rsrl.explanation.policy import AnyPolicy
from rsrl.rollouts import Option
from rsrl.season import COMPOUND_NAMES
from rsrl.simulator import compile_figures
from rsrl.simulator import layout as at

MOST_LAPS = 30


def options_at(policy: AnyPolicy, moment: Moment, horizon_laps: int) -> tuple[Option, ...]:
    """The options, the policy's own call first.

    A later stop is for the compound that the policy prefers now, among those that may be fitted then.

    Raises:
        RsrlError: a horizon below 0 or beyond MOST_LAPS.
    """
    if not 0 <= horizon_laps <= MOST_LAPS:
        raise RsrlError(f"horizon_laps is {horizon_laps}; it must be 0 to {MOST_LAPS}")
    own = Option(0, policy.call(moment))
    options = [own, *(Option(0, call) for call in range(4) if moment.legal[call])]
    legal = legal_if_out(moment, horizon_laps)
    for ahead in range(1, len(legal)):
        stops = [call for call in (1, 2, 3) if legal[ahead, call]]
        if stops:
            options.append(Option(ahead, policy.preferred(moment, stops)))
    return tuple(dict.fromkeys(options))


def legal_if_out(moment: Moment, horizon_laps: int) -> NDArray[np.bool_]:
    """Legal calls of this lap and of the laps after, as long as the car may stay out: bool [laps, 4].

    Staying out changes only the lap and the age of the set, so no lap need be simulated.
    """
    figures = compile_figures(moment.record)
    rows = []
    for ahead in range(min(horizon_laps, moment.record.laps - moment.lap) + 1):
        k, r, legal = moment.arrays[1].copy(), moment.arrays[2].copy(), np.zeros(4, np.bool_)
        r[at.R_LAP] += ahead
        k[at.K_AGE, moment.car] += ahead
        write_legal(figures.whole, k, r, moment.car, legal)
        rows.append(legal)
        if not legal[0]:
            break
    return np.stack(rows)


def label(option: Option) -> str:
    """An option as people say it."""
    if option.call == 0:
        return "stay out"
    when = "now" if option.offset == 0 else "in 1 lap" if option.offset == 1 else f"in {option.offset} laps"
    return f"box {when} for {COMPOUND_NAMES[option.call - 1]}"


def doing(option: Option) -> str:
    """An option as the subject of a sentence: "boxing in 3 laps for hard"."""
    return "staying out" if option.call == 0 else "boxing" + label(option).removeprefix("box")
