"""Who calls each car of a race, and the plan table its rows point into."""

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.simulator import layout as at
from rsrl.simulator.figures import Figures
from rsrl.simulator.plans import Plan, plan_table

Rivals = Literal["reactive", "plans"]
"""How cars without a plan of their own call their race: lap by lap as teams did, or by a plan drawn from what teams ran."""


def rival_code(figures: Figures, rivals: Rivals | None = None) -> int:
    """Caller code of the rivals; None: reactive where the record has the figures for it. Raises RsrlError where it has not."""
    if rivals == "reactive" and not len(figures.rivals.age):
        raise RsrlError("reactive rivals: the season file has no rivals.hazard; take rivals with plans")
    if rivals not in (None, "reactive", "plans"):
        raise RsrlError(f"unknown rivals {rivals!r}; there are reactive, plans")
    reactive = rivals == "reactive" or (rivals is None and len(figures.rivals.age) > 0)
    return at.IMITATION if reactive else at.RIVAL


def line_of_callers(
    figures: Figures, plans: Mapping[int, Plan], *, outside: Sequence[int] = (), rivals: Rivals | None = None
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Plan table int32 [plans, P_COLUMNS], the rivals' rows first, and callers int32 [20]."""
    table = np.concatenate([figures.rival_plans, plan_table(list(plans.values()))])
    callers = np.full(at.CARS, rival_code(figures, rivals), np.int32)
    callers[list(outside)] = at.OUTSIDE
    for offset, car in enumerate(plans):
        callers[car] = len(figures.rival_plans) + offset
    return table, callers
