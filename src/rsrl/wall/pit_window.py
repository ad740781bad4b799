"""Figures of the moment that need no futures: gaps and pace around the car, pit losses, the window of the next stop in clean air."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation import Moment
from rsrl.season import COMPOUNDS, GREEN, SC, VSC
from rsrl.simulator import layout as at
from rsrl.simulator.tyres import next_set
from rsrl.state import Observer
from rsrl.state.outlook import IMPOSSIBLE_S, lap_cost
from rsrl.wall.ahead import field_of
from rsrl.wall.messages import GapCar, PitLoss, Window

MARGIN_S: Final = 1.0
"""A lap is in the window if a stop at its end costs at most so much more than at the best one."""


def gap_chart(moment: Moment, observer: Observer) -> tuple[GapCar, ...]:
    """The field around the car, the leader first; pace is that of the next racing lap in clean air, from figures and laps shown."""
    f, k, _ = moment.arrays
    figures = observer.figures
    cars, times = field_of(moment)
    own_s = times[cars.index(moment.car)]
    pace = {
        car: float(
            figures.cars[at.C_PACE, car]
            + f[at.F_FORM, car]
            + f[at.F_LUCK, car]
            + f[at.F_COLD, car]
            + lap_cost(figures.tyres, k[at.K_COMPOUND, car], f[at.F_WEAR, car])
        )
        for car in cars
    }
    return tuple(
        GapCar(
            driver=moment.record.cars[car].driver,
            position=place,
            gap_s=round(time_s - own_s, 3),
            compound=COMPOUNDS[k[at.K_COMPOUND, car]],
            tyre_age_laps=int(k[at.K_AGE, car]),
            pace_s=round(pace[car] - pace[moment.car], 3),
        )
        for place, (car, time_s) in enumerate(zip(cars, times, strict=True), 1)
    )


def pit_loss(observer: Observer) -> PitLoss:
    """Mean losses of a stop of the car."""
    cost = observer.context.pit_cost_s
    return PitLoss(green_s=round(float(cost[GREEN]), 2), vsc_s=round(float(cost[VSC]), 2), sc_s=round(float(cost[SC]), 2))


def window(moment: Moment, observer: Observer) -> Window:
    """The window of the next stop, by the clean-air outlook: every later stop is made at its best time, on an empty track."""
    costs = _costs_s(moment, observer)
    best = costs.min(axis=1, initial=np.inf)
    if not len(best) or best.min() >= IMPOSSIBLE_S or best.min() > _to_flag_s(moment, observer):
        return Window(first_lap=None, last_lap=None, best_lap=None, compound=None, margin_s=MARGIN_S)
    i = first = last = int(best.argmin())
    inside = best <= best[i] + MARGIN_S
    while first > 0 and inside[first - 1]:
        first -= 1
    while last + 1 < len(inside) and inside[last + 1]:
        last += 1
    compound = COMPOUNDS[int(costs[i].argmin())]
    lap = moment.lap
    return Window(first_lap=lap + first, last_lap=lap + last, best_lap=lap + i, compound=compound, margin_s=MARGIN_S)


def _costs_s(moment: Moment, observer: Observer) -> NDArray[np.float64]:
    """Time to the flag of a stop at the end of each lap from this one on, for each compound, beyond the reference laps: [laps, 3]."""
    figures, table, car = observer.figures, observer.context.outlook, moment.car
    k = moment.arrays[1]
    fitted, used = int(k[at.K_COMPOUND, car]), int(k[at.K_USED, car])
    limit = int(figures.whole[at.I_MAX_LAPS_PER_SET])
    rows, driven = [], 0.0
    for ahead, lap in enumerate(range(moment.lap, moment.record.laps)):
        age = int(k[at.K_AGE, car]) + ahead
        driven += float(lap_cost(figures.tyres, fitted, np.float32(age)))
        row = np.full(3, np.inf)
        for new in range(3):
            left = int(k[at.K_SOFT_SETS + new, car])
            if left > 0 and not (limit and age >= limit):
                number = next_set(int(figures.sets[new, car]), left, figures.laps_before.shape[1])
                before = int(figures.laps_before[new, number, car])
                two = int((used | 1 << new).bit_count() > 1)
                row[new] = driven + float(observer.context.pit_cost_s[GREEN] + figures.tyres[new, at.Y_COLD] + table[lap, two, new, before])
        rows.append(row)
    return np.array(rows).reshape(-1, 3)


def _to_flag_s(moment: Moment, observer: Observer) -> float:
    """Time to the flag without another stop; infinite where the rules ask for one."""
    k, figures, car = moment.arrays[1], observer.figures, moment.car
    limit, age = int(figures.whole[at.I_MAX_LAPS_PER_SET]), int(k[at.K_AGE, car])
    left = moment.record.laps - moment.lap + 1
    if int(k[at.K_USED, car]).bit_count() < 2 or (limit and age + left > limit):
        return float("inf")
    return sum(float(lap_cost(figures.tyres, int(k[at.K_COMPOUND, car]), np.float32(age + i))) for i in range(left))
