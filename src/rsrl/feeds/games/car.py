"""One car of a game: its laps, stops and tyres, packet by packet."""

from collections.abc import Iterator
from typing import Any, Final, NamedTuple

from rsrl.feeds.events import Event, LapCompleted, PitIn, PitOut, Position, Retired, TyreFitted
from rsrl.feeds.games.words import COMPOUNDS, OUT

__all__ = ["CarLap", "GameCar", "lap_columns"]

FINISHED: Final = 3
RACING: Final = 2


class CarLap(NamedTuple):
    """What LapData says of a car, as far as it is read."""

    last_lap_ms: int
    current_lap_ms: int
    position: int
    lap: int
    pit_status: int
    stops: int
    result_status: int


class GameCar:
    """What has been told of a car, so that events tell what is new.

    Args:
        car: its number.
        grid: where it started; None from the pit lane.
    """

    def __init__(self, car: int, grid: int | None) -> None:
        self.car, self.grid = car, grid
        self.laps: set[int] = set()  # laps told, and those told with a time
        self.timed: set[int] = set()
        self.lap = self.stops = self.position = self.pit_status = 0
        self.crossed_s: float | None = None  # when the lap under way began
        self.finished = self.out = False
        self.compound = self.age_laps = self.stint = 0
        self.fitted: TyreFitted | None = None

    def update(self, now: CarLap, time_s: float) -> Iterator[Event]:
        """Events of a new LapData."""
        lap_before = self.lap
        self.lap, self.stops = now.lap, now.stops
        out = now.result_status in OUT
        if not self.finished and not out:
            yield from self._lap(now, lap_before, time_s)
            if now.result_status == RACING and bool(now.pit_status) != bool(self.pit_status):
                yield PitIn(time_s, self.car, now.lap) if now.pit_status else PitOut(time_s, self.car, now.lap)
        self.pit_status = now.pit_status
        if now.position and now.position != self.position:
            self.position = now.position
            yield Position(time_s, self.car, now.position)
        if out != self.out:
            self.out = out
            yield Retired(time_s, self.car, out)

    def _lap(self, now: CarLap, lap_before: int, time_s: float) -> Iterator[Event]:
        """The lap before the current one, and the current one where the car has taken the flag on it."""
        if now.lap < lap_before:  # a flashback has undone laps: they are driven, and told, again
            self.laps = {told for told in self.laps if told < now.lap}
            self.timed = {told for told in self.timed if told < now.lap}
            return
        self.finished = now.result_status == FINISHED
        if self.finished:  # of the last lap the games tell no moment, so its time has to do
            crossed_s = time_s if self.crossed_s is None else min(time_s, self.crossed_s + now.last_lap_ms / 1000)
            yield from self.completed(now.lap if now.lap == lap_before else now.lap - 1, now.last_lap_ms, crossed_s)
        elif now.lap > 1 and now.lap != lap_before:
            self.crossed_s = time_s - now.current_lap_ms / 1000
            yield from self.completed(now.lap - 1, now.last_lap_ms, self.crossed_s)

    def completed(self, lap: int, lap_ms: int, time_s: float, at_line: bool = True) -> Iterator[Event]:
        """The lap, where it has not been told of, or not with its time."""
        if lap < 1 or lap in self.timed or (lap in self.laps and not lap_ms):
            return
        self.laps.add(lap)
        if lap_ms:
            self.timed.add(lap)
        yield LapCompleted(time_s, self.car, lap, lap_ms / 1000 if lap_ms else None, at_line)

    def tyres(self, compound: int, age_laps: int, time_s: float) -> Iterator[Event]:
        """The set on the car: another one where its compound is another, or it is younger than it was."""
        if not self.stint:
            self.stint = self.stops + 1
            laps_before = max(age_laps - max(self.lap - 1, 0), 0) if self.stint == 1 else None
            fitted_lap = 0 if self.stint == 1 else None
        elif compound != self.compound or age_laps < self.age_laps:
            self.stint += 1
            laps_before, fitted_lap = age_laps, None
        else:
            self.age_laps = age_laps
            return
        self.compound, self.age_laps = compound, age_laps
        new = None if laps_before is None else laps_before == 0
        yield TyreFitted(time_s, self.car, self.stint, COMPOUNDS.get(compound), new, laps_before, fitted_lap)


def lap_columns(cars: Any) -> Iterator[CarLap]:
    """The rows of LapData as plain numbers, slot by slot."""
    return map(CarLap._make, zip(*(cars[name].tolist() for name in CarLap._fields), strict=True))
