"""The audit of one car of a recorded race: who would have stopped near its team's stops, and what the calls were worth."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.audit.callers import AuditedCaller, Calls, audited_callers, recorded_calls, shares_within
from rsrl.audit.field import KnownCar, KnownLap, moments
from rsrl.audit.worth import CallWorth, rolled_out
from rsrl.explanation import AnyPolicy, Moment
from rsrl.results import CarAudit, TeamCall, TeamStop
from rsrl.season import COMPOUNDS, RaceRecord
from rsrl.state import ACTION_NAMES, Observer
from rsrl.statistics import mean_interval

TEAM: Final = "team"
"""The team's name among the callers."""


class Settings(NamedTuple):
    """Of an audit: futures of each lap on which calls differ, and the seed of all that is drawn."""

    rollouts: int
    seed: int


class _Recorded(NamedTuple):
    """A car with what every caller calls on its laps: int8 [draws] by lap and caller."""

    known: KnownCar
    record: RaceRecord
    observer: Observer
    decisions: dict[int, Moment]
    callers: list[AuditedCaller]
    calls: dict[str, dict[int, Calls]]


def audit_car(policy: AnyPolicy, known: KnownCar, record: RaceRecord, team: str, position: int | None, settings: Settings) -> CarAudit:
    """Audit one car.

    Args:
        position: it finished in; None where it did not.

    Raises:
        RsrlError: a state that does not belong to the race.
    """
    observer = Observer(record, known.car)
    decisions = moments(known, record, observer)
    first = next((lap.state for lap in known.laps if lap.state is not None), None)
    callers = audited_callers(policy, record, known.car, first, settings.seed)
    calls = {caller.name: recorded_calls(caller, record, decisions) for caller in callers} if decisions else {}
    car = _Recorded(known, record, observer, decisions, callers, calls)
    own = {lap: int(made[0]) for lap, made in calls.get(policy.name, {}).items()}
    worth, notable = _worth(policy, car, settings)
    called = [lap for lap in known.laps if lap.lap in decisions]
    return CarAudit(
        driver=known.driver,
        team=team,
        position=position,
        finished=known.finished,
        laps=len(known.laps),
        laps_called=len(called),
        laps_agreed=sum(lap.team == ACTION_NAMES[own[lap.lap]] for lap in called),
        illegal=sum(not decisions[lap].legal[call] for lap, call in own.items()),
        not_possible=sum(lap.team is not None and not decisions[lap.lap].legal[ACTION_NAMES.index(lap.team)] for lap in called),
        uncalled=dict(Counter(lap.reason for lap in known.laps if lap.lap not in decisions)),
        differing=worth.laps,
        stops=tuple(_stops(car, settings)),
        against_policy=worth.against_policy,
        regret=worth.regret,
        costliest=_most(notable, 1.0),
        shrewdest=_most(notable, -1.0),
    )


def _stints(laps: Sequence[KnownLap]) -> Iterator[list[KnownLap]]:
    """The laps of a car from stop to stop; the last list ends with the race."""
    stint: list[KnownLap] = []
    for lap in laps:
        stint.append(lap)
        if lap.stopped:
            yield stint
            stint = []
    if stint:
        yield stint


def _stops(car: _Recorded, settings: Settings) -> Iterator[TeamStop]:
    """The stops with a state, and how the callers stand to them."""
    for number, stint in enumerate(_stints(car.known.laps)):
        stop = stint[-1]
        if not stop.stopped or stop.lap not in car.decisions:
            continue
        decision = car.decisions[stop.lap]
        laps = [lap.lap for lap in stint]
        fitted = {caller.name: caller.compound(decision) for caller in car.callers} if stop.team is not None else {}
        within = shares_within(car.callers, car.record, car.calls, laps, decision, settings.seed)
        call = None if stop.team is None else ACTION_NAMES.index(stop.team)
        yield TeamStop(
            lap=stop.lap,
            compound=None if call is None else COMPOUNDS[call - 1],
            track_status=0 if stop.state is None else stop.state.track_status,
            first=number == 0,
            within_two_laps=within,
            same_compound={name: shares.get(call or 0, 0.0) for name, shares in fitted.items() if shares is not None},
        )


def _worth(policy: AnyPolicy, car: _Recorded, settings: Settings) -> tuple[CallWorth, list[TeamCall]]:
    """What calls were worth, and the team's calls of which that is known for sure.

    A caller's calls count until its own first stop of the stint: on the laps after, the car is one that it would have stopped already.
    The team's always count.
    """
    worth, notable = CallWorth(), []
    for stint in _stints(car.known.laps):
        stopped: set[str] = set()
        for lap in stint:
            if lap.lap not in car.decisions:
                continue
            decision = car.decisions[lap.lap]
            calls = {name: int(made[lap.lap][0]) for name, made in car.calls.items() if name not in stopped}
            own = int(car.calls[policy.name][lap.lap][0])
            stopped |= {name for name, call in calls.items() if call > 0}
            if lap.team is not None and decision.legal[ACTION_NAMES.index(lap.team)]:
                calls[TEAM] = ACTION_NAMES.index(lap.team)
            tried = tuple(dict.fromkeys([own, *calls.values()]))
            if len(tried) < 2 or settings.rollouts == 0:
                continue
            places = rolled_out(policy, decision, car.observer, tried, settings.rollouts, settings.seed)
            worth.add(places, calls, tried, own)
            if calls.get(TEAM, own) != own:
                notable.append(_team_call(lap, own, calls[TEAM], places[:, tried.index(calls[TEAM])] - places[:, 0]))
    return worth, notable


def _team_call(lap: KnownLap, own: int, team: int, change: NDArray[np.float64]) -> TeamCall:
    return TeamCall(
        lap=lap.lap,
        track_status=0 if lap.state is None else lap.state.track_status,
        call=ACTION_NAMES[own],
        team=ACTION_NAMES[team],
        places=float(change.mean()),
        ci95=mean_interval(change),
    )


def _most(calls: Sequence[TeamCall], sign: float) -> TeamCall | None:
    """The call that lost most (`sign` 1) or gained most (-1), of those whose interval excludes zero."""
    sure = [call for call in calls if min(sign * (end or 0.0) for end in call.ci95) > 0]
    return max(sure, key=lambda call: sign * call.places, default=None)


def mean_by_caller(shares: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Mean by caller over those that have it."""
    names = dict.fromkeys(name for one in shares for name in one)
    return {name: float(np.mean([one[name] for one in shares if name in one])) for name in names}
