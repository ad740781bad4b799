"""TimingData to events, car by car: laps, gaps, places, pit lane, retirements."""

from collections.abc import Iterator, Mapping
from typing import Any, Final

from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.events import Event, Gap, LapCompleted, PitIn, PitOut, Position, Retired
from rsrl.feeds.live_timing.values import flag, lap_time_s, mapping, parse_gap, whole
from rsrl.laps.schema import MOST_LAPS
from rsrl.season import MAX_CARS

__all__ = ["TOLD", "CarTiming", "Progress"]

TIME_NEAR_LINE_S: Final = 20.0
"""A lap time comes up to a second before its lap's count, or after it, and the next one a lap later."""

MOST_DELAY_S: Final = 90.0
"""A lap told of later than this is not late: the lap time is of another lap."""


TOLD: Final = frozenset(
    ("NumberOfPitStops", "NumberOfLaps", "LastLapTime", "InPit", "PitOut", "Position", "GapToLeader", "IntervalToPositionAhead")
) | {"Stopped", "Retired"}
"""What is read of a line; most lines are of sectors and speeds alone, and hold none of it."""


class Progress:
    """How far the session is, as far as the timing of a car depends on it.

    Attributes:
        started: the race is on: cars have left the grid.
        leader_lap: the lap the leader is on, None where unknown.
        total_laps: None where unknown.
        finished: the leader has taken the flag.
    """

    def __init__(self) -> None:
        self.started = self.finished = False
        self.leader_lap: int | None = None
        self.total_laps: int | None = None


