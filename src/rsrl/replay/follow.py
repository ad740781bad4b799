"""A feed followed to its end: at every lap of a car, and whenever something on the lap changes the picture, a state and a call.

A call is for the end of the lap under way and can be changed until the car reaches the pit entry. So a lap has several looks: one as it
begins, one whenever the track status changes or a rival boxes, and a last one as the car comes to the pit entry. The last one counts.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from rsrl.errors import RsrlError
from rsrl.feeds import Event, LapCompleted, PitIn, StatusChanged
from rsrl.replay.caller import Called, StateCaller
from rsrl.season import TRACK_STATUS_NAMES, RaceRecord
from rsrl.state import UnifiedRaceState
from rsrl.translators import News, RaceTracker, Tracked, TrackedCar, TrackedStates

TOO_LATE_S: Final = 5.0
"""What becomes known so shortly before a car crosses the line has come too late for its pit entry."""

NEAR_LAPS: Final = 0.8
"""Share of a usual lap after which a car may be near the pit entry."""

STATUS_WORDS: Final = dict(zip(range(4), ("green", "virtual safety car", "safety car", "red flag"), strict=True))
assert len(STATUS_WORDS) == len(TRACK_STATUS_NAMES)


class Look(NamedTuple):
    """One look at the race: when, why, what was known, and the call; `called` is None where there was no state to call from."""

    time_s: float
    why: str
    tracked: Tracked
    called: Called | None


Tell = Callable[[str, int, Look], None]
"""Takes a driver code, a lap and a look at it."""


@dataclass
class FollowedLap:
    """A lap of the called car: the looks at it in order, and the session time after which it was too late for the pit entry."""

    lap: int
    looks: list[Look] = field(default_factory=list)
    closed_s: float = float("inf")

    @property
    def final(self) -> Look:
        """The look that counts: the last one in time that has a call, or the last one in time."""
        in_time = [look for look in self.looks if look.time_s <= self.closed_s] or self.looks[:1]
        return next((look for look in reversed(in_time) if look.called is not None), in_time[-1])


class CarFollower:
    """Follows one car of a tracked race.

    Attributes:
        laps: so far, the last of them perhaps still under way.
    """

    def __init__(self, driver: str, caller: StateCaller | None, tell: Tell | None = None) -> None:
        self.driver, self._caller, self._tell = driver, caller, tell
        self.laps: list[FollowedLap] = []
        self._open: FollowedLap | None = None

    def before(self, event: Event, tracker: RaceTracker, states: TrackedStates | None) -> None:
        """The last look at a lap, taken before the event that ends it: the car's pit entry, or its crossing of the line."""
        car = tracker.cars.get(event.car) if isinstance(event, LapCompleted | PitIn) else None
        if self._open is None:
            return
        if car is None or car.driver != self.driver or not isinstance(event, LapCompleted | PitIn):
            if isinstance(event, StatusChanged | PitIn):
                self._before_news(event, tracker, states)
            return
        if isinstance(event, LapCompleted) and event.lap <= car.laps:
            return
        if isinstance(event, PitIn):
            self._open.closed_s = event.time_s
            self._look("pit entry", event.time_s, car, states)
            return
        lap, self._open = self._open, None
        if lap.closed_s > event.time_s:
            lap.closed_s = event.time_s - TOO_LATE_S
            if all(look.time_s <= lap.closed_s for look in lap.looks):
                self._look("pit entry", lap.closed_s, car, states, lap)

    def _before_news(self, event: Event, tracker: RaceTracker, states: TrackedStates | None) -> None:
        """A look before news that may have come too late for the pit entry, so that the last look in time is no old one."""
        own = next((c for c in tracker.cars.values() if c.driver == self.driver), None)
        looks = self._open.looks if self._open is not None else []
        if own is not None and looks and event.time_s - looks[0].time_s > NEAR_LAPS * tracker.usual_lap_s():
            self._look("pit entry", tracker.time_s, own, states)

    def after(self, news: Sequence[News], tracker: RaceTracker, states: TrackedStates | None) -> None:
        """A look at whatever an event has changed."""
        car = next((c for c in tracker.cars.values() if c.driver == self.driver), None)
        if car is None:
            return
        for one in news:
            if one.kind == "start" or (one.kind == "lap" and one.car == car.number):
                self._begin(car, tracker, states)
            elif self._open is not None and (why := self._why(one, car, tracker)):
                self._look(why, tracker.time_s + tracker.quiet_s, car, states)

    def _begin(self, car: TrackedCar, tracker: RaceTracker, states: TrackedStates | None) -> None:
        total = states.record.laps if states else tracker.total_laps
        if total is not None and car.laps >= total:
            self._open = None
            return
        if self._open is not None and self._open.lap == car.laps + 1:
            return  # told of twice, as in what has been heard before the field was known
        self._open = FollowedLap(car.laps + 1)
        self.laps.append(self._open)
        self._look("lap begins", tracker.time_s, car, states)

    def _why(self, news: News, car: TrackedCar, tracker: RaceTracker) -> str:
        """What makes a new look necessary; "" for nothing."""
        if news.kind in ("silence", "data"):
            return "no data" if news.kind == "silence" else "data again"
        if news.kind == "status":
            return STATUS_WORDS[tracker.status]
        if news.kind == "pit in" and news.car not in (None, car.number):
            return f"{tracker.cars[news.car].driver} boxes" if news.car is not None else ""
        if news.car == car.number and news.kind in ("pit out", "tyres"):
            return "new tyres" if news.kind == "tyres" else "pit exit"
        return ""

    def _look(self, why: str, time_s: float, car: TrackedCar, states: TrackedStates | None, lap: FollowedLap | None = None) -> None:
        lap = lap or self._open
        if states is None or lap is None:
            return
        tracked = states.state(car.number)
        called = None
        if tracked.state is not None and self._caller is not None:
            try:
                called = self._caller.call(tracked.state, self.history())
            except RsrlError as error:  # what a source says may contradict itself; a race that is followed live goes on
                tracked = tracked._replace(state=None, reason=f"what the source says is impossible: {error}")
        look = Look(time_s, why, tracked, called)
        lap.looks.append(look)
        if self._tell is not None:
            self._tell(self.driver, lap.lap, look)

    def history(self, until: int | None = None) -> list[UnifiedRaceState]:
        """Final states of the laps before lap `until` (the one under way for None), one a lap without a gap up to it."""
        last = self.laps[-1].lap if until is None else until
        found: list[UnifiedRaceState] = []
        for lap in reversed([one for one in self.laps if one.lap < last]):
            state = lap.final.tracked.state if lap.looks else None
            expected = last - 2 - len(found)
            if state is None or state.laps_completed != expected:
                break
            found.append(state)
        return found[::-1]


