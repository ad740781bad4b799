"""The audit of a replay: where call and team differed, what each was worth from what was known then, and whether the stops match.

Both calls are rolled out in the same simulated futures (`rsrl.explanation.what_if`), the policy calling afterwards. So an audit compares
calls, not strategies: how the team would have gone on is not known. History itself is no judge of a call, since it ran once.
"""

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

from rsrl.explanation.what_if import Comparison, Continuation, compare
from rsrl.replay.caller import StateCaller
from rsrl.replay.follow import CarFollower
from rsrl.results import AuditedLap, AuditedStop, ReplayAudit, ReplayLap
from rsrl.rollouts import Option
from rsrl.season import COMPOUNDS
from rsrl.state import ACTION_NAMES, UnifiedRaceState

WITHIN_LAPS: Final = 2
"""A stop of the policy so near to the team's matches it."""

OFTEN: Final = 0.5
"""Share of the futures in which the policy must stop at all for it to have a stop."""

STAY: Final = ACTION_NAMES[0]

Progress = Callable[[int, int], None]


class _Case(NamedTuple):
    """A lap with the state that counts on it."""

    row: ReplayLap
    state: UnifiedRaceState


def audit(
    follower: CarFollower, rows: Sequence[ReplayLap], caller: StateCaller, races: int, seed: int, progress: Progress | None = None
) -> ReplayAudit:
    """Audit the calls of a followed car against its team's, by `races` simulated futures of each lap on which they differ.

    Args:
        rows: the laps of the replay.
        progress: called with (laps done, laps in all).
    """
    cases = [
        _Case(row, lap.final.tracked.state) for row, lap in zip(rows, follower.laps, strict=True) if row.call and lap.final.tracked.state
    ]
    differing = [case for case in cases if case.row.agrees is False]
    stops = [case for case in cases if case.row.team not in (None, STAY)]
    done = 0
    differences, audited = [], []
    for case in differing:
        differences.append(_difference(case, follower, caller, races, seed))
        done += 1
        if progress:
            progress(done, len(differing) + len(stops))
    for case in stops:
        audited.append(_stop(case, cases, follower, caller, races, seed))
        done += 1
        if progress:
            progress(done, len(differing) + len(stops))
    return ReplayAudit(
        races=races,
        laps_called=sum(case.row.agrees is not None for case in cases),
        laps_agreed=sum(case.row.agrees is True for case in cases),
        differences=tuple(differences),
        stops=tuple(audited),
        stops_within_two_laps=sum(stop.within_two_laps for stop in audited),
        compounds_matched=sum(stop.same_compound for stop in audited),
    )


def _difference(case: _Case, follower: CarFollower, caller: StateCaller, races: int, seed: int) -> AuditedLap:
    call, team = str(case.row.call), str(case.row.team)
    if team not in case.row.legal:
        return AuditedLap(lap=case.row.lap, call=call, team=team, verdict="not possible")
    _, other = _rolled_out(case, (call, team), follower, caller, races, seed)
    places = other.places
    return AuditedLap(lap=case.row.lap, call=call, team=team, places=places.mean, ci95=(places.low, places.high), verdict=other.verdict)


def _stop(case: _Case, cases: Sequence[_Case], follower: CarFollower, caller: StateCaller, races: int, seed: int) -> AuditedStop:
    lap, compound = case.row.lap, str(case.row.team)
    called = next((c.row for c in cases if lap - WITHIN_LAPS <= c.row.lap <= lap and c.row.call != STAY), None)
    policy_lap: float | None = None
    policy_call: str | None = None
    if called is not None:
        policy_lap, policy_call = float(called.lap), called.call
    else:
        (waits,) = _rolled_out(case, (STAY,), follower, caller, races, seed)
        if waits.stop_lap is not None and waits.stops >= OFTEN:
            policy_lap = waits.stop_lap
        boxes = [i for i, name in enumerate(ACTION_NAMES) if i and name in case.row.legal]
        if boxes:
            policy_call = ACTION_NAMES[caller.policy.preferred(caller.moment(case.state, ()), boxes)]
    return AuditedStop(
        lap=lap,
        compound=_letter(compound),
        track_status=case.row.track_status,
        policy_lap=policy_lap,
        policy_compound=None if policy_call is None else _letter(policy_call),
        within_two_laps=policy_lap is not None and abs(policy_lap - lap) <= WITHIN_LAPS,
        same_compound=policy_call == compound,
    )


def _rolled_out(case: _Case, calls: Sequence[str], follower: CarFollower, caller: StateCaller, races: int, seed: int) -> list[Comparison]:
    """Calls of a lap in the same futures, compared with the first of them."""
    moment = caller.moment(case.state, follower.history(case.row.lap))
    options = tuple(Option(0, ACTION_NAMES.index(call)) for call in calls)
    return compare(Continuation(caller.policy, [moment]).run(options, races, seed), 0)


def _letter(call: str) -> str:
    return COMPOUNDS[ACTION_NAMES.index(call) - 1]
