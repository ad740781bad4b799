"""A look ahead over some laps, in simulated futures: who stops when, where a stop rejoins and what traffic costs there, duels around stops.

Everything that the pit wall cannot see is drawn anew in every future (`rsrl.rollouts`).
"""

from collections import Counter
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation import Moment
from rsrl.explanation.moment import Arrays
from rsrl.rollouts import FutureBatch
from rsrl.rollouts.expected_laps import add_stop
from rsrl.season import GREEN, RaceRecord
from rsrl.simulator import layout as at
from rsrl.simulator.race_arrays import RaceArrays
from rsrl.state import Observer
from rsrl.state.race_context import mean_stop_s
from rsrl.statistics import mean_interval, proportion_interval
from rsrl.wall.messages import CALLS, Duel, Interval, Rejoin, StopOdds

FUTURES: Final = 400
DUEL_FUTURES: Final = 200
TRAFFIC_LAPS: Final = 5
WITHIN: Final = (1, 3, 5)
NEAR_S: Final = 8.0
"""Cars so near ahead or behind are fought around the stops."""

SALT: Final = 0x9A11
"""Keeps these futures apart from those of every what-if."""


class Field(NamedTuple):
    """The running cars of a moment in order, with race times against the leader's, s."""

    cars: tuple[int, ...]
    times_s: tuple[float, ...]


def field_of(moment: Moment) -> Field:
    """The field of a moment."""
    f, k, r = moment.arrays
    cars = tuple(int(car) for car in k[at.K_ORDER, : r[at.R_RUNNING]])
    leader = float(f[at.F_TIME, cars[0]])
    return Field(cars, tuple(float(f[at.F_TIME, car]) - leader for car in cars))


def called_for(arrays: Arrays, before: int, car: int, reactive: bool) -> Arrays:
    """Copies of a race's arrays with car `car` called from outside instead of car `before`, which then calls as teams do."""
    f, k, r = arrays[0].copy(), arrays[1].copy(), arrays[2].copy()
    k[at.K_CALLER, before] = at.REACTIVE if reactive else at.PLANNED
    k[at.K_CALLER, car], k[at.K_PLAN, car], k[at.K_NEXT, car] = at.CALLED, -1, at.NO_STOP
    return f, k, r


