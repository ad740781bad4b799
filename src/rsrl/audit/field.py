"""A recorded race followed for its whole field in one pass: before every call of every car, what its pit wall knew and what its team did.

The states are those of `rsrl replay`, whose last look at a lap counts. Looks that a later one on the same lap is sure to replace are not
taken, which is two of three.
"""

from collections.abc import Iterable
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.environment.kernels import write_legal
from rsrl.errors import RsrlError
from rsrl.explanation import Moment
from rsrl.explanation.from_state import arrays_of_state
from rsrl.explanation.state_file import check_race, check_state
from rsrl.feeds import Event
from rsrl.replay import CarFollower, FollowedLap, Look, team_call
from rsrl.replay.follow import NEAR_LAPS
from rsrl.season import RaceRecord
from rsrl.state import Observer, UnifiedRaceState
from rsrl.translators import Health, RaceTracker, Tracked, TrackedCar, TrackedStates

_NOT_LOOKED: Final = Tracked(None, "not looked at", Health(0.0))


class LastLooks(CarFollower):
    """Follows a car without calls, and looks at the race only where no later look on the lap is sure to come."""

    def _look(self, why: str, time_s: float, car: TrackedCar, states: TrackedStates | None, lap: FollowedLap | None = None) -> None:
        lap = lap or self._open
        if states is None or lap is None:
            return
        if not lap.looks:
            lap.looks.append(Look(time_s, why, _NOT_LOOKED, None))
        elif why == "pit entry" or time_s - lap.looks[0].time_s > NEAR_LAPS * states.tracker.usual_lap_s():
            super()._look(why, time_s, car, states, lap)


class KnownLap(NamedTuple):
    """A lap of a car with what was known before the call at its end.

    Attributes:
        lap: counted from 1.
        team: what the team did, in the words of the calls; None for a stop onto an unknown or wet set.
        stopped: whether the team changed tyres.
        state: None where no call can be made, `reason` says why.
    """

    lap: int
    team: str | None
    stopped: bool
    state: UnifiedRaceState | None
    reason: str


class KnownCar(NamedTuple):
    """A car of a followed race, with the laps that it completed; `finished`: it took the flag."""

    driver: str
    car: int
    laps: tuple[KnownLap, ...]
    finished: bool


def follow_field(events: Iterable[Event], record: RaceRecord, drivers: Iterable[str]) -> tuple[KnownCar, ...]:
    """Every car of `drivers`, all in the record, through a race.

    Args:
        events: of one session, such as `rsrl.feeds.lap_files.lap_events` gives.

    Raises:
        RsrlError: the race was wet: there is no wet-weather model.
    """
    tracker = RaceTracker()
    states = TrackedStates(record, tracker)
    followers = [LastLooks(driver, None) for driver in drivers]
    for event in events:
        for one in followers:
            one.before(event, tracker, states)
        news = tracker.take(event)
        states.note(news)
        for one in followers:
            one.after(news, tracker, states)
    cars = {car.driver: car for car in tracker.cars.values()}
    return tuple(_known(one, cars[one.driver], record) for one in followers)


def _known(follower: CarFollower, car: TrackedCar, record: RaceRecord) -> KnownCar:
    laps = []
    for lap in follower.laps:
        if lap.lap > car.laps:
            continue
        final = _final(lap)
        state, reason = final.tracked.state, final.tracked.reason
        if state is not None and (fault := _contradiction(state, record)):
            state, reason = None, f"what the source says is impossible: {fault}"
        stopped = any(stint.fitted_lap == lap.lap for stint in car.stints)
        laps.append(KnownLap(lap.lap, team_call(car, lap.lap), stopped, state, reason))
    return KnownCar(car.driver, record.car_index(car.driver), tuple(laps), not car.out and not car.disqualified)


def _contradiction(state: UnifiedRaceState, record: RaceRecord) -> str:
    """What is impossible about a state; "" for nothing."""
    try:
        check_state(state, f"lap {state.laps_completed + 1}")
        check_race(state, record, f"lap {state.laps_completed + 1}")
    except RsrlError as error:
        return str(error)
    return ""


def _final(lap: FollowedLap) -> Look:
    """The last look in time with a state. Where all came too late, the first of them: it was taken before the news that was too late."""
    seen = [look for look in lap.looks if look.tracked.state is not None]
    in_time = [look for look in seen if look.time_s <= lap.closed_s]
    return (in_time[-1:] or seen[:1] or lap.looks[-1:])[0]


def moments(known: KnownCar, record: RaceRecord, observer: Observer) -> dict[int, Moment]:
    """The decision of every lap that has a state, by lap.

    Raises:
        RsrlError: a state that does not belong to the race.
    """
    found: dict[int, Moment] = {}
    history: list[UnifiedRaceState] = []
    for lap in known.laps:
        if lap.state is None:
            history = []
            continue
        if history and history[-1].laps_completed != lap.state.laps_completed - 1:
            history = []
        found[lap.lap] = _moment(lap.state, history, record, known.car, observer)
        history.append(lap.state)
    return found


def _moment(state: UnifiedRaceState, history: list[UnifiedRaceState], record: RaceRecord, car: int, observer: Observer) -> Moment:
    arrays = arrays_of_state(record, observer.figures, car, state, history)
    legal: NDArray[np.bool_] = np.zeros(4, np.bool_)
    write_legal(observer.figures.whole, arrays[1], arrays[2], car, legal)
    row = observer.row(state)[None]
    return Moment(record, car, state.laps_completed + 1, row, legal, np.zeros(0, np.int8), arrays)
