"""What strategists call on the laps of a recorded race, and whether they stop near the team's stop.

A recorded race is one path: the car's own. Until the team's stop a strategist's calls are asked for on it, and the first of them to box is
its stop. Where it has not boxed by then, futures begin in which the car stays out, and the strategist is asked on their next laps.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.explanation import AnyPolicy, Moment
from rsrl.rollouts.future_batch import FutureBatch
from rsrl.season import COMPOUNDS, RaceRecord
from rsrl.simulator import Plan
from rsrl.simulator import layout as at
from rsrl.simulator.race_arrays import RaceArrays
from rsrl.state import UnifiedRaceState
from rsrl.strategists import ImitationStrategist, PlannedStrategist, Strategist, search_plans

WITHIN_LAPS: Final = 2
"""A stop so near to the team's matches it."""

DRAWS: Final = 64
"""Draws of a strategist that calls at random, and futures after a lap on which the car stays out."""

COMPOUND_DRAWS: Final = 1024
"""Draws from which the compound is taken that such a strategist would fit."""

PLAN_BUDGET: Final = 10_000
"""Simulated races of the search for a car's best plan, a twenty-fifth of what `best-plan-sc` takes: a season has 400 cars."""

BEST_PLAN: Final = "best-plan-sc"
IMITATION: Final = "imitation"

Calls = NDArray[np.int8]


class AuditedCaller(NamedTuple):
    """A strategist that is asked what it would have called.

    Attributes:
        random: whether its calls are drawn; else one draw tells all.
        start: the strategist, ready for rows of an environment with race numbers int64 [rows].
        compound: the box call it would make at a decision, by legal calls; None where it cannot be told.
    """

    name: str
    random: bool
    start: Callable[[RaceEnvironment, NDArray[np.int64]], Strategist]
    compound: Callable[[Moment], Mapping[int, float] | None]


def audited_callers(policy: AnyPolicy, record: RaceRecord, car: int, first: UnifiedRaceState | None, seed: int) -> list[AuditedCaller]:
    """The policy, the best plan with a safety-car rule for the tyre the car started on, and the model of teams' calls.

    Args:
        first: the earliest state, which shows that tyre; None leaves the plan out.

    Without a legal plan from that tyre, or without a model of teams' calls in the season file, that caller is missing.
    """
    found = [_policy(policy, record)]
    start = _starting_tyre(first)
    if start is not None and (plan := _plan(record, car, start, seed)) is not None:
        found.append(_planned(plan))
    if record.rivals.hazard:
        found.append(_imitation(record, car, seed))
    return found


