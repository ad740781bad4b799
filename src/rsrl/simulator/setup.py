"""How races are set up: the options that all ways of running them share, and who decides when each car stops."""

from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple, TypedDict

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.season import RaceRecord
from rsrl.simulator import layout as at
from rsrl.simulator.figures import Figures, compile_figures
from rsrl.simulator.plans import Plan, check_plan, plan_table
from rsrl.simulator.script import Script

Rivals = Literal["reactive", "plans"]
"""How cars without a plan of their own decide their stops: lap by lap as teams did, or by a plan drawn from those that teams ran."""


class RaceOptions(TypedDict, total=False):
    """Keyword arguments that `simulate`, `lap_means` and `trace_races` share.

    Attributes:
        plans: plans of some cars, by car index; they replace the script's.
        script: incidents, retirements and stops happen as in the script (script.py).
        rivals: how cars without a plan decide; None for `reactive` where the record has the figures, else `plans`.
        as_dry: run a wet race as if it had been dry.
        first_race: number of the first race of the seed.
    """

    plans: Mapping[int, Plan] | None
    script: Script | None
    rivals: Rivals | None
    as_dry: bool
    first_race: int


class RaceSetup(NamedTuple):
    """What races of one record start from."""

    figures: Figures
    plans: dict[int, Plan]  # by car index
    rivals: Rivals | None
    numbers: NDArray[np.int64]  # [races] race numbers of the seed


def set_up(
    record: RaceRecord,
    races: int,
    *,
    plans: Mapping[int, Plan] | None = None,
    script: Script | None = None,
    rivals: Rivals | None = None,
    as_dry: bool = False,
    first_race: int = 0,
) -> RaceSetup:
    """Compile the figures and merge the plans; arguments as of `RaceOptions`.

    A script is history, so its plans are not checked; plans of `plans` must keep the rules.

    Raises:
        RsrlError: no races, a wet race, a plan that breaks the rules, a script that does not fit.
    """
    if races < 1:
        raise RsrlError(f"races is {races}; ask for one at least")
    figures = compile_figures(record, script=script, as_dry=as_dry)
    for car, plan in (plans or {}).items():
        check_plan(plan, record, car)
    merged = {**(script.plans if script else {}), **(plans or {})}
    return RaceSetup(figures, merged, rivals, np.arange(first_race, first_race + races, dtype=np.int64))


def rival_code(figures: Figures, rivals: Rivals | None = None) -> int:
    """Caller code of the rivals; None: reactive where the record has the figures.

    Raises:
        RsrlError: reactive rivals are asked for and the record has no figures for them, or no such kind of rivals.
    """
    if rivals == "reactive" and not len(figures.rivals.age):
        raise RsrlError("reactive rivals: the season file has no rivals.hazard; take rivals with plans")
    if rivals not in (None, "reactive", "plans"):
        raise RsrlError(f"unknown rivals {rivals!r}; there are reactive, plans")
    reactive = rivals == "reactive" or (rivals is None and len(figures.rivals.age) > 0)
    return at.IMITATION if reactive else at.RIVAL


def assign_callers(
    figures: Figures, plans: Mapping[int, Plan], *, outside: Sequence[int] = (), rivals: Rivals | None = None
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Plan table int32 [plans, P_COLUMNS], the rivals' rows first, and who decides each car's stops: caller codes int32 [CARS].

    Args:
        plans: plans of some cars, by car index.
        outside: cars whose actions come from outside, lap by lap.
        rivals: how the other cars decide.

    Raises:
        RsrlError: as `rival_code`, or a car that drives to a drawn plan has the sets for none.
    """
    table = np.concatenate([figures.rival_plans, plan_table(list(plans.values()))])
    callers = np.full(at.CARS, rival_code(figures, rivals), np.int32)
    callers[list(outside)] = at.OUTSIDE
    for offset, car in enumerate(plans):
        callers[car] = len(figures.rival_plans) + offset
    for car in np.flatnonzero(callers[: figures.whole[at.I_CARS]] == at.RIVAL):
        if not _has_sets_for_a_plan(figures, int(car)):
            raise RsrlError(f"rivals with plans: car {car + 1} on the grid has the sets for none; take reactive rivals or more sets")
    return table, callers


def _has_sets_for_a_plan(figures: Figures, car: int) -> bool:
    sets = figures.sets[:, car]
    for row in figures.rival_plans:
        fitted = [row[at.P_START], *row[at.P_FIRST + 1 : at.P_FIRST + 2 * row[at.P_STOPS] : 2]]
        if (np.bincount(fitted, minlength=3) <= sets).all():
            return True
    return False
