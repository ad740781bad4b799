"""Events followed into the log: snapshots and history by one thread, looks at the race by one thread for each car that somebody watches."""

from collections.abc import Callable
from typing import Final

from rsrl.feeds import Event, LapCompleted
from rsrl.season import RED, SC, VSC
from rsrl.translators import News, TrackedCar
from rsrl.wall.board import Board
from rsrl.wall.messages import STATUSES, LapOfCar
from rsrl.wall.race_log import LAP_BEGINS, LapRow, Look, RaceLog, TimedLap
from rsrl.wall.sources import Looker, Source
from rsrl.wall.tape import Tape, Timed

EVERY_S: Final = 1.0
"""Snapshots are at least so far apart on the clock of the race."""

BEFORE_S: Final = 10.0
"""And so far before the start, when there is little to see; a feed may begin an hour early."""

WORDS: Final = {VSC: "virtual safety car", SC: "safety car", RED: "red flag"}

Changed = Callable[[], None]
"""Called after whatever a viewer may see has changed."""


class BoardFollower:
    """Makes snapshots and history of a tape."""

    def __init__(self, source: Source, tape: Tape, log: RaceLog, changed: Changed) -> None:
        self._tape, self._log, self._changed = tape, log, changed
        self._timed = Timed(None)
        self._board = Board(log.session, source.head.record, self._timed)
        self._shown_at_s = 0.0

    def run(self) -> None:
        """Follow the tape to its end."""
        fresh = False
        for event in self._tape.read():
            if fresh and self._due(event):
                self._snap()
            news = self._timed.take(event)
            if isinstance(event, LapCompleted):
                self._lap(event)
            for one in news:
                self._news(one)
            fresh = True
        if fresh:
            self._snap()
        self._log.failed = self._tape.failed
        self._log.over = True
        self._changed()

    def _due(self, event: Event) -> bool:
        """Whether the race as it stands before an event is to be shown."""
        times = self._log.times_s
        if not times:
            return event.time_s > self._timed.tracker.time_s
        if not self._timed.started:
            return event.time_s - self._shown_at_s >= BEFORE_S
        return self._timed.clock_s(event.time_s) - times[-1] >= EVERY_S and event.time_s > self._timed.tracker.time_s

    def _snap(self) -> None:
        race = self._board.race(len(self._log.frames))
        if self._log.times_s and race.time_s < self._log.times_s[-1]:
            return
        self._log.show(race.time_s, race.model_dump_json())
        self._shown_at_s = self._timed.tracker.time_s
        self._changed()

    def _news(self, news: News) -> None:
        tracker, log, now_s = self._timed.tracker, self._log, self._timed.clock_s()
        if news.kind == "start":
            log.lap_starts_s.append(0.0)
        elif news.kind == "lap" and news.car is not None:
            laps = tracker.cars[news.car].laps
            if laps == tracker.leader_laps and len(log.lap_starts_s) <= laps < (tracker.total_laps or 999):
                missed = laps - len(log.lap_starts_s)  # of a race that was joined late
                log.lap_starts_s += [now_s] * (missed + 1)
        elif tracker.messages:
            return  # the source has race control's own words
        elif news.kind == "status":
            self._board.say(WORDS.get(tracker.status, "green"), "status")
        elif news.kind == "out" and news.car is not None and tracker.cars[news.car].out:
            driver = tracker.cars[news.car].driver
            self._board.say(f"{driver} is out", "out", driver)

    def _lap(self, event: LapCompleted) -> None:
        """Note a lap of a car in the history."""
        tracker = self._timed.tracker
        car = tracker.cars.get(event.car)
        if car is None or not event.at_line:
            return
        row = self._log.rows.setdefault(event.lap, LapRow("green"))
        if any(timed.lap.driver == car.driver for timed in row.cars):
            return
        row.status = STATUSES[tracker.lap_status(event.lap)]
        led_s = tracker.led_s(event.lap)
        boxed, left = car.visit(event.lap) is not None, car.visit(event.lap - 1) is not None
        lap = LapOfCar(
            driver=car.driver,
            lap_time_s=None if event.lap_time_s is None else round(event.lap_time_s, 3),
            gap_to_leader_s=None if led_s is None else round(event.time_s - led_s, 3),
            position=len(row.cars) + 1,
            boxed=boxed,
        )
        row.cars.append(TimedLap(self._timed.clock_s(event.time_s), lap, not (boxed or left or event.lap == 1)))


class LookFollower:
    """Makes the looks at one car of a tape."""

    def __init__(self, source: Source, tape: Tape, log: RaceLog, driver: str, changed: Changed) -> None:
        self._source, self._tape, self._log, self._driver, self._changed = source, tape, log, driver, changed
        self._timed = Timed(source.head.record if source.needs_states else None, source.stale_after_s)
        self._looker: Looker | None = None

    def run(self) -> None:
        """Follow the tape to its end."""
        for event in self._tape.read():
            news = self._timed.take(event)
            if self._looker is None or any(one.kind == "session" for one in news):
                self._looker = self._source.looker(self._timed.states)
            for one in news:
                car = next((c for c in self._timed.tracker.cars.values() if c.driver == self._driver), None)
                if car is not None and (why := self._why(one, car)):
                    self._look(car, why)

    def _why(self, news: News, car: TrackedCar) -> str:
        """Why a new look is due; "" where none is."""
        if news.kind == "start" or (news.kind == "lap" and news.car == car.number):
            return LAP_BEGINS
        if news.kind == "out" and news.car == car.number:
            return "out"
        if not self._source.needs_states:
            return ""  # the simulator knows the status of the coming lap as the lap begins
        if news.kind == "status" and not self._timed.tracker.is_out(car):
            return WORDS.get(self._timed.tracker.status, "green")
        return "new tyres" if news.kind == "tyres" and news.car == car.number and car.laps > 0 else ""

    def _look(self, car: TrackedCar, why: str) -> None:
        assert self._looker is not None
        known = self._looker.look(self._driver, self._timed.tracker)
        looks = self._log.looks.setdefault(self._driver, [])
        looks.append(
            Look(
                number=len(looks),
                time_s=self._timed.clock_s(),
                lap=car.laps + 1,
                why=why,
                status=STATUSES[self._timed.tracker.status if known.status is None else known.status],
                moment=known.moment,
                reason=known.reason,
                marks=known.marks,
                missing=known.missing,
            )
        )
        self._changed()