class Ahead:
    """Looks ahead from one moment.

    Args:
        observer: of the moment's record and car.
        seed: of the futures.
    """

    def __init__(self, moment: Moment, observer: Observer, seed: int) -> None:
        self._moment, self._observer, self._seed = moment, observer, seed ^ SALT
        self._figures, self._record = observer.figures, moment.record
        self._reactive = bool(self._figures.rivals.age.size)
        self._left = moment.record.laps - moment.lap + 1  # laps still to run

    def odds(self) -> tuple[StopOdds, ...]:
        """Chances of the rivals' stops over the next laps, if the car stays out."""
        moment = self._moment
        futures = FutureBatch(self._figures, moment.car, RaceArrays(*moment.arrays), FUTURES, self._seed)
        before, shares = moment.arrays[1][at.K_STOPS], {}
        for lap in range(1, min(max(WITHIN), self._left) + 1):
            futures.advance(0)
            shares[lap] = (futures.races.k[:, at.K_STOPS] > before).mean(axis=0)
        last = max(shares)
        cars = field_of(moment).cars
        return tuple(
            StopOdds(
                driver=_code(self._record, car),
                position=place,
                within_1=_share(shares[1][car]),
                within_3=_share(shares[min(3, last)][car]),
                within_5=_share(shares[min(5, last)][car]),
            )
            for place, car in enumerate(cars, 1)
            if car != moment.car
        )

    def rejoin(self, call: int) -> Rejoin | None:
        """Where a stop at the end of this lap rejoins, call 1 to 3; None where the car has no lap left after it."""
        if self._left < 2:
            return None
        moment, car = self._moment, self._moment.car
        futures = FutureBatch(self._figures, car, RaceArrays(*moment.arrays), FUTURES, self._seed)
        futures.advance(call)
        f, k, r = futures.races
        rows = np.arange(FUTURES)
        place = k[:, at.K_PLACE, car]
        mine = f[:, at.F_TIME, car].astype(np.float64)
        ahead = k[rows, at.K_ORDER, np.maximum(place - 1, 0)]
        behind = k[rows, at.K_ORDER, np.minimum(place + 1, at.CARS - 1)]
        has_ahead, has_behind = place > 0, place + 1 < r[:, at.R_RUNNING]
        gap_ahead = mine[has_ahead] - f[rows, at.F_TIME, ahead][has_ahead]
        gap_behind = f[rows, at.F_TIME, behind][has_behind] - mine[has_behind]
        first, first_share = self._commonest(ahead[has_ahead])
        next_, next_share = self._commonest(behind[has_behind])
        laps = min(TRAFFIC_LAPS, self._left - 1)
        low, middle, high = np.quantile(place + 1, (0.1, 0.5, 0.9), method="inverted_cdf")
        return Rejoin(
            compound=CALLS[call],
            position=int(middle),
            low=int(low),
            high=int(high),
            ahead=first,
            ahead_share=first_share,
            behind=next_,
            behind_share=next_share,
            gap_ahead_s=_median(gap_ahead),
            gap_behind_s=_median(gap_behind),
            traffic_s=_mean(self._lost_in_traffic(futures, laps)),
            traffic_laps=laps,
            futures=FUTURES,
        )

    def _lost_in_traffic(self, futures: FutureBatch, laps: int) -> NDArray[np.float64]:
        """Time lost to other cars on the racing laps among the next `laps`, s, by future: a lap against the same lap with nobody near."""
        car, (f, k, r) = self._moment.car, futures.races
        lost = np.zeros(len(futures))
        for _ in range(laps):
            before = f[:, at.F_TIME, car].astype(np.float64)
            racing = (r[:, at.R_STATUS] == GREEN) & (r[:, at.R_RESTART] == 0)
            futures.advance(0)
            racing &= (k[:, at.K_STOPPED, car] == 0) & (k[:, at.K_PLACE, car] < r[:, at.R_RUNNING])
            lost += np.where(racing, f[:, at.F_TIME, car] - before - f[:, at.F_RAW, car], 0.0)
        return lost

    def _commonest(self, cars: NDArray[np.int32]) -> tuple[str | None, float]:
        if not len(cars):
            return None, 0.0
        car, count = Counter(cars.tolist()).most_common(1)[0]
        return _code(self._record, car), _share(count / FUTURES)

    def duels(self, call: int) -> tuple[Duel, ...]:
        """Cuts of the car next ahead and threats of the one next behind, where they are near; call 1 to 3 is the car's own stop."""
        own = self._moment.car
        cars, times = field_of(self._moment)
        place = cars.index(own)
        found: list[Duel] = []
        if self._left < 4:
            return ()
        if place > 0 and times[place] - times[place - 1] <= NEAR_S:
            rival, gap = cars[place - 1], times[place] - times[place - 1]
            theirs = self._stop_of(rival, call)
            found += self._duel("undercut", rival, gap, (own, call), (rival, theirs), 1, first_attacks=True)
            found += self._duel("overcut", rival, gap, (rival, theirs), (own, call), 2, first_attacks=False)
        if place + 1 < len(cars) and times[place + 1] - times[place] <= NEAR_S:
            rival, gap = cars[place + 1], times[place + 1] - times[place]
            theirs = self._stop_of(rival, call)
            found += self._duel("undercut threat", rival, gap, (rival, theirs), (own, call), 1, first_attacks=True)
            found += self._duel("overcut threat", rival, gap, (own, call), (rival, theirs), 2, first_attacks=False)
        return tuple(found)

    def _stop_of(self, car: int, call: int) -> int:
        """The stop a rival is taken to make: for our compound if it has a set of it, or else for the hardest it has; 0 without a set."""
        left = self._moment.arrays[1][at.K_SOFT_SETS : at.K_SOFT_SETS + 3, car]
        if left[call - 1] > 0:
            return call
        return max((c for c in (1, 2, 3) if left[c - 1] > 0), default=0)

    def _duel(
        self, kind: str, rival: int, gap_s: float, first: tuple[int, int], second: tuple[int, int], later: int, *, first_attacks: bool
    ) -> Sequence[Duel]:
        """One stops as if at the end of the last lap, the other `later` laps after it; who is ahead then?"""
        (one, one_call), (two, two_call) = first, second
        if not one_call or not two_call:
            return ()
        moment, status = self._moment, int(self._moment.arrays[2][at.R_STATUS])
        f, k, r = called_for(moment.arrays, moment.car, two, self._reactive)
        context = self._observer.context._replace(pit_cost_s=mean_stop_s(self._figures, one))
        add_stop(self._figures, context, f, k, r, np.int32(one), np.int32(one_call - 1), np.int32(status))
        futures = FutureBatch(self._figures, two, RaceArrays(f, k, r), DUEL_FUTURES, self._seed)
        for _ in range(later - 1):
            futures.advance(0)
        futures.advance(two_call)
        first_ahead = futures.races.f[:, at.F_TIME, one] < futures.races.f[:, at.F_TIME, two]
        share = float((first_ahead if first_attacks else ~first_ahead).mean())
        low, high = proportion_interval(share, DUEL_FUTURES)
        chance = Interval(mean=_share(share), low=_share(low), high=_share(high))
        driver = _code(self._record, rival)
        return [Duel(kind=kind, rival=driver, gap_s=round(gap_s, 3), chance=chance, futures=DUEL_FUTURES)]  # type: ignore[arg-type]


def _code(record: RaceRecord, car: int) -> str:
    return record.cars[car].driver


def _share(value: float) -> float:
    return round(float(min(max(value, 0.0), 1.0)), 3)


def _median(values: NDArray[np.float64]) -> float | None:
    return round(float(np.median(values)), 2) if len(values) else None


def _mean(values: NDArray[np.float64]) -> Interval:
    low, high = mean_interval(values)
    return Interval(mean=round(float(values.mean()), 2), low=round(low, 2), high=round(high, 2))