class CarTiming:
    """One car's timing: what has been said of it, so that events tell what is new.

    Args:
        car: its number.
        progress: of the session, shared by all cars.
    """

    def __init__(self, car: int, progress: Progress, anomalies: Anomalies) -> None:
        self.car, self.progress, self.anomalies = car, progress, anomalies
        self.laps: int | None = None
        self.crossed_s = self.timed_s = 0.0  # when the last lap ended, and when a lap time came that may be of the lap to be counted
        self.line_before_s: float | None = None  # the crossing before that one
        self.lap_time_s: float | None = None  # of the last lap
        self.at_line = False  # the last lap's end was seen
        self.early_time_s: float | None = None
        self.in_pit: bool | None = None  # not known before the feed says so
        self.boxed = False  # a visit to the pit lane has been told of and is not over
        self.flagged = False
        self.position: int | None = None
        self.stopped = self.retired = self.out = False
        self.leader_gap: tuple[float | None, int | None] = (None, None)
        self.interval_s: float | None = None

    def update(self, line: Mapping[str, Any], time_s: float, snapshot: bool) -> Iterator[Event]:
        """Events of a change of this car's line."""
        if "NumberOfPitStops" in line and (whole(line["NumberOfPitStops"], MOST_LAPS) or 0) > 0:
            self.progress.started = True
        if "NumberOfLaps" in line or "LastLapTime" in line:
            yield from self._laps(line, time_s, snapshot)
        if "InPit" in line or "PitOut" in line:
            yield from self._pit_lane(line, time_s, snapshot)
        if "Position" in line:
            position = whole(line["Position"], MAX_CARS)
            if position and position != self.position:
                self.position = position
                yield Position(time_s, self.car, position)
        if "GapToLeader" in line or "IntervalToPositionAhead" in line:
            yield from self._gaps(line, time_s)
        if "Stopped" in line or "Retired" in line:
            yield from self._retirement(line, time_s)

    def _laps(self, line: Mapping[str, Any], time_s: float, snapshot: bool) -> Iterator[Event]:
        lap_time = lap_time_s(mapping(line.get("LastLapTime")).get("Value"))
        laps = whole(line.get("NumberOfLaps"), MOST_LAPS)
        if laps and self._believable(laps):
            yield self._completed(laps, lap_time, time_s, snapshot)
        elif lap_time is not None and not snapshot:
            if self.laps is None or time_s - self.crossed_s > TIME_NEAR_LINE_S:
                self.early_time_s, self.timed_s = lap_time, time_s
            elif lap_time != self.lap_time_s:
                self.lap_time_s = lap_time
                self.crossed_s = self._crossing(self.crossed_s, lap_time)
                yield LapCompleted(self.crossed_s, self.car, self.laps, lap_time)

    def _crossing(self, told_s: float, lap_time: float | None) -> float:
        """When the car crossed the line, of which the feed told at `told_s`.

        It tells late, by tenths of a second as a rule and by half a minute now and then, and never early. The crossing before and the lap
        time say as much, so the earlier of the two is nearer the truth.
        """
        if lap_time is None or self.line_before_s is None:
            return told_s
        by_lap_time_s = self.line_before_s + lap_time
        return by_lap_time_s if told_s - MOST_DELAY_S < by_lap_time_s < told_s else told_s

    def _believable(self, laps: int) -> bool:
        """Whether a count of laps is new, and may be true."""
        if self.laps is not None and laps <= self.laps:
            if laps < self.laps:
                self.anomalies.add("laps counted back", f"car {self.car}: {laps} after {self.laps}")
            return False
        if self.progress.leader_lap is not None and laps > self.progress.leader_lap + 1:
            self.anomalies.add("laps ahead of the leader", f"car {self.car}: {laps} on lap {self.progress.leader_lap}")
            return False
        return True

    def _completed(self, laps: int, lap_time: float | None, time_s: float, snapshot: bool) -> LapCompleted:
        told_s = time_s
        if self.early_time_s is not None and 0 <= time_s - self.timed_s < TIME_NEAR_LINE_S and not snapshot:
            told_s = self.timed_s
            lap_time = self.early_time_s if lap_time is None else lap_time
        self.early_time_s = None
        self.line_before_s = self.crossed_s if self.laps == laps - 1 and self.at_line else None
        self.laps, self.crossed_s, self.lap_time_s, self.at_line = laps, self._crossing(told_s, lap_time), lap_time, not snapshot
        self.progress.started = True
        self.flagged = self.flagged or self.progress.finished or laps == self.progress.total_laps
        return LapCompleted(self.crossed_s, self.car, laps, lap_time, at_line=not snapshot)

    def _pit_lane(self, line: Mapping[str, Any], time_s: float, snapshot: bool) -> Iterator[Event]:
        """Visits to the pit lane in the race: laps to the grid and the way home after the flag are none."""
        in_pit, leaving = flag(line.get("InPit")), flag(line.get("PitOut"))
        racing = self.progress.started and not self.flagged and not self.out
        lap = None if self.laps is None else self.laps + 1
        if in_pit and not self.in_pit and racing and not self.boxed:
            self.boxed = True
            yield PitIn(time_s, self.car, lap or (None if snapshot else 1))
        if self.boxed and (in_pit is False or leaving):
            self.boxed = False
            yield PitOut(time_s, self.car, lap)
        elif leaving and in_pit is False and self.in_pit is not False and racing:  # went in before the feed was joined
            yield PitOut(time_s, self.car, lap)
        if in_pit is not None:
            self.in_pit = in_pit

    def _gaps(self, line: Mapping[str, Any], time_s: float) -> Iterator[Event]:
        leader_gap, interval_s = self.leader_gap, self.interval_s
        if "GapToLeader" in line:
            leader_gap = parse_gap(line["GapToLeader"])
        if "IntervalToPositionAhead" in line and "Value" in (ahead := mapping(line["IntervalToPositionAhead"])):
            leading = isinstance(ahead["Value"], str) and ahead["Value"].startswith("LAP")
            interval_s = None if leading else parse_gap(ahead["Value"])[0]
        if (leader_gap, interval_s) != (self.leader_gap, self.interval_s):
            self.leader_gap, self.interval_s = leader_gap, interval_s
            yield Gap(time_s, self.car, *leader_gap, interval_s)

    def _retirement(self, line: Mapping[str, Any], time_s: float) -> Iterator[Event]:
        """Out of the race: retired, or stopped, since many a retired car is only ever called stopped."""
        stopped, retired = flag(line.get("Stopped")), flag(line.get("Retired"))
        self.stopped = self.stopped if stopped is None else stopped
        self.retired = self.retired if retired is None else retired
        out = self.stopped or self.retired
        if out != self.out and not self.flagged:
            self.out = out
            yield Retired(time_s, self.car, out)
