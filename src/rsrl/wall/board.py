"""From the race tracker to the snapshot: the tower, stint bars, messages and weather, the same for every source.

Gaps are those of a car's last crossing of the line, so they stand still between crossings, under a safety car too.
"""

from bisect import bisect_right
from typing import Final

from rsrl.feeds import RaceControl
from rsrl.season import COMPOUNDS, RaceRecord
from rsrl.translators import TrackedCar
from rsrl.translators.tracked_sets import sets_left
from rsrl.wall.messages import STATUSES, Marks, Race, RaceControlMessage, StintBar, TowerRow, Tyre, WeatherNow
from rsrl.wall.tape import Timed

MOST_MESSAGES: Final = 40
SHOWN_OUT_S: Final = 20.0
"""For so long a car that has left the pit lane is shown as out of it."""

MARKS: Final[Marks] = {
    "tower": "measured",
    "tower.gap_to_leader_s": "measured",
    "tower.interval_s": "derived",
    "tower.laps_down": "derived",
    "tower.last_lap_s": "measured",
    "tower.tyre.compound": "measured",
    "tower.tyre.age_laps": "derived",
    "tower.sets_left": "measured",
    "tower.stops": "measured",
    "weather": "measured",
    "messages": "measured",
}


class Board:
    """Makes snapshots of one session.

    Args:
        record: of the race, for the sets of its cars; None where there is no season file.
    """

    def __init__(self, session: str, record: RaceRecord | None, timed: Timed) -> None:
        self.session, self.record, self.tracker = session, record, timed.tracker
        self.clock_s = timed.clock_s
        self.own_messages: list[RaceControlMessage] = []

    def order(self) -> list[TrackedCar]:
        """Cars in the order of the race: by laps and the time of the last crossing, the grid before that; those that are out last."""
        tracker = self.tracker
        grid = {} if self.record is None else {entry.driver: i for i, entry in enumerate(self.record.cars)}

        def key(car: TrackedCar) -> tuple[float, ...]:
            last = max(car.crossings, default=0)
            place = float(car.position or grid.get(car.driver, car.grid or 99))
            return (tracker.is_out(car), -max(last, car.laps), car.crossings.get(max(last, car.laps), float("inf")), place)

        return sorted(tracker.cars.values(), key=key)

    def race(self, sequence: int) -> Race:
        """The snapshot of this moment."""
        tracker = self.tracker
        led = [tracker.led[lap][0] for lap in sorted(tracker.led)]
        order = self.order()
        rows: list[TowerRow] = []
        for place, car in enumerate(order, 1):
            rows.append(self._row(car, place, order[place - 2] if place > 1 else None, led))
        lap = min(tracker.leader_laps + 1, tracker.total_laps or 999)
        heard = max((car.seen_s for car in order), default=tracker.time_s)
        return Race(
            session=self.session,
            sequence=sequence,
            time_s=self.clock_s(tracker.time_s),
            lap=lap,
            total_laps=tracker.total_laps,
            status=STATUSES[tracker.status],
            status_laps=max(lap - tracker.spans[-1].lap, 0),
            finished=tracker.over,
            tower=tuple(rows),
            messages=self._messages(),
            weather=self._weather(),
            age_s=round(max(tracker.time_s - heard, 0.0), 1) if heard > float("-inf") else 0.0,
            marks=MARKS,
        )

    def _row(self, car: TrackedCar, place: int, ahead: TrackedCar | None, led: list[float]) -> TowerRow:
        tracker = self.tracker
        last = max(car.crossings, default=0)
        out = tracker.is_out(car)
        crossed_s = car.crossings.get(last)
        leader_s = tracker.led_s(last)
        gap = None if crossed_s is None or leader_s is None or out or place == 1 else round(crossed_s - leader_s, 3)
        marks: Marks = {}
        if gap is None and car.gap is not None and not out and place > 1:
            gap = car.gap.gap_to_leader_s
        ahead_s = None if ahead is None else ahead.crossings.get(last)
        interval = None if crossed_s is None or ahead_s is None or out else round(crossed_s - ahead_s, 3)
        if interval is not None and interval < 0:
            interval = None  # the car ahead has lost its lead since: in the pit lane, the order and the last crossings disagree
        sets, told = self._sets(car)
        if sets is not None and not told:
            marks["sets_left"] = "derived"
        tyre, tyre_marks = _tyre(car)
        lap_time = car.lap_times.get(car.laps)
        return TowerRow(
            position=place,
            driver=car.driver,
            gap_to_leader_s=gap,
            interval_s=interval,
            laps_down=0 if crossed_s is None else max(bisect_right(led, crossed_s) - last, 0),
            laps=car.laps,
            last_lap_s=None if lap_time is None else round(lap_time, 3),
            best_lap_s=round(min(car.lap_times.values()), 3) if car.lap_times else None,
            tyre=tyre,
            stops=car.stops_until(_until(car)),
            sets_left=sets,
            pit="in" if car.in_pit_lane else "out" if self._just_out(car) else "",
            penalty_s=car.penalty_s,
            note=self._note(car),
            out=out,
            stints=_stints(car, car.laps if out else min(car.laps + 1, tracker.total_laps or 999)),
            marks=marks | tyre_marks,
        )

    def _just_out(self, car: TrackedCar) -> bool:
        out_s = car.visits[-1].out_s if car.visits else None
        return out_s is not None and 0 <= self.tracker.time_s - out_s < SHOWN_OUT_S

    def _sets(self, car: TrackedCar) -> tuple[tuple[int, int, int] | None, bool]:
        """Sets left, and whether the source stated them."""
        if car.sets_told is not None:
            return car.sets_told, True
        known = self.record is not None and any(entry.driver == car.driver for entry in self.record.cars)
        return (sets_left(self.record, car), False) if known and self.record is not None else (None, False)

    def _note(self, car: TrackedCar) -> str:
        for message in reversed(self.tracker.messages):
            if message.car == car.number and message.topic != "note":
                return message.topic
        return ""

    def _messages(self) -> tuple[RaceControlMessage, ...]:
        told = [self._message(m) for m in self.tracker.messages[-MOST_MESSAGES:]]
        every = sorted([*told, *self.own_messages[-MOST_MESSAGES:]], key=lambda m: m.time_s)
        return tuple(every[-MOST_MESSAGES:])

    def _message(self, message: RaceControl) -> RaceControlMessage:
        car = None if message.car is None else self.tracker.cars.get(message.car)
        led = [self.tracker.led[lap][0] for lap in sorted(self.tracker.led)]
        return RaceControlMessage(
            time_s=self.clock_s(message.time_s),
            lap=bisect_right(led, message.time_s) + 1,
            text=message.text,
            topic=message.topic,
            driver=car.driver if car else None,
        )

    def say(self, text: str, topic: str, driver: str | None = None) -> None:
        """Note what the source shows without a message of race control, such as a safety car of a simulated race."""
        tracker = self.tracker
        self.own_messages.append(
            RaceControlMessage(time_s=self.clock_s(tracker.time_s), lap=tracker.leader_laps + 1, text=text, topic=topic, driver=driver)
        )

    def _weather(self) -> WeatherNow | None:
        weather = self.tracker.weather
        return None if weather is None else WeatherNow(air_c=weather.air_c, track_c=weather.track_c, rain=weather.rain)


