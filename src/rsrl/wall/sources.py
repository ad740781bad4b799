"""Where a race comes from: simulated, recorded, live. All of them are events of `rsrl.feeds`, and looks at the race for calls.

A new kind of source is a class with the attributes of `Source`: its events go through the same tracker, board and log. A live one simply
takes its time between events: `TrackedSource` with the head of the race and the feed's events is all it needs.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, NamedTuple, Protocol

from rsrl.explanation import AnyPolicy, EpisodeRecorder, Moment, first_finished_race
from rsrl.explanation.from_state import reobserved
from rsrl.explanation.moment import Arrays
from rsrl.feeds import Event
from rsrl.feeds.lap_files import lap_events, read_lap_file
from rsrl.replay import StateCaller
from rsrl.season import RaceRecord, find_car, load_race, race_names
from rsrl.simulator import layout as at
from rsrl.state import Observer, UnifiedRaceState
from rsrl.translators import RaceTracker, TrackedStates
from rsrl.wall.ahead import called_for
from rsrl.wall.messages import Marks
from rsrl.wall.messages.server import SourceKind
from rsrl.wall.simulated_events import is_running, simulated_events

NO_MARKS: Final[Marks] = {}


class Known(NamedTuple):
    """What a look at the race gives: a way to make the decision, or why there is none; where its figures are from, and what is missing.

    `status`: track status of the coming lap, where it is known before it is told; None for the one told last.
    """

    moment: Callable[[], Moment] | None
    reason: str = ""
    marks: Marks = NO_MARKS
    missing: tuple[str, ...] = ()
    status: int | None = None


class Looker(Protocol):
    """Looks at the race for any of its cars."""

    def look(self, driver: str, tracker: RaceTracker) -> Known:
        """What is known for the call of a car's coming lap."""
        ...


@dataclass(frozen=True)
class Head:
    """What a source says of its race.

    Attributes:
        kind: "simulated", "recorded" or "live".
        record: None where there is no season file, or the race was wet: `note` says why.
        seed, race_number, driven: of a simulated race, one car of which is driven by the policy's calls.
        cars: driver and team of those that started, where there is no record.
    """

    kind: SourceKind
    race: str
    event: str
    season: int
    laps: int | None
    record: RaceRecord | None
    note: str = ""
    seed: int | None = None
    race_number: int | None = None
    driven: str | None = None
    cars: tuple[tuple[str, str], ...] = ()


class Source(Protocol):
    """A race to be followed once, from its begin.

    Attributes:
        head: of the race.
        needs_states: its looker needs states of the tracked race.
        stale_after_s: no call is made once it has told of no car for so long; None for never.
    """

    head: Head
    needs_states: bool
    stale_after_s: float | None

    def events(self) -> Iterable[Event]:
        """The events in the order in which they became known. A live source waits for them; it is read by a thread of its own."""
        ...

    def looker(self, states: TrackedStates | None) -> Looker:
        """The looker for one car; `states` of the tracker that follows the events, None without a record."""
        ...


class SimulatedSource:
    """A simulated race of a record, one car of it driven by the policy's calls: the race that `rsrl explain` explains.

    Args:
        driver: whose car the policy drives, as of `season.find_car`.
        seed: of the race; the race number is that of the first race of the seed that the car finishes.

    Raises:
        RsrlError: there is no such race or driver.
    """

    needs_states = False
    stale_after_s: float | None = None

    def __init__(self, policy: AnyPolicy, race: str, driver: str | None, seed: int) -> None:
        record = load_race(race)
        car = find_car(record, driver)
        strategist = policy.strategist(record)
        number = first_finished_race(strategist, record, car, seed=seed)
        recorder = EpisodeRecorder(record, car, 1, states=True)
        episodes = recorder.record(seed, number, strategist)
        races = recorder.environment.races
        moments = [episodes.moment(lap) for lap in range(1, int(episodes.running[:, 0].sum()) + 1)]
        last = (races.f[0].copy(), races.k[0].copy(), races.r[0].copy())
        self._states: list[Arrays] = [*(m.arrays for m in moments), last]
        self._moments, self._car, self._record = moments, car, record
        self._observers: dict[int, Observer] = {}
        self._in_share = record.pit.in_lap_share.value
        driven = record.cars[car].driver
        self.head = Head("simulated", record.name, record.event, record.season, record.laps, record, "", seed, number, driven)

    def events(self) -> Sequence[Event]:
        """As of `Source`."""
        return simulated_events(self._record, self._states, self._in_share)

    def looker(self, states: TrackedStates | None) -> Looker:
        """As of `Source`: the simulator's own arrays are looked at."""
        return self

    def look(self, driver: str, tracker: RaceTracker) -> Known:
        """As of `Looker`."""
        car = self._record.car_index(driver)
        seen = next(c for c in tracker.cars.values() if c.driver == driver)
        laps = seen.laps
        if laps >= len(self._moments):
            return Known(None, "the race is over")
        if seen.out or not is_running(self._states[laps], car):
            return Known(None, f"{driver} is out of the race")
        return Known(lambda: self._moment(car, laps), status=int(self._states[laps][2][at.R_STATUS]))

    def _moment(self, car: int, laps: int) -> Moment:
        if car == self._car:
            return self._moments[laps]
        return seen_by(self._moments[laps], car, self._observers)


