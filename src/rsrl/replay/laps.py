"""A followed car as the laps of a result: what was known, the call, what the team did."""

from dataclasses import asdict
from typing import Any

from rsrl.explanation.state_file import state_document
from rsrl.replay.confidence import confidence_of
from rsrl.replay.follow import Followed, FollowedLap, Look
from rsrl.results import LiveLook, ReplayHealth, ReplayLap, ReplayLook
from rsrl.season import COMPOUNDS
from rsrl.state import ACTION_NAMES, UnifiedRaceState
from rsrl.translators import RaceTracker, TrackedCar


def replay_laps(followed: Followed, number: int = 0) -> tuple[ReplayLap, ...]:
    """The laps of car `number` of those followed."""
    follower = followed.cars[number]
    car = next(c for c in followed.tracker.cars.values() if c.driver == follower.driver)
    return tuple(_lap(followed.tracker, car, lap) for lap in follower.laps if lap.lap <= car.laps or lap.looks)


def team_call(car: TrackedCar, lap: int) -> str | None:
    """What the team did at the end of a lap, in the words of the calls; None where the tyre fitted is unknown or no dry one."""
    fitted = next((s for s in car.stints if s.fitted_lap == lap), None)
    if fitted is None:
        return ACTION_NAMES[0]
    return ACTION_NAMES[1 + COMPOUNDS.index(fitted.compound)] if fitted.compound in COMPOUNDS else None


def live_look(tracker: RaceTracker, driver: str, lap: int, look: Look) -> LiveLook:
    """A look as it is made, for a log or a screen."""
    car = next(c for c in tracker.cars.values() if c.driver == driver)
    return LiveLook(time_s=round(look.time_s, 3), why=look.why, driver=driver, seen=ReplayLap(**_seen(tracker, car, lap, look), looks=()))


def _lap(tracker: RaceTracker, car: TrackedCar, lap: FollowedLap) -> ReplayLap:
    team = team_call(car, lap.lap) if lap.lap <= car.laps else None
    looks = tuple(_look(look, tracker) for look in lap.looks)
    seen = _seen(tracker, car, lap.lap, lap.final if lap.looks else None)
    call = seen.get("call")
    return ReplayLap(**seen, looks=looks, team=team, agrees=None if call is None or team is None else call == team)


def _seen(tracker: RaceTracker, car: TrackedCar, lap: int, look: Look | None) -> dict[str, Any]:
    """The fields of a lap that a look gives."""
    state = look.tracked.state if look else None
    if look is None or state is None:
        reason = look.tracked.reason if look else None
        return _tracked_only(tracker, car, lap - 1) | {"lap": lap, "reason": reason, "health": look and _health(look)}
    called, (level, doubts) = look.called, confidence_of(look.tracked, look.called)
    return _known(state) | {
        "lap": lap,
        "call": ACTION_NAMES[called.strategy.action] if called else None,
        "values": called.strategy.q_values if called else None,
        "legal": called.legal if called else (),
        "confidence": level,
        "doubts": doubts,
        "health": _health(look),
        "state": state_document(state),
    }


def _look(look: Look, tracker: RaceTracker) -> ReplayLook:
    state = look.tracked.state
    status = next(span.status for span in reversed(tracker.spans) if span.from_s <= look.time_s) if state is None else state.track_status
    call = ACTION_NAMES[look.called.strategy.action] if look.called else None
    return ReplayLook(
        time_s=round(look.time_s, 3),
        why=look.why,
        track_status=status,
        call=call,
        reason=look.tracked.reason or None,
        confidence=confidence_of(look.tracked, look.called).level,
    )


def _health(look: Look) -> ReplayHealth:
    return ReplayHealth(**asdict(look.tracked.health))


def _known(state: UnifiedRaceState) -> dict[str, Any]:
    """The fields of a lap that a state has."""
    running = sorted((c for c in state.cars if c.running), key=lambda c: c.position)
    place = next(i for i, c in enumerate(running) if c.driver == state.driver)
    own = running[place]
    gaps = [c.gap_to_leader_s or 0.0 for c in running]
    return {
        "position": own.position,
        "gap_to_leader_s": round(gaps[place], 3),
        "gap_ahead_s": round(gaps[place] - gaps[place - 1], 3) if place else None,
        "gap_behind_s": round(gaps[place + 1] - gaps[place], 3) if place + 1 < len(gaps) else None,
        "compound": own.compound,
        "tyre_age_laps": own.tyre_age_laps,
        "stops": own.stops,
        "track_status": state.track_status,
    }


def _tracked_only(tracker: RaceTracker, car: TrackedCar, lap: int) -> dict[str, Any]:
    """The same where there is no state: as far as it is measured, by when the cars crossed the line."""
    stint = car.stint_at(lap)
    known: dict[str, Any] = {"track_status": tracker.lap_status(lap + 1), "stops": car.stops_until(lap)}
    if stint is not None:
        age = None if stint.laps_before is None else stint.laps_before + max(lap - stint.fitted_lap, 0)
        known |= {"compound": stint.compound, "tyre_age_laps": age}
    if lap in car.crossings:
        times = sorted(other.crossings[lap] for other in tracker.cars.values() if lap in other.crossings)
        place = times.index(car.crossings[lap])
        known |= {"position": place + 1, "gap_to_leader_s": round(times[place] - times[0], 3)}
        known |= {"gap_ahead_s": round(times[place] - times[place - 1], 3)} if place else {}
        known |= {"gap_behind_s": round(times[place + 1] - times[place], 3)} if place + 1 < len(times) else {}
    return known
