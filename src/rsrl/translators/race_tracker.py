"""The race tracker: canonical events in, the race as a pit wall knows it out. Written once for every source.

It needs no figures of the race. It tolerates what real feeds do: a late join (counts without crossings), repeats, lines out of order,
laps that are missing, stints corrected later, cars that never start though a lap of theirs is listed, cars that fall silent.
"""

from collections.abc import Iterator
from statistics import median
from typing import Final, Literal, NamedTuple

from rsrl import feeds as said
from rsrl.laps.tyre_stops import DRIVE_THROUGH_S, FEWEST_PASSAGES, LED_THROUGH_SHARE, STOP_AND_GO_S
from rsrl.season import GREEN, RED, SC
from rsrl.translators.tracked_car import Stint, TrackedCar, Visit

SILENT_LAPS: Final = 2.5
"""A car of which nothing is heard for so many laps of the field, without a red flag, is taken to be out until it is heard of again."""

USUAL_LAP_S: Final = 100.0
"""A lap, where no lap of the race has been timed yet; only silence is measured with it."""


TOGETHER_S: Final = 0.01
"""Moments so near are one: sources round to the millisecond, and lap times and crossings by themselves."""


class News(NamedTuple):
    """What an event changed, as far as it may change a call: `car` is the car concerned, None for all."""

    kind: Literal["session", "start", "lap", "status", "pit in", "pit out", "tyres", "out", "over", "silence", "data"]
    car: int | None = None


class StatusSpan(NamedTuple):
    """A track status from `from_s` on; `lap` is the lap on which the leader then was."""

    from_s: float
    status: int
    lap: int


