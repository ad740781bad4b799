"""Laps of a race at their expected times, compiled: the projection from which a counterfactual some laps ahead is built.

Nothing random is drawn. Each car laps at the pace expected of it from the fitted figures and the laps it has shown, on tyres that wear;
rivals do not stop, and the car under explanation stops only where a call says so. A car is held up by a slower one ahead unless it is
quicker by the pace a pass takes. A safety car that is out goes in after CAUTION_LAPS, and does not close up the field.
"""

import numpy as np

from rsrl.compiled import kernel
from rsrl.season import GREEN, SC
from rsrl.simulator import layout as at
from rsrl.simulator.tyres import laps_on_next_set
from rsrl.state.outlook import lap_cost

ZERO, ONE, HALF = np.float32(0.0), np.float32(1.0), np.float32(0.5)
CAUTION_LAPS = np.int32(3)
"""Laps that a safety car is assumed to last. Its real length is hidden from a policy; sampled futures draw it."""


@kernel(inline=True)
def sort_by_time(f, k, r):
    """Order the running cars by race time; cars level on time keep their order."""
    # Insertion sort: after one lap nearly all cars are still in order, and a kernel cannot allocate.
    for first in range(1, r[at.R_RUNNING]):
        p = first
        while p > 0 and f[at.F_TIME, k[at.K_ORDER, p]] < f[at.F_TIME, k[at.K_ORDER, p - 1]]:
            car, other = k[at.K_ORDER, p], k[at.K_ORDER, p - 1]
            k[at.K_ORDER, p - 1], k[at.K_ORDER, p] = car, other
            k[at.K_PLACE, car], k[at.K_PLACE, other] = p - 1, p
            p -= 1


@kernel(inline=True)
def gap_to_next(f, k, p):
    """Gap from the car in place index p (1 or more) to the car one place ahead, s."""
    return f[at.F_TIME, k[at.K_ORDER, p]] - f[at.F_TIME, k[at.K_ORDER, p - 1]]


@kernel(inline=True)
def expected_pace(fig, f, k, car):
    """Expected time of a car's coming racing lap in clean air, relative to the race's reference lap, s."""
    tyre = lap_cost(fig.tyres, k[at.K_COMPOUND, car], f[at.F_WEAR, car]) + f[at.F_COLD, car]
    return fig.cars[at.C_PACE, car] + f[at.F_FORM, car] + f[at.F_LUCK, car] + tyre


@kernel(inline=True)
def add_racing_lap(fig, f, k, r):
    """Add one racing lap at expected pace to every car's race time, traffic included."""
    follow, needed = fig.track[at.T_FOLLOW], fig.track[at.T_PASS]
    pace_ahead, time_ahead = ZERO, ZERO
    for p in range(r[at.R_RUNNING]):
        car = k[at.K_ORDER, p]
        pace = expected_pace(fig, f, k, car)
        time = f[at.F_TIME, car] + pace
        if p > 0 and time < time_ahead + follow and pace_ahead - pace < needed:
            # Held up: the car keeps the following distance, or its own gap where that was smaller already.
            time = max(time, time_ahead + min(follow, f[at.F_TIME, car] - time_ahead + pace_ahead))
        f[at.F_TIME, car] = time
        pace_ahead, time_ahead = pace, time
    sort_by_time(f, k, r)


@kernel()
def add_stop(fig, context, f, k, r, car, compound, status):
    """Add a stop for `compound` at the end of the last lap, at the mean cost of a stop under a track status."""
    k[at.K_COMPOUND, car] = compound
    k[at.K_USED, car] |= 1 << compound
    before = laps_on_next_set(fig, k, car, compound)
    k[at.K_AGE, car], k[at.K_BEFORE, car] = before, before
    k[at.K_STOPS, car] += 1
    k[at.K_STOPPED, car] = 1
    k[at.K_SOFT_SETS + compound, car] = max(k[at.K_SOFT_SETS + compound, car] - 1, 0)
    tyre = fig.tyres[compound]
    f[at.F_OFFSET, car], f[at.F_LINEAR, car], f[at.F_QUADRATIC, car] = tyre[at.Y_OFFSET], tyre[at.Y_LINEAR], tyre[at.Y_QUADRATIC]
    f[at.F_COLD, car], f[at.F_WEAR, car], f[at.F_LUCK, car] = tyre[at.Y_COLD], np.float32(before), ZERO
    f[at.F_SHOWN_SUM, car], f[at.F_SHOWN_LAPS, car] = ZERO, ZERO
    # As in the simulator, the whole loss counts in race time at once, and lap times show it over in-lap and out-lap.
    loss = context.pit_cost_s[status]
    in_lap = loss * fig.track[at.T_IN_SHARE]
    f[at.F_TIME, car] += loss
    f[at.F_LAP, car] += in_lap
    f[at.F_DUE, car] = loss - in_lap
    sort_by_time(f, k, r)


@kernel(inline=True)
def add_expected_lap(fig, context, f, k, r, own, call):
    """Roll the race out by one lap at expected pace; car `own` makes `call` at its end: 0 stay out, 1 to 3 box for soft to hard."""
    status, place = r[at.R_STATUS], k[at.K_PLACE, own]
    gap = gap_to_next(f, k, place) if place > 0 else f[at.F_GAP, own]
    wear = ONE
    r[at.R_LAP] += 1
    if status == GREEN:
        laps = np.float32(fig.whole[at.I_LAPS])
        to_go = np.float32(fig.whole[at.I_LAPS] - r[at.R_LAP])
        reference = fig.track[at.T_BASE] + fig.track[at.T_FUEL] * (to_go + HALF) + fig.track[at.T_EVOLUTION] * to_go / laps
        for p in range(r[at.R_RUNNING]):
            car = k[at.K_ORDER, p]
            f[at.F_LAP, car] = reference + expected_pace(fig, f, k, car) + f[at.F_DUE, car]
        add_racing_lap(fig, f, k, r)
    else:  # everybody drives to the same delta time: gaps stay as they are, and tyres wear less
        wear = fig.track[at.T_WEAR_SC] if status == SC else fig.track[at.T_WEAR_VSC]
    for p in range(r[at.R_RUNNING]):
        car = k[at.K_ORDER, p]
        k[at.K_AGE, car] += 1
        f[at.F_WEAR, car] += wear
        f[at.F_COLD, car], f[at.F_DUE, car] = ZERO, ZERO
        k[at.K_STOPPED, car] = 0
    f[at.F_GAP, own] = gap
    r[at.R_SINCE] += 1
    r[at.R_NO_DRS] = max(r[at.R_NO_DRS] - 1, 0)
    r[at.R_RESTART] = 0
    if status != GREEN and r[at.R_SINCE] >= CAUTION_LAPS:
        r[at.R_STATUS], r[at.R_SINCE], r[at.R_LEFT] = GREEN, 0, 0
    if call > 0:
        add_stop(fig, context, f, k, r, own, call - 1, status)