def _begun(strategist: Strategist, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> Strategist:
    strategist.begin(environment, seed, races)
    return strategist


def _policy(policy: AnyPolicy, record: RaceRecord) -> AuditedCaller:
    def start(environment: RaceEnvironment, races: NDArray[np.int64]) -> Strategist:
        return _begun(policy.strategist(record), environment, 0, races)

    def compound(moment: Moment) -> Mapping[int, float] | None:
        boxes = [call for call in (1, 2, 3) if moment.legal[call]]
        return {policy.preferred(moment, boxes): 1.0} if boxes else None

    return AuditedCaller(policy.name, False, start, compound)


class OnePlan(PlannedStrategist):
    """Drives every race to one plan, within its safety-car windows."""

    def __init__(self, plan: Plan) -> None:
        super().__init__(BEST_PLAN)
        self._plan = plan

    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        """Give every race the plan."""
        self.assign([self._plan], np.zeros(len(races), np.int64))


def _planned(plan: Plan) -> AuditedCaller:
    def start(environment: RaceEnvironment, races: NDArray[np.int64]) -> Strategist:
        return _begun(OnePlan(plan), environment, 0, races)

    def compound(moment: Moment) -> Mapping[int, float] | None:
        stops = int(moment.arrays[1][at.K_STOPS, moment.car])
        return {1 + plan.compounds[stops + 1]: 1.0} if stops < plan.stops else None

    return AuditedCaller(BEST_PLAN, False, start, compound)


def _imitation(record: RaceRecord, car: int, seed: int) -> AuditedCaller:
    def start(environment: RaceEnvironment, races: NDArray[np.int64]) -> Strategist:
        return _begun(ImitationStrategist(record, car, seed), environment, seed, races)

    def compound(moment: Moment) -> Mapping[int, float] | None:
        environment = on_record(record, [moment], COMPOUND_DRAWS)
        calls = start(environment, np.arange(COMPOUND_DRAWS, dtype=np.int64)).decide(environment)
        boxed = calls[calls > 0]
        return {int(call): float((boxed == call).mean()) for call in np.unique(boxed)} if len(boxed) else None

    return AuditedCaller(IMITATION, True, start, compound)


def _plan(record: RaceRecord, car: int, start: int, seed: int) -> Plan | None:
    try:
        return search_plans(record, car, start, seed=seed, budget=PLAN_BUDGET, sc_rule=True).best
    except RsrlError:
        return None


def _starting_tyre(first: UnifiedRaceState | None) -> int | None:
    if first is None or len(first.compounds_used) != 1:
        return None
    return COMPOUNDS.index(next(iter(first.compounds_used)))


def on_record(record: RaceRecord, moments: Sequence[Moment], copies: int) -> RaceEnvironment:
    """An environment whose rows are recorded decisions of one car, each of them `copies` times in turn."""
    environment = RaceEnvironment(record, moments[0].car, batch=len(moments) * copies)
    races = environment.races
    for array, parts in zip((races.f, races.k, races.r), zip(*(m.arrays for m in moments), strict=True), strict=True):
        array[:] = np.repeat(np.stack(parts), copies, axis=0)
    environment.raw[:] = np.repeat(np.concatenate([m.raw[-1:] for m in moments]), copies, axis=0)
    environment.legal[:] = np.repeat(np.stack([m.legal for m in moments]), copies, axis=0)
    environment.done[:] = False
    return environment


def recorded_calls(caller: AuditedCaller, record: RaceRecord, decisions: Mapping[int, Moment]) -> dict[int, Calls]:
    """Calls on every recorded lap, int8 [draws], by lap."""
    copies = DRAWS if caller.random else 1
    environment = on_record(record, list(decisions.values()), copies)
    numbers = np.tile(np.arange(copies, dtype=np.int64), len(decisions))
    calls = caller.start(environment, numbers).decide(environment).reshape(len(decisions), copies)
    return dict(zip(decisions, calls, strict=True))


def first_box(calls: Mapping[int, Calls], laps: Sequence[int]) -> NDArray[np.int64]:
    """The first of some laps on which each draw boxes, int64 [draws]; 0 where it boxes on none of them."""
    first = np.zeros(len(next(iter(calls.values()))), np.int64)
    for lap in laps:
        if lap in calls:
            first = np.where((first == 0) & (calls[lap] > 0), lap, first)
    return first


def shares_within(
    callers: Sequence[AuditedCaller], record: RaceRecord, calls: Mapping[str, Mapping[int, Calls]], laps: Sequence[int], at_stop: Moment,
    seed: int,
) -> dict[str, float]:  # fmt: skip
    """By caller, the chance that it stops within `WITHIN_LAPS` laps of the team.

    Args:
        calls: by caller and lap.
        laps: of the car since its last stop, up to that at whose end the team stops.
        at_stop: the decision on that lap.
    """
    futures: _StayingOut | None = None
    shares = {}
    for caller in callers:
        first = first_box(calls[caller.name], laps)
        near = ((first > 0) & (np.abs(first - laps[-1]) <= WITHIN_LAPS)).astype(np.float64)
        if (first == 0).any():
            futures = futures or _StayingOut(record, at_stop, seed)
            later = futures.boxes(caller)
            near = np.where(first > 0, near, later if caller.random else later.mean())
        shares[caller.name] = float(near.mean())
    return shares


class _StayingOut:
    """Futures of a lap on which the car stays out, DRAWS of them, the same for every caller."""

    def __init__(self, record: RaceRecord, moment: Moment, seed: int) -> None:
        self._environment = on_record(record, [moment], DRAWS)
        self._drawn = FutureBatch(self._environment.observer.figures, moment.car, RaceArrays(*moment.arrays), DRAWS, seed).races

    def boxes(self, caller: AuditedCaller) -> NDArray[np.bool_]:
        """Whether a caller boxes on the `WITHIN_LAPS` laps after, in each future, bool [DRAWS]."""
        environment = self._environment
        for array, drawn in zip((environment.races.f, environment.races.k, environment.races.r), self._drawn, strict=True):
            array[:] = drawn
        environment.done[:] = False
        strategist = caller.start(environment, np.arange(DRAWS, dtype=np.int64))
        environment.step(np.zeros(DRAWS, np.int8))
        boxed = np.zeros(DRAWS, np.bool_)
        for _ in range(WITHIN_LAPS):
            calls = strategist.decide(environment)
            boxed |= (calls > 0) & ~environment.done
            environment.step(calls)
        return boxed
