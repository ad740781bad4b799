"""The plans that a search simulates: a grid over those that are quick in clean air, then neighbours of the best."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from rsrl.errors import RsrlError
from rsrl.season import RaceRecord
from rsrl.simulator import Plan, check_plan
from rsrl.strategists.plan_search.clean_air import PlanFamily

SC_WINDOWS: Final = (0, 3, 6, 9, 12, 16, 20, 25, 30)
VSC_WINDOWS: Final = (0, 2, 4, 6, 9, 12, 16, 20)
"""Safety-car windows that are tried, laps."""

INITIAL_WINDOWS: Final = ((6, 2), (12, 6), (20, 12))
"""Windows (SC, VSC) that the first plans get, in turn."""


def grid_of_plans(families: Sequence[PlanFamily], max_loss_s: float, max_plans: int) -> list[Plan]:
    """At most `max_plans` plans that lose no more than `max_loss_s` to the quickest in clean air, quickest first.

    Each compound sequence contributes its quickest plan and those whose stops lie whole multiples of a step of laps away from it; the step
    is the smallest that leaves no more than `max_plans` plans.
    """
    limit = min(float(f.time_s.min()) for f in families) + max_loss_s
    near = [(f, f.time_s <= limit, f.laps - f.laps[f.time_s.argmin()]) for f in families]
    step = 1
    while sum(int((kept & (offset % step == 0).all(axis=1)).sum()) for _, kept, offset in near) > max_plans:
        step += 1
    plans = []
    for family, kept, offset in near:
        for i in np.flatnonzero(kept & (offset % step == 0).all(axis=1)):
            plans.append((float(family.time_s[i]), Plan(family.compounds, tuple(int(lap) for lap in family.laps[i]))))
    return [plan for _, plan in sorted(plans)][:max_plans]


def with_initial_windows(plans: Sequence[Plan]) -> list[Plan]:
    """The plans with initial safety-car windows."""
    windows = [INITIAL_WINDOWS[i % len(INITIAL_WINDOWS)] for i in range(len(plans))]
    return [replace(plan, sc_window_laps=sc, vsc_window_laps=vsc) for plan, (sc, vsc) in zip(plans, windows, strict=True)]


def neighbours(plan: Plan, record: RaceRecord, car: int, move_laps: int, sc_rule: bool) -> Iterator[Plan]:
    """Legal plans one move away: one stop or all stops `move_laps` earlier or later, or a safety-car window one step wider or narrower."""
    for move in (-move_laps, move_laps):
        moved = {tuple(lap + move * (i in stops) for i, lap in enumerate(plan.laps)) for stops in _moved_stops(plan.stops)}
        for laps in sorted(moved):
            if is_legal(shifted := replace(plan, laps=laps), record, car):
                yield shifted
    if sc_rule:
        for step in (-1, 1):
            yield replace(plan, sc_window_laps=_stepped(SC_WINDOWS, plan.sc_window_laps, step))
            yield replace(plan, vsc_window_laps=_stepped(VSC_WINDOWS, plan.vsc_window_laps, step))


def _moved_stops(stops: int) -> Iterator[tuple[int, ...]]:
    yield from ((i,) for i in range(stops))
    yield tuple(range(stops))


def _stepped(windows: tuple[int, ...], value: int, step: int) -> int:
    return windows[min(max(windows.index(value) + step, 0), len(windows) - 1)]


def is_legal(plan: Plan, record: RaceRecord, car: int) -> bool:
    """Whether a plan of a car keeps to the rules of the race."""
    try:
        check_plan(plan, record, car)
    except RsrlError:
        return False
    return True