class RaceFollower:
    """Follows cars of one race, event by event.

    Args:
        record: season file of the race; None tracks without states and calls.
        callers: by driver code; a driver without caller has states and no calls.
        tracker: one that has followed the race up to here; None begins with the first event.
        stale_after_s: the race is not called once the source has told of no car for so long; None for sources of laps alone.
        tell: takes driver code, lap and each look at it as it is made.

    Attributes:
        states: None without a season file.
        cars: in the order of `callers`.
    """

    def __init__(
        self,
        record: RaceRecord | None,
        callers: Mapping[str, StateCaller | None],
        *,
        tracker: RaceTracker | None = None,
        stale_after_s: float | None = None,
        tell: Tell | None = None,
    ) -> None:
        self._record, self._callers, self._stale_after_s, self._tell = record, callers, stale_after_s, tell
        self.tracker = tracker or RaceTracker()
        self._begin()

    def _begin(self) -> None:
        self.states = TrackedStates(self._record, self.tracker, self._stale_after_s) if self._record is not None else None
        self.cars = tuple(CarFollower(driver, caller, self._tell) for driver, caller in self._callers.items())
        self._silent = False

    def take(self, event: Event) -> tuple[News, ...]:
        """Take in an event; what it changed."""
        for one in self.cars:
            one.before(event, self.tracker, self.states)
        news = self.tracker.take(event)
        if any(n.kind == "session" for n in news):
            self._begin()
        news += self._silence()
        self.note(news)
        return news

    def note(self, news: tuple[News, ...]) -> None:
        """Look at what an event has changed, which the tracker has taken in already."""
        if self.states is not None:
            self.states.note(news)
        for one in self.cars:
            one.after(news, self.tracker, self.states)

    def _silence(self) -> tuple[News, ...]:
        """That the source has fallen silent, or speaks again."""
        silent = self._stale_after_s is not None and self.tracker.silent_s >= self._stale_after_s
        if silent == self._silent:
            return ()
        self._silent = silent
        return (News("silence" if silent else "data"),)


class Followed(NamedTuple):
    """A feed that has been followed to its end."""

    tracker: RaceTracker
    states: TrackedStates | None
    cars: tuple[CarFollower, ...]


def follow(events: Iterable[Event], record: RaceRecord | None, callers: dict[str, StateCaller | None]) -> Followed:
    """Follow a feed to its end.

    Args:
        record: season file of the race; None tracks without states and calls.
        callers: by driver code; a driver without caller has states and no calls.

    Raises:
        RsrlError: a driver is not in the feed; the message names those that are.
    """
    follower = RaceFollower(record, callers)
    for event in events:
        follower.take(event)
    check_drivers(follower.tracker, callers)
    return Followed(follower.tracker, follower.states, follower.cars)


def check_drivers(tracker: RaceTracker, drivers: Iterable[str]) -> None:
    """Raise RsrlError where a driver is not in the feed; the message names those that are."""
    known = sorted(car.driver for car in tracker.cars.values())
    for driver in drivers:
        if driver not in known:
            raise RsrlError(f"unknown driver {driver!r}; in the race were {', '.join(known) or 'none'}")