def _until(car: TrackedCar) -> int:
    """The lap until which a car's sets count: those fitted on the lap under way are on it."""
    return max([car.laps, *(stint.fitted_lap for stint in car.stints)])


def _tyre(car: TrackedCar) -> tuple[Tyre, Marks]:
    stint = car.stint_at(_until(car))
    if stint is None:
        return Tyre(compound=None, age_laps=None), {}
    before = stint.laps_before if stint.laps_before is not None else 0 if stint.new else None
    marks: Marks = {} if stint.told else {"tyre.compound": "assumed"}
    age = (before or 0) + max(car.laps - stint.fitted_lap, 0)
    if before is None:
        marks["tyre.age_laps"] = "assumed"
    return Tyre(compound=stint.compound, age_laps=age, new=stint.new), marks


def _stints(car: TrackedCar, until: int) -> tuple[StintBar, ...]:
    """Stints up to lap `until`, on which the set now fitted runs."""
    bars = []
    for i, stint in enumerate(car.stints):
        end = car.stints[i + 1].fitted_lap if i + 1 < len(car.stints) else max(until, stint.fitted_lap)
        compound = stint.compound if stint.compound in (*COMPOUNDS, "I", "W") else None
        bars.append(StintBar(compound=compound, first_lap=stint.fitted_lap + 1, last_lap=end, laps_before=stint.laps_before))
    return tuple(bars)
