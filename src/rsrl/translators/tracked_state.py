"""The tracked race as the full-field state of one car before its coming lap, with health: the translator of every recorded or live source.

The state is of the race after the last lap that the called car has completed, as the simulator's is, and holds what has happened since on
the lap under way: the track status of this moment, and the stops of rivals, as if made at the end of that lap.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.season import COMPOUNDS, RED, RaceRecord
from rsrl.simulator import Figures, compile_figures
from rsrl.simulator import layout as at
from rsrl.state import CarState, UnifiedRaceState
from rsrl.state.race_context import mean_stop_s
from rsrl.translators.health import Health, health_of
from rsrl.translators.race_tracker import News, RaceTracker
from rsrl.translators.tracked_car import TrackedCar
from rsrl.translators.tracked_gaps import PitCosts, Standing, standings
from rsrl.translators.tracked_pace import PaceTracker
from rsrl.translators.tracked_sets import WET_TYRES, FittedSet, fitted_set, lap_wear, sets_left, worn_by_lap

STALE = "stale: the source has told of no car for too long"

QUICKEST_SHARE = 0.85
"""A stated lap time below this share of the reference lap is a fault of the source."""


class Tracked(NamedTuple):
    """What is known for a call.

    Attributes:
        state: None where no call can be made.
        reason: why not; "" where it can.
        health: of the state, or of what there is instead of it.
    """

    state: UnifiedRaceState | None
    reason: str
    health: Health


class TrackedStates:
    """Makes states of one session from a tracker, for any of its cars.

    What every event changed must pass through `note` before the tracker takes the next, since who was around a car is known as it crosses
    the line. A new session needs new `TrackedStates`.

    Args:
        stale_after_s: no state is made when the source has told of no car for so long; None for sources that tell of laps alone.

    Raises:
        RsrlError: the race of the record was wet: there is no wet-weather model.
    """

    def __init__(self, record: RaceRecord, tracker: RaceTracker, stale_after_s: float | None = None) -> None:
        self.record, self.tracker, self._stale_after_s = record, tracker, stale_after_s
        self.figures: Figures = compile_figures(record)
        self._index = {car.driver: i for i, car in enumerate(record.cars)}
        loss_s = {driver: mean_stop_s(self.figures, i) for driver, i in self._index.items()}
        tail_s = float(self.figures.tail.mean() - np.median(self.figures.tail))
        slow_s = {driver: tail_s * float(self.figures.cars[at.C_TAIL, i]) for driver, i in self._index.items()}
        self._costs = PitCosts(loss_s, float(self.figures.track[at.T_IN_SHARE]), float(self.figures.track[at.T_SC_GAP]), slow_s)
        self._pace = PaceTracker(record, self.figures, self._costs)
        self._wear = np.zeros(record.laps + 1, np.float32)
        self._posteriors: dict[tuple[int, int], tuple[object, tuple[float, float]]] = {}

    def note(self, news: tuple[News, ...]) -> None:
        """Take in what an event changed, before the next event."""
        for one in news:
            if one.kind == "lap" and one.car is not None:
                self._pace.lap_done(self.tracker, self.tracker.cars[one.car])

    def state(self, number: int, *, under_way: bool = True) -> Tracked:
        """The race before the coming lap of a car, or on it, as far as it is known.

        Args:
            under_way: with the stops that rivals have made on the lap under way; False: as it stood when the last lap ended.
        """
        own = self.tracker.cars[number]
        lap = own.laps
        under_way = under_way and lap > 0  # the simulator knows of no stop before the first lap is done
        order = self._grid() if lap == 0 else standings(self.tracker, lap, self._costs, under_way=under_way)
        order = {n: standing for n, standing in order.items() if self.tracker.cars[n].driver in self._index}
        reason = self._why_not(own, order)
        if reason:
            return Tracked(None, reason, health_of(self.tracker, self.record, own, order, {}))
        leader_s = next(iter(order.values())).time_s
        sets: dict[int, FittedSet] = {}
        cars = []
        for place, (n, standing) in enumerate(order.items(), 1):
            car = self.tracker.cars[n]
            stops_until = self._last_stop(car, lap) if under_way else lap
            sets[n], entry = self._running_car(car, place, standing.time_s - leader_s, lap, stops_until)
            cars.append(entry)
        cars += self._retired_cars(order, lap)
        state = UnifiedRaceState(
            race=self.record.name,
            driver=own.driver,
            laps_completed=lap,
            total_laps=self.record.laps,
            track_status=self.tracker.status,
            status_laps=self._status_laps(lap, order[number].time_s - leader_s),
            cars=tuple(cars),
            compounds_used=frozenset(s.compound for s in own.stints if s.compound in COMPOUNDS and s.fitted_lap <= lap),
            sets_left=sets_left(self.record, own),
            previous_gap_ahead_s=self._previous_gap_s(own, lap),
        )
        return Tracked(state, "", health_of(self.tracker, self.record, own, order, sets))

    def _why_not(self, own: TrackedCar, order: dict[int, Standing]) -> str:
        """Why there is no state to call from; "" where there is one."""
        session, stint = self.tracker.session, own.stint_at(own.laps)
        if session is not None and session.kind not in ("race", "sprint"):
            return f"a {session.kind} session: nothing to call"
        if own.driver not in self._index:
            return f"{own.driver} is not in the season file of {self.record.name}"
        if self.tracker.is_out(own):
            return f"{own.driver} is out of the race"
        if own.laps >= self.record.laps:
            return "the race is over"
        if own.in_pit_lane:
            return "in the pit lane"
        if stint is None or stint.compound is None:
            return "the tyre fitted is unknown"
        if any((s := car.stint_at(car.laps)) is not None and s.compound in WET_TYRES for car in self.tracker.running()):
            return "intermediates or wets are in use, and there is no wet-weather model"
        if own.number not in order:
            return "no crossing of the line is known yet"
        if self._stale_after_s is not None and self.tracker.silent_s >= self._stale_after_s:
            return STALE
        return ""

    def _grid(self) -> dict[int, Standing]:
        """The field before the start, in the order of the season file's grid, as far apart as places on the grid cost."""
        numbers = {car.driver: car.number for car in self.tracker.running()}
        found, latest = {}, -np.inf
        for i, entry in enumerate(self.record.cars):
            if entry.driver in numbers:
                car = self.tracker.cars[numbers[entry.driver]]
                compound = fitted_set(self.tracker, self.record, car, car.stint_at(0), 0).compound
                launch_s = self.figures.tyres[COMPOUNDS.index(compound), at.Y_LAUNCH]
                latest = max(latest, float(self.figures.cars[at.C_START, i] + launch_s))
                found[car.number] = Standing(latest, "derived")
        return found

    def _last_stop(self, car: TrackedCar, lap: int) -> int:
        """The lap until which a car's stops count: `lap`, or a later one at the end of which it has entered the pit lane."""
        return max([lap, *(v.lap for v in car.visits)])

    def _running_car(self, car: TrackedCar, place: int, gap_s: float, lap: int, stops_until: int) -> tuple[FittedSet, CarState]:
        visit = car.visit(stops_until)
        changing = visit is not None and visit.out_s is None and not any(s.fitted_lap == visit.lap for s in car.stints)
        stint = None if changing else car.stint_at(stops_until)
        # of a car whose tyres nobody has told of, the set is that of the start, or of its last visit to the pit lane
        since = stops_until if changing else max((v.lap for v in car.visits if v.lap <= lap), default=0)
        fitted = fitted_set(self.tracker, self.record, car, stint, since)
        stops = min(car.stops_until(stops_until) + changing, lap)
        form_s, luck_s = self._posterior(car, stops_until)
        on_set = max(lap - fitted.fitted_lap, 0)
        worn = float(self._worn(car, lap)[lap]) if on_set else float(fitted.laps_before)
        return fitted, CarState(
            driver=car.driver,
            position=place,
            gap_to_leader_s=gap_s,
            last_lap_s=self._last_lap_s(car, lap),
            compound=fitted.compound,
            tyre_age_laps=fitted.laps_before + on_set,
            stops=stops,
            just_stopped=stops > 0 and 0 < lap <= fitted.fitted_lap,
            form_s=form_s,
            worn_laps=worn,
            set_luck_s=0.0 if changing else luck_s,
        )

    def _retired_cars(self, order: dict[int, Standing], lap: int) -> list[CarState]:
        """Cars that are out, the last to retire first; of them only the places count."""
        out = [car for n, car in self.tracker.cars.items() if n not in order and car.driver in self._index and car.stints]
        out.sort(key=lambda car: -car.laps)
        states = []
        for place, car in enumerate(out, len(order) + 1):
            fitted = fitted_set(self.tracker, self.record, car, car.stint_at(car.laps), 0)
            age = fitted.laps_before + max(min(car.laps, lap) - fitted.fitted_lap, 0)
            last_s = self._last_lap_s(car, min(car.laps, lap))
            states.append(CarState(car.driver, place, None, last_s, fitted.compound, age, car.stops_until(lap), running=False))
        return states

    def _status_laps(self, lap: int, gap_s: float) -> int:
        """Laps since the track status began, in laps of the leader as the car counts them."""
        laps_down = int(gap_s // float(self.figures.track[at.T_BASE]))
        return min(max(lap + 1 + laps_down - self.tracker.spans[-1].lap, 0), lap)

    def _last_lap_s(self, car: TrackedCar, lap: int) -> float:
        """The last lap time, or the best that stands for one that is missing or was driven under a red flag."""
        reference_s = float(self.figures.track[at.T_BASE])
        if lap == 0:
            return 0.0
        if self.tracker.lap_status(lap) == RED:
            return reference_s * float(self.figures.track[at.T_SC_FACTOR])
        driven = car.crossings.get(lap, np.nan) - car.crossings.get(lap - 1, np.nan)
        known = car.lap_times.get(lap, driven)
        if not known >= QUICKEST_SHARE * reference_s:
            earlier = [car.lap_times[n] for n in sorted(car.lap_times) if n < lap]
            known = earlier[-1] if earlier else reference_s
        return max(float(known), QUICKEST_SHARE * reference_s)

    def _previous_gap_s(self, own: TrackedCar, lap: int) -> float | None:
        """Gap to the car then ahead, one lap earlier; None for the leader."""
        if lap <= 1:
            return 0.0
        order = standings(self.tracker, lap - 1, self._costs, under_way=False)
        numbers = list(order)
        if own.number not in order:
            return 0.0
        place = numbers.index(own.number)
        return None if place == 0 else order[own.number].time_s - order[numbers[place - 1]].time_s

    def _worn(self, car: TrackedCar, lap: int) -> NDArray[np.float32]:
        """Wear at the end of each lap of the set it was driven on, float32 [lap + 1]."""
        for n in range(1, lap + 1):
            if self._wear[n] == 0:
                self._wear[n] = lap_wear(self.figures, self.tracker.lap_status(n))
        sets = [fitted_set(self.tracker, self.record, car, stint, stint.fitted_lap) for stint in car.stints]
        return worn_by_lap(self._wear, sets, lap)

    def _posterior(self, car: TrackedCar, lap: int) -> tuple[float, float]:
        """Form and set luck after a lap and the stop at its end."""
        lap = min(lap, self.record.laps)
        rests_on = (self._pace.laps_seen(car), tuple((s.fitted_lap, s.compound, s.laps_before) for s in car.stints))
        known = self._posteriors.get((car.number, lap))
        if known is None or known[0] != rests_on:
            done = min(lap, car.laps)
            known = (rests_on, self._pace.posterior(car, done, self._worn(car, done)))
            self._posteriors[car.number, lap] = known
        return known[1]
