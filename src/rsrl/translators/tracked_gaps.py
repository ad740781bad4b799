"""Where every car of a tracked race stands after a lap: race times, as the simulator counts them, from what a source has shown so far.

The simulator's state holds every car's race time after the same lap, the whole loss of a stop included as soon as the car has entered
the pit lane. A pit wall has less: cars behind have not crossed the line yet, and of a stop the crossing shows a part. So:

- measured: the car has crossed the line on that lap;
- derived: it has, and stopped; the rest of the loss is the expected one, corrected by how its time in the pit lane differed from others';
- projected: it has not; its last measured gap goes on at the pace it has lost or gained lately, and is at least what has passed;
- stated: no crossing is known, as after a late join, but the source gives a gap; or, without one, a place.
"""

from collections.abc import Mapping
from statistics import median
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.season import GREEN, RED
from rsrl.translators.race_tracker import RaceTracker
from rsrl.translators.tracked_car import TrackedCar, Visit

Source = Literal["measured", "derived", "projected", "stated"]

DRIFT_LAPS: Final = 5
"""Laps from which a car's loss or gain on the leader is taken."""

MOST_DRIFT_S: Final = 5.0
"""A lap that differs by more was no racing lap of one of the two."""

APART_S: Final = 0.5
"""Between cars of which the source gives the order only."""


class PitCosts(NamedTuple):
    """What stops cost: mean loss by driver and track status, s; and the share that the in-lap shows."""

    loss_s: Mapping[str, NDArray[np.float32]]
    in_share: float
    queue_gap_s: float  # between cars that queue up under a red flag
    slow_stops_s: Mapping[str, float]  # by driver: what slow stops add to the mean of a stop, beyond the median

    def of(self, car: TrackedCar, visit: Visit, usual_lane_s: float | None) -> tuple[float, float]:
        """Expected loss of a passage of the pit lane, and by how much it differs from it as timed, s."""
        if visit.status == RED or car.driver not in self.loss_s:
            return 0.0, 0.0
        lane_s = visit.lane_s
        # the usual time is a median, which slow stops hardly move; the mean loss has them in it
        excess = 0.0 if lane_s is None or usual_lane_s is None else lane_s - usual_lane_s - self.slow_stops_s[car.driver]
        return float(self.loss_s[car.driver][visit.status]), excess


class Standing(NamedTuple):
    """Race time of a car after a lap, on the session clock, and where it is from."""

    time_s: float
    source: Source


def standings(tracker: RaceTracker, lap: int, costs: PitCosts | None, *, under_way: bool) -> dict[int, Standing]:
    """Race times after `lap` of all running cars, by car number in their order; empty where no car is known to have completed it.

    Args:
        under_way: count the stops that cars have made since, on the lap under way, as if they had made them at the end of `lap`.
    """
    led_s = tracker.led_s(lap)
    if led_s is None:
        return {}
    usual_lane_s = tracker.usual_lane_s()
    found: dict[int, Standing] = {}
    placed: list[TrackedCar] = []
    for car in tracker.running():
        standing = _standing(tracker, car, lap, led_s)
        if standing is None:
            placed.append(car)
            continue
        found[car.number] = _with_stops(standing, car, lap, costs, usual_lane_s, under_way=under_way)
    if costs is not None and _stopped(tracker, lap):
        return _queue(tracker, lap, found, led_s, costs.queue_gap_s)
    for car in sorted(placed, key=lambda c: c.position or 99):
        if car.position is not None:
            found[car.number] = Standing(_between(found, car.position, led_s), "stated")
    # a car that has not crossed the line yet is behind one that does at this moment
    return dict(sorted(found.items(), key=lambda item: (item[1].time_s, item[1].source == "projected")))


def _standing(tracker: RaceTracker, car: TrackedCar, lap: int, led_s: float) -> Standing | None:
    """A car's own crossing after a lap, or the best estimate of it; None where nothing is known."""
    if lap in car.crossings:
        return Standing(car.crossings[lap], "measured")
    last = max((n for n in car.crossings if n < lap and n in tracker.led), default=None)
    if last is not None:
        gap = car.crossings[last] - tracker.led[last][0] + (lap - last) * _drift_s(tracker, car)
        if _stopped(tracker, last):  # the restart has closed whatever gap there was
            gap = APART_S * ((car.position or len(tracker.cars)) - 1)
        # a crossing that is missing though later ones are known is no lap still to come
        not_yet = tracker.time_s if car.laps < lap else led_s
        return Standing(max(led_s + gap, not_yet), "projected")
    if car.gap is not None and (car.gap.gap_to_leader_s is not None or car.gap.laps_down):
        laps_down = car.gap.laps_down or 0
        seconds = car.gap.gap_to_leader_s
        return Standing(led_s + (laps_down * tracker.usual_lap_s() if seconds is None else seconds), "stated")
    return None


def _drift_s(tracker: RaceTracker, car: TrackedCar) -> float:
    """What a car loses to the leader per racing lap lately, s; 0 under a neutralisation."""
    if tracker.status != GREEN:
        return 0.0
    lost = []
    for lap in sorted(car.crossings, reverse=True):
        if lap - 1 in car.crossings and lap - 1 in tracker.led and car.visit(lap) is None and car.visit(lap - 1) is None:
            own_s = car.crossings[lap] - car.crossings[lap - 1]
            lost.append(own_s - (tracker.led[lap][0] - tracker.led[lap - 1][0]))
            if len(lost) == DRIFT_LAPS:
                break
    usual = [d for d in lost if abs(d) < MOST_DRIFT_S]
    return median(usual) if usual else 0.0


def _with_stops(
    standing: Standing, car: TrackedCar, lap: int, costs: PitCosts | None, usual_lane_s: float | None, *, under_way: bool
) -> Standing:
    """With the loss of stops that the crossing does not show yet."""
    if costs is None:
        return standing
    time_s, source = standing
    for visit in car.visits:
        if visit.lap == lap or (under_way and visit.lap > lap):
            loss, excess = costs.of(car, visit, usual_lane_s)
            shown = costs.in_share if visit.lap == lap else 0.0
            time_s += (1 - shown) * loss + excess
            source = "derived"
    return Standing(time_s, source)


def _stopped(tracker: RaceTracker, lap: int) -> bool:
    """Whether the race stood still under a red flag on a lap of any car: cars may reach the pit lane on either side of the line."""
    if all(span.status != RED for span in tracker.spans):
        return False
    spans = [(c.crossings[lap - 1], c.crossings[lap]) for c in tracker.cars.values() if lap in c.crossings and lap - 1 in c.crossings]
    return tracker.lap_status(lap) == RED or any(
        status == RED for begin, end in spans for status, _ in tracker.statuses_between(begin, end)
    )


def _queue(tracker: RaceTracker, lap: int, found: Mapping[int, Standing], led_s: float, gap_s: float) -> dict[int, Standing]:
    """The field lined up behind a red flag: the order of the places stated, or of the crossings, one gap apart."""
    order = sorted(found, key=lambda number: (tracker.cars[number].position or 99, found[number].time_s))
    return {number: Standing(led_s + place * gap_s, "derived") for place, number in enumerate(order)}


def _between(found: Mapping[int, Standing], position: int, led_s: float) -> float:
    """A race time for a car of which the place alone is known."""
    times = sorted(standing.time_s for standing in found.values())
    if not times:
        return led_s + APART_S * (position - 1)
    return times[position - 2] + APART_S / 2 if 2 <= position <= len(times) + 1 else (times[-1] + APART_S if position > 1 else times[0])
