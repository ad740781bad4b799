"""A race as it becomes known: snapshots in order of time, laps of the history, and looks at the race from which calls are made.

One thread writes it, the event loop reads it. Everything is appended in order of time, so a reader that knows a time knows what had been
known by then: the one buffer from which every viewer is served, however far its clock is behind.
"""

import json
import time
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

from rsrl.wall.messages import History, LapOfCar, LapOfRace, Marks, Status

if TYPE_CHECKING:
    from rsrl.explanation import Moment

LAP_BEGINS: Final = "lap begins"
"""Why there is a look: the most usual reason."""

MOST_TEXTS: Final = 16
"""Histories kept as text."""

HISTORY_MARKS: Final[Marks] = {
    "laps.mean_lap_s": "derived",
    "laps.cars.lap_time_s": "measured",
    "laps.cars.gap_to_leader_s": "measured",
    "laps.cars.position": "derived",
}


@dataclass(frozen=True)
class Look:
    """A look at the race for a car: what a call for lap `lap` rests on.

    Attributes:
        number: of the looks at this car, from 0.
        moment: makes the decision; None where there is none, `reason` says why.
        marks: where the figures of the state are from; missing: what the source does not say.
    """

    number: int
    time_s: float
    lap: int
    why: str
    status: Status
    moment: "Callable[[], Moment] | None"
    reason: str = ""
    marks: Marks = field(default_factory=dict)
    missing: tuple[str, ...] = ()

    def without_moment(self, reason: str) -> "Look":
        """The look as one of which no call can be made."""
        return replace(self, moment=None, reason=reason)


@dataclass(frozen=True)
class TimedLap:
    """A car's lap with the time at which it became known."""

    time_s: float
    lap: LapOfCar
    raced: bool  # neither boxed nor left the pit lane on it


@dataclass
class LapRow:
    """A lap of the race as far as it is known."""

    status: Status
    cars: list[TimedLap] = field(default_factory=list)


class RaceLog:
    """The growing log of one session. All times are on the session clock.

    Attributes:
        times_s, frames: snapshots as JSON text, and when each was.
        lap_starts_s: when the leader began each lap.
        looks: by driver.
        over: nothing will be added.
        failed: why the source broke off, in one line.
    """

    def __init__(self, session: str) -> None:
        self.session = session
        self.times_s: list[float] = []
        self.frames: list[str] = []
        self.lap_starts_s: list[float] = []
        self.looks: dict[str, list[Look]] = {}
        self.rows: dict[int, LapRow] = {}
        self.over = False
        self.failed = ""
        self._heard_at = time.monotonic()
        self._texts: dict[tuple[float, float | None], str | None] = {}

    def show(self, time_s: float, frame: str) -> None:
        """Append a snapshot."""
        self.frames.append(frame)
        self.times_s.append(time_s)
        self._heard_at = time.monotonic()

    def now_s(self) -> float:
        """The race time of a live race now: that of the newest snapshot, and what has passed since."""
        return self.known_s + (time.monotonic() - self._heard_at)

    def aged(self, silent_s: float) -> str:
        """The newest snapshot as it looks after a silence of the source, as JSON."""
        race = json.loads(self.frames[-1])
        return json.dumps(race | {"age_s": round(race["age_s"] + silent_s, 1)})

    @property
    def known_s(self) -> float:
        """Up to when the race is known."""
        return self.times_s[-1] if self.times_s else 0.0

    def frame_at(self, time_s: float) -> int:
        """Number of the snapshot shown at a time; -1 before the first."""
        return bisect_right(self.times_s, time_s) - 1

    def lap_at(self, time_s: float) -> int:
        """The leader's lap at a time, from 1."""
        return max(bisect_right(self.lap_starts_s, time_s), 1)

    def look_at(self, driver: str, time_s: float) -> Look | None:
        """The latest look at a car by a time."""
        looks = self.looks.get(driver, [])
        i = bisect_right(looks, time_s, key=lambda look: look.time_s)
        return looks[i - 1] if i else None

    def lap_begun_s(self, driver: str, lap: int) -> float | None:
        """When a car began a lap; None where that is not known."""
        return next((look.time_s for look in tuple(self.looks.get(driver, ())) if look.lap == lap and look.why == LAP_BEGINS), None)

    def look_for(self, driver: str, lap: int, time_s: float) -> Look | None:
        """The look that counts for the call of a lap, of those by a time."""
        found = None
        for look in self.looks.get(driver, []):
            if look.time_s > time_s:
                break
            if look.lap == lap and (look.moment is not None or found is None):
                found = look
        return found

    def history_text(self, until_s: float, since_s: float | None) -> str | None:
        """`history` as JSON, the same text for all viewers who are at the same snapshots; None for nothing new."""
        key = (until_s, since_s)
        if key not in self._texts:
            history = self.history(until_s, since_s)
            while len(self._texts) >= MOST_TEXTS:
                del self._texts[next(iter(self._texts))]
            self._texts[key] = None if history is None else history.model_dump_json()
        return self._texts[key]

    def history(self, until_s: float, since_s: float | None) -> History | None:
        """Laps with anything that became known after `since_s` and by `until_s`; the whole history for None. None for nothing new."""
        laps = []
        for number in sorted(self.rows):
            row = self.rows[number]
            known = [timed for timed in tuple(row.cars) if timed.time_s <= until_s]
            if known and (since_s is None or known[-1].time_s > since_s):
                laps.append(_lap_of_race(number, row.status, known))
        if not laps and since_s is not None:
            return None
        return History(session=self.session, whole=since_s is None, laps=tuple(laps), marks=HISTORY_MARKS)

    def done(self, driver: str, lap: int, until_s: float) -> bool | None:
        """Whether a car boxed at the end of a lap; None where that is not known by a time."""
        row = self.rows.get(lap)
        timed = next((t for t in row.cars if t.lap.driver == driver and t.time_s <= until_s), None) if row else None
        return None if timed is None else timed.lap.boxed


def _lap_of_race(number: int, status: Status, known: list[TimedLap]) -> LapOfRace:
    times = [timed.lap.lap_time_s for timed in known if timed.raced and timed.lap.lap_time_s is not None]
    mean = round(sum(times) / len(times), 3) if times else None
    return LapOfRace(lap=number, status=status, mean_lap_s=mean, cars=tuple(timed.lap for timed in known))