def seen_by(moment: Moment, car: int, observers: dict[int, Observer]) -> Moment:
    """The same race as the pit wall of another car sees it, which is then the car called from outside."""
    if car not in observers:
        observers[car] = Observer(moment.record, car)
    arrays = called_for(moment.arrays, moment.car, car, bool(observers[car].figures.rivals.age.size))
    own = replace(moment, car=car, raw=moment.raw[-1:].copy(), calls=moment.calls[:0])
    return reobserved(own, arrays, observers[car])


class StateLooker:
    """Looks at a tracked race, for a recorded or live source; a policy with a memory gets the states of the laps before."""

    def __init__(self, policy: AnyPolicy, states: TrackedStates) -> None:
        self._policy, self._states = policy, states
        self._callers: dict[str, StateCaller] = {}
        self._seen: dict[str, list[UnifiedRaceState]] = {}

    def look(self, driver: str, tracker: RaceTracker) -> Known:
        """As of `Looker`."""
        number = next(n for n, c in tracker.cars.items() if c.driver == driver)
        state, reason, health = self._states.state(number)
        if state is None:
            return Known(None, reason, dict(health.fields), health.missing)  # type: ignore[arg-type]  # words of `Mark`
        history = _up_to(self._seen.get(driver, []), state.laps_completed)
        self._seen[driver] = [*history, state]
        return Known(lambda: self._caller(driver).moment(state, history), "", dict(health.fields), health.missing)  # type: ignore[arg-type]

    def _caller(self, driver: str) -> StateCaller:
        if driver not in self._callers:
            record = self._states.record
            self._callers[driver] = StateCaller(self._policy, record, record.car_index(driver))
        return self._callers[driver]


def _up_to(states: Sequence[UnifiedRaceState], laps: int) -> list[UnifiedRaceState]:
    """The last states, one a lap without a gap, up to the one before `laps` laps were completed."""
    earlier = [state for state in states if state.laps_completed < laps]
    found: list[UnifiedRaceState] = []
    while earlier and earlier[-1].laps_completed == laps - 1 - len(found):
        found.append(earlier.pop())
    return found[::-1]


class NoLooker:
    """Looks at a race of which no calls are made."""

    def __init__(self, note: str) -> None:
        self._note = note

    def look(self, driver: str, tracker: RaceTracker) -> Known:
        """As of `Looker`: never a decision."""
        return Known(None, self._note)


class TrackedSource:
    """A race of events from a feed, recorded or live; what is told of it is told as it was known at the time.

    Args:
        events: as of `Source.events`.
        stale_after_s: as of `Source`.
    """

    def __init__(self, policy: AnyPolicy, head: Head, events: Iterable[Event], stale_after_s: float | None = None) -> None:
        self.head, self._policy, self._events = head, policy, events
        self.needs_states, self.stale_after_s = True, stale_after_s

    def events(self) -> Iterable[Event]:
        """As of `Source`."""
        return self._events

    def looker(self, states: TrackedStates | None) -> Looker:
        """As of `Source`."""
        return NoLooker(self.head.note) if states is None else StateLooker(self._policy, states)


def recorded_source(policy: AnyPolicy, path: Path, race: str) -> TrackedSource:
    """A recorded race of a lap file. Raises RsrlError as `read_lap_file`."""
    name, table = read_lap_file(path, race)
    record, note = season_file(name)
    pairs = table.select("driver", "team").unique(maintain_order=True).iter_rows()
    cars = tuple((str(driver), str(team)) for driver, team in pairs)
    event, season = str(table["event"][0]), int(table["season"][0])
    head = Head("recorded", name, event, season, record.laps if record else None, record, note, cars=cars)
    return TrackedSource(policy, head, lap_events(table))


def season_file(name: str) -> tuple[RaceRecord | None, str]:
    """The season file of a dry race, or why there are no calls."""
    if name not in race_names():
        return None, f"there is no season file of {name}, so there are no calls"
    record = load_race(name)
    return (None, "there is no wet-weather model, so there are no calls") if record.wet else (record, "")
