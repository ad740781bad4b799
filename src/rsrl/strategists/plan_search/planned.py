"""Driving to a plan, and the paper's Fixed Strategy baseline, which drives to a published plan drawn for each race."""

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.rollouts.hashing import uniform
from rsrl.season import COMPOUND_NAMES, GREEN, SC, RaceRecord
from rsrl.simulator import Plan, check_plan
from rsrl.simulator import layout as at
from rsrl.strategists.interface import Strategist, column, coming_lap, made_legal, stint_laps
from rsrl.strategists.plan_search.clean_air import CleanAir


class PlannedStrategist(Strategist):
    """Drives to a plan chosen at the start of each race, within the plan's safety-car windows.

    Calls exactly as the compiled simulator does (`simulator.calls`), so a plan finishes here where it finished in the search.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self._plans: Sequence[Plan] = ()
        self._rows = np.zeros(0, np.int64)

    def assign(self, plans: Sequence[Plan], rows: NDArray[np.int64]) -> None:
        """Give race i the plan plans[rows[i]]."""
        stops = max(plan.stops for plan in plans)
        self._plans, self._rows = plans, rows
        self._laps = np.full((len(plans), stops + 1), np.iinfo(np.int32).max, np.int64)
        self._compounds = np.zeros((len(plans), stops + 1), np.int8)
        for i, plan in enumerate(plans):
            self._laps[i, : plan.stops] = plan.laps
            self._compounds[i, : plan.stops] = plan.compounds[1:]
        self._windows = np.array([(0, p.vsc_window_laps, p.sc_window_laps) for p in plans], np.int64)

    def decide(self, environment: RaceEnvironment) -> NDArray[np.int8]:
        """Box where the next planned stop is due, or falls within the window under a safety car."""
        rows = self._rows
        stop = np.minimum(column(environment, "stops_made").astype(np.int64), self._laps.shape[1] - 1)
        ahead = self._laps[rows, stop] - coming_lap(environment)
        status = column(environment, "safety_car").astype(np.int64)
        old_enough = stint_laps(environment) >= at.MIN_STINT_LAPS
        early = (status != GREEN) & (ahead <= self._windows[rows, np.minimum(status, SC)]) & old_enough
        calls = np.where((ahead <= 0) | early, self._compounds[rows, stop] + 1, 0).astype(np.int8)
        return made_legal(calls, environment.legal)


class FixedStrategist(PlannedStrategist):
    """The paper's Fixed Strategy baseline: a random one of the strategies published for the Grand Prix.

    The simulator draws the starting tyre, and the plan is drawn among those published strategies that start on it. Where none does, any
    published strategy is drawn and its first compound replaced; if that breaks the rules, the nearest legal compounds are fitted on the
    same laps (`with_start`).

    Raises:
        RsrlError: the season file has no published strategy, or none that can be driven.
    """

    def __init__(self, record: RaceRecord, car: int, seed: int) -> None:
        super().__init__("fixed")
        if not record.published:
            raise RsrlError(f"{record.name}: the season file holds no published strategies; leave out the strategist fixed")
        self._seed = seed
        self._by_start = published_by_start(record, car)

    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        """Draw a published strategy for each race."""
        start = column(environment, "tyre").astype(np.int64)
        first = np.cumsum([0, *(len(p) for p in self._by_start)])
        counts = np.diff(first)
        drawn = (uniform((self._seed, seed), races) * counts[start]).astype(np.int64)
        self.assign([p for plans in self._by_start for p in plans], first[start] + drawn)


def published_by_start(record: RaceRecord, car: int) -> list[list[Plan]]:
    """Published plans by starting tyre: those that start on it, otherwise all of them adapted to it.

    Plans that the car lacks the sets for are left out.

    Raises:
        RsrlError: none is left, or as `with_start`.
    """
    sets = record.sets_of(car)
    published = [Plan.parse(text) for text in record.published]
    published = [p for p in published if all(p.compounds.count(c) <= len(laps) for c, laps in enumerate(sets))]
    if not published:
        raise RsrlError(f"{record.name}: no published strategy can be driven on the sets of {record.cars[car].driver}; leave out fixed")
    by_start: list[list[Plan]] = []
    for start in range(len(COMPOUND_NAMES)):
        own = [p for p in published if p.compounds[0] == start]
        by_start.append(own or [with_start(p, start, record, car) for p in published if sets[start]])
    return by_start


def with_start(plan: Plan, start: int, record: RaceRecord, car: int) -> Plan:
    """`plan` started on another tyre, with the nearest legal compounds on the same laps; of equally near ones, the quickest.

    Distance is the number of steps between compounds (soft, medium, hard), summed over the stops.

    Raises:
        RsrlError: no choice of compounds makes the plan legal.
    """
    candidates, clean_air = [], CleanAir(record, car)
    for rest in product(range(3), repeat=plan.stops):
        changed = Plan((start, *rest), plan.laps)
        try:
            check_plan(changed, record, car)
        except RsrlError:
            continue
        steps = sum(abs(a - b) for a, b in zip(rest, plan.compounds[1:], strict=True))
        candidates.append((steps, clean_air.time_s(changed), changed))
    if not candidates:
        raise RsrlError(
            f"{record.name}: published strategy {plan} cannot be started on the {COMPOUND_NAMES[start]} tyre; correct the season file"
        )
    return min(candidates)[2]