class RaceTracker:
    """Follows one session.

    Attributes:
        session: as last begun; None before the first event.
        time_s: the latest session time heard of.
        heard_s: when the source last told of any car on the track.
        quiet_s: by the reader's clock, how long nothing has come.
        cars: by car number.
        spans: track status over time, the first from before the start.
        total_laps: distance, None where no source said.
        leader_laps: laps completed by the leader.
        led: session time at which the first car completed each lap, and its number.
        aid_spans: when the following aid was enabled (True) or disabled; empty where the source does not say.
        messages: of race control.
    """

    def __init__(self) -> None:
        self._begin(None)
        self.time_s = 0.0

    def _begin(self, session: said.Session | None) -> None:
        self.session = session
        self.cars: dict[int, TrackedCar] = {}
        self.spans: list[StatusSpan] = [StatusSpan(float("-inf"), GREEN, 1)]
        self.total_laps: int | None = session.total_laps if session else None
        self.leader_laps = 0
        self.led: dict[int, tuple[float, int]] = {}
        self.aid_spans: list[tuple[float, bool]] = []
        self.messages: list[said.RaceControl] = []
        self.weather: said.Weather | None = None
        self.heard_s, self.quiet_s = float("-inf"), 0.0
        self.over = False
        self._started = False
        self._lap_statuses: dict[int, int] = {}
        self._usual = ((0, 0), USUAL_LAP_S)

    @property
    def status(self) -> int:
        """The track status now."""
        return self.spans[-1].status

    @property
    def silent_s(self) -> float:
        """For how long the source has told of no car, while cars race; 0 before the first lap, under a red flag and after the flag."""
        racing = bool(self.led) and self.status != RED and not self.over
        return self.age_s if racing else 0.0

    @property
    def age_s(self) -> float:
        """How long ago the source last told of a car, whatever the reason; 0 before it has."""
        return max(self.time_s - self.heard_s, self.quiet_s) if self.heard_s > float("-inf") else 0.0

    def running(self) -> list[TrackedCar]:
        """Cars that are in the race, as far as is known."""
        return [car for car in self.cars.values() if not self.is_out(car)]

    def is_out(self, car: TrackedCar) -> bool:
        """Whether a car is out: as the source says, disqualified, never started, or silent for `SILENT_LAPS`."""
        if car.out or car.disqualified:
            return True
        if not self.led or self.status == RED:
            return False
        since_s = max(car.seen_s, next(iter(self.led.values()))[0])
        if self.time_s - since_s < SILENT_LAPS * self.usual_lap_s():
            return False
        silent_s = sum(seconds for status, seconds in self.statuses_between(since_s, self.time_s) if status != RED)
        return silent_s > SILENT_LAPS * self.usual_lap_s()

    def led_s(self, lap: int) -> float | None:
        """When the first car completed a lap."""
        return self.led[lap][0] if lap in self.led else None

    def usual_lap_s(self) -> float:
        """Median of the leaders' last laps, s."""
        known = (len(self.led), self.leader_laps)
        if self._usual[0] != known:
            self._usual = (known, self._median_lap_s())
        return self._usual[1]

    def _median_lap_s(self) -> float:
        laps = sorted(self.led)[-6:]
        times = [self.led[b][0] - self.led[a][0] for a, b in zip(laps, laps[1:], strict=False) if b == a + 1]
        return median(times) if times else USUAL_LAP_S

    def statuses_between(self, begin_s: float, end_s: float) -> Iterator[tuple[int, float]]:
        """Track status and its duration in s, for each status in a stretch of time."""
        for i, span in enumerate(self.spans):
            until = self.spans[i + 1].from_s if i + 1 < len(self.spans) else float("inf")
            shared = min(until, end_s) - max(span.from_s, begin_s)
            if shared > TOGETHER_S:
                yield span.status, shared

    def lap_status(self, lap: int) -> int:
        """The track status under which the leaders drove most of a lap; that of its beginning where its times are unknown."""
        if lap in self._lap_statuses:
            return self._lap_statuses[lap]
        status = self._lap_status(lap)
        if lap < self.leader_laps:  # over for good
            self._lap_statuses[lap] = status
        return status

    def _lap_status(self, lap: int) -> int:
        begin, end = self.led_s(lap - 1), self.led_s(lap)
        if lap > 1 and begin is None and end is None:
            return GREEN
        end = self.time_s if end is None else end
        begin = end - self.usual_lap_s() if begin is None else begin
        shares: dict[int, float] = {}
        for status, seconds in self.statuses_between(begin, end):
            shares[status] = shares.get(status, 0.0) + seconds
        return RED if RED in shares else max(shares, key=lambda s: shares[s], default=self.status)

    def take(self, event: said.Event) -> tuple[News, ...]:
        """Take in an event; what it changed."""
        if isinstance(event, said.Session):
            self._begin(event)
            self.time_s = event.time_s
            return (News("session"),)
        self.time_s = max(self.time_s, event.time_s)
        match event:
            case said.Entry():
                car = self.cars.setdefault(event.car, TrackedCar(event.car, event.driver))
                car.driver, car.team, car.grid = event.driver, event.team or car.team, event.grid or car.grid
            case said.StatusChanged() if event.status != self.status:
                self.spans.append(StatusSpan(event.time_s, event.status, self.leader_laps + 1))
                return (News("status"),)
            case said.LapCount():
                return self._count(event)
            case said.OvertakeAid():
                self.aid_spans.append((event.time_s, event.enabled))
            case said.Weather():
                self.weather = event
            case said.RaceControl():
                return self._message(event)
            case said.SessionOver():
                self.over = True
                return (News("over"),)
            case said.Heartbeat() if event.silent_s > 0:
                self.quiet_s = event.silent_s
            case said.Heartbeat() if event.on_track:
                self._heard(event.time_s)
            case said.StatusChanged() | said.Heartbeat():
                pass
            case _:
                return self._of_car(event, self.cars[event.car]) if event.car in self.cars else ()
        return ()

    def _of_car(self, event: said.Event, car: TrackedCar) -> tuple[News, ...]:
        if not isinstance(event, said.TyreFitted | said.SetsLeft | said.Retired):
            car.seen_s = max(car.seen_s, event.time_s)
            self._heard(event.time_s)
        match event:
            case said.LapCompleted():
                return self._lap(event, car)
            case said.PitIn():
                return self._pit_in(event, car)
            case said.PitOut() if car.visits and car.visits[-1].out_s is None:
                car.visits[-1].out_s = event.time_s
                return (News("pit out", car.number),)
            case said.TyreFitted():
                return (News("tyres", car.number),) if car.fit(self._stint(event, car)) else ()
            case said.Position():
                car.position = event.position
            case said.Gap():
                car.gap, car.gap_at_s = event, event.time_s
            case said.SetsLeft():
                car.sets_told = (event.soft, event.medium, event.hard)
            case said.Retired() if event.out != car.out:
                car.out = event.out
                return (News("out", car.number),)
        return ()

    def _heard(self, time_s: float) -> None:
        self.heard_s, self.quiet_s = max(self.heard_s, time_s), 0.0

    def _count(self, event: said.LapCount) -> tuple[News, ...]:
        self.total_laps = event.total_laps or self.total_laps
        self.leader_laps = max(self.leader_laps, event.lap - 1)
        if event.lap == 1 and not self._started:
            self._started = True
            return (News("start"),)
        return ()

    def _message(self, event: said.RaceControl) -> tuple[News, ...]:
        self.messages.append(event)
        car = None if event.car is None else self.cars.get(event.car)
        if car is None:
            return ()
        if event.topic == "disqualified" and not car.disqualified:
            car.disqualified = True
            return (News("out", car.number),)
        if event.topic == "time penalty":
            car.penalty_s += event.seconds or 0.0
        elif event.topic == "penalty served":
            car.penalty_s = max(car.penalty_s - (event.seconds or car.penalty_s), 0.0)
        return ()

    def _lap(self, event: said.LapCompleted, car: TrackedCar) -> tuple[News, ...]:
        known = event.lap in car.crossings or event.lap < car.laps or (event.lap == car.laps and not event.at_line)
        if event.lap_time_s is not None:
            car.lap_times[event.lap] = event.lap_time_s
        if event.at_line:
            car.crossings.setdefault(event.lap, event.time_s)
            first = self.led.get(event.lap)
            if first is None or event.time_s < first[0]:
                self.led[event.lap] = (event.time_s, car.number)
        self.leader_laps = max(self.leader_laps, event.lap)
        if known:
            return ()
        car.laps = max(car.laps, event.lap)
        if (visit := car.visit(event.lap - 1)) is not None:
            self._assume_stop(car, visit)
        return (News("lap", car.number),)

    def _pit_in(self, event: said.PitIn, car: TrackedCar) -> tuple[News, ...]:
        lap = car.laps + 1 if event.lap is None else event.lap
        if car.visit(lap) is not None or car.in_pit_lane:
            return ()
        car.visits.append(Visit(lap, event.time_s, self.status))
        return (News("pit in", car.number),)

    def _stint(self, event: said.TyreFitted, car: TrackedCar) -> Stint:
        """The stint of an event. A set without a lap was fitted on the last passage of the pit lane, or else now."""
        lap = event.fitted_lap
        if lap is None:
            lap = 0 if event.stint == 1 else car.laps
            if event.stint > 1 and car.visits and car.laps - car.visits[-1].lap <= 1:
                lap = car.visits[-1].lap
        return Stint(event.stint, lap, event.compound, event.new, event.laps_before)

    def usual_lane_s(self) -> float | None:
        """Median time in the pit lane of the changes of tyres so far, not under a red flag; None before `FEWEST_PASSAGES` of them."""
        lanes = [
            v.lane_s
            for car in self.cars.values()
            for v in car.visits
            if v.lane_s is not None and v.status != RED and any(s.fitted_lap == v.lap and s.told for s in car.stints)
        ]
        return median(lanes) if len(lanes) >= FEWEST_PASSAGES else None

    def _assume_stop(self, car: TrackedCar, visit: Visit) -> None:
        """A passage as long as a change of tyres, of which the tyre record has nothing a lap later, was one, onto an unknown set."""
        usual_s = self.usual_lane_s()
        if usual_s is None or visit.lane_s is None or visit.status == RED or any(s.fitted_lap == visit.lap for s in car.stints):
            return
        together = sum(other.visit(visit.lap) is not None for other in self.running())
        led_through = visit.status == SC and together >= LED_THROUGH_SHARE * len(self.running())
        if not led_through and -DRIVE_THROUGH_S <= visit.lane_s - usual_s <= STOP_AND_GO_S and car.stints:
            car.fit(Stint(car.stints[-1].number + 1, visit.lap, None, None, None, told=False))
