"""From the race as everybody sees it to a raw feature row, compiled; the same code for every source of data.

Every gap is a difference of gaps to the leader: that is what timing screens and `UnifiedRaceState` hold, so a state that
went through either gives the same bits.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.compiled import kernel
from rsrl.season import GREEN, SC
from rsrl.state.expectation import expected_calls_s, set_to_fit
from rsrl.state.features import COLUMN, FIGURES, NO_CAR_GAP_S, OUTLOOK_CAP_S
from rsrl.state.outlook import lap_cost
from rsrl.state.projection import write_projection

NO_GAP = np.float32(NO_CAR_GAP_S)
CAP = np.float32(OUTLOOK_CAP_S)
ZERO = np.float32(0.0)

TRACK, SAFETY_CAR, POSITION, PROGRESS = (COLUMN[n] for n in ("track", "safety_car", "position", "race_progress"))
TYRE, DEGRADATION, SOFT_AVAILABLE, SOFT_SETS = (COLUMN[n] for n in ("tyre", "tyre_degradation_s", "soft_available", "soft_sets"))
GAP_AHEAD, GAP_BEHIND, GAP_LEADER = (COLUMN[n] for n in ("gap_ahead_s", "gap_behind_s", "gap_to_leader_s"))
LAST_LAP, VALID, LAPS_LEFT, AGE, STOPS = (COLUMN[n] for n in ("last_lap_ratio", "valid_finish", "laps_left", "tyre_age_laps", "stops_made"))
SINCE, PIT_S, PIT_PLACES = (COLUMN[n] for n in ("safety_car_laps", "pit_cost_s", "pit_cost_places"))
REJOIN_AHEAD, REJOIN_BEHIND = (COLUMN[n] for n in ("rejoin_gap_ahead_s", "rejoin_gap_behind_s"))
TWO_AHEAD, TWO_BEHIND, CLOSING = (COLUMN[n] for n in ("gap_two_ahead_s", "gap_two_behind_s", "closing_ahead_s"))
AGE_AHEAD, AGE_BEHIND, TYRE_AHEAD, TYRE_BEHIND = (
    COLUMN[n] for n in ("tyre_age_ahead_laps", "tyre_age_behind_laps", "tyre_ahead", "tyre_behind")
)
STOPS_AHEAD, STOPS_BEHIND = COLUMN["stops_ahead"], COLUMN["stops_behind"]
BOXED_AHEAD, BOXED_BEHIND = COLUMN["boxed_ahead"], COLUMN["boxed_behind"]
FORM, LUCK = COLUMN["form_s"], COLUMN["set_luck_s"]
PACE_AHEAD, PACE_BEHIND = COLUMN["pace_ahead_s"], COLUMN["pace_behind_s"]
TYRE_LOSS_AHEAD, TYRE_LOSS_BEHIND = COLUMN["tyre_loss_ahead_s"], COLUMN["tyre_loss_behind_s"]
CLOSE_AHEAD, CLOSE_BEHIND, AT_REJOIN = (COLUMN[n] for n in ("cars_close_ahead", "cars_close_behind", "cars_at_rejoin"))
EXPECTED = COLUMN["expected_stay_s"]
FIRST_FIGURE = COLUMN[FIGURES[0].name]
CLOSE_S, REJOIN_S = np.float32(5.0), np.float32(4.0)
WINDOW, TO_COME, RUNNING, OUTLOOK = (COLUMN[n] for n in ("cars_in_pit_window", "stops_to_come_ahead", "cars_running", "outlook_stay_s"))


class TimingData(NamedTuple):
    """What timing screens show of a race at the end of a lap, and what the called car's pit wall knows of its own car.

    Arrays are by car, any number of them in any order.

    Attributes:
        lap: laps completed.
        status, since: track status of the coming lap, and laps since it began, 0 on its first lap.
        running: cars still in the race.
        time: race time from any common origin, s.
        last_lap: last lap time, s.
        place, order: place of each car, 0 for the leader, and the car in each place.
        compound, age: fitted, and the laps it has run, those before the race included; wear: the same in racing laps, of which a slow
            lap counts as a part.
        stops: made so far; stopped: 1 after a stop on the last lap.
        form, set_luck: what lap times have shown of the car and of its set (simulator/pace_watch.py), s.
        used, sets_left: of the called car: bit mask of the compounds used, and sets left of each.
        previous_gap: gap of the called car to the car then ahead, one lap earlier, s.
    """

    lap: int
    status: np.int32
    since: np.int32
    running: np.int32
    time: NDArray[np.float32]
    last_lap: NDArray[np.float32]
    place: NDArray[np.int32]
    order: NDArray[np.int32]
    compound: NDArray[np.int32]
    age: NDArray[np.int32]
    wear: NDArray[np.float32]
    stops: NDArray[np.int32]
    stopped: NDArray[np.int32]
    form: NDArray[np.float32]
    set_luck: NDArray[np.float32]
    used: np.int32
    sets_left: tuple[np.int32, np.int32, np.int32]
    previous_gap: np.float32


@kernel(inline=True)
def write_gaps(out, own, timing):
    """Gaps to the cars around; NO_GAP where there is none."""
    time, order, running = timing.time, timing.order, timing.running
    p = timing.place[own]
    leader = time[order[0]]
    mine = time[own] - leader
    ahead = mine - (time[order[p - 1]] - leader) if p > 0 else NO_GAP
    out[GAP_AHEAD] = ahead
    out[TWO_AHEAD] = mine - (time[order[p - 2]] - leader) if p > 1 else NO_GAP
    out[GAP_BEHIND] = (time[order[p + 1]] - leader) - mine if p + 1 < running else NO_GAP
    out[TWO_BEHIND] = (time[order[p + 2]] - leader) - mine if p + 2 < running else NO_GAP
    out[GAP_LEADER] = mine
    out[CLOSING] = max(min(timing.previous_gap, NO_GAP) - ahead, -NO_GAP) if p > 0 else ZERO


@kernel(inline=True)
def write_neighbours(out, own, timing):
    """Tyres and stops of the cars ahead and behind; a missing neighbour looks like the car itself."""
    order, running, stops = timing.order, timing.running, timing.stops
    p = timing.place[own]
    a = order[p - 1] if p > 0 else own
    b = order[p + 1] if p + 1 < running else own
    out[AGE_AHEAD], out[AGE_BEHIND] = np.float32(timing.age[a]), np.float32(timing.age[b])
    out[TYRE_AHEAD], out[TYRE_BEHIND] = np.float32(timing.compound[a]), np.float32(timing.compound[b])
    out[STOPS_AHEAD] = np.float32(stops[a] - stops[own])
    out[STOPS_BEHIND] = np.float32(stops[b] - stops[own])
    total = ZERO
    for q in range(p):
        total += np.float32(stops[order[q]] - stops[own])
    out[TO_COME] = total / np.float32(p) if p > 0 else ZERO
    out[RUNNING] = np.float32(running)


@kernel(inline=True)
def write_field(out, own, timing, paces, tyres, cost):
    """How quick the cars ahead and behind are, and how many cars are near now and after a stop costing `cost` seconds."""
    time, order, running = timing.time, timing.order, timing.running
    compound, wear, form, luck = timing.compound, timing.wear, timing.form, timing.set_luck
    p = timing.place[own]
    a = order[p - 1] if p > 0 else own
    b = order[p + 1] if p + 1 < running else own
    out[FORM], out[LUCK] = form[own], luck[own]
    pace = paces[own] + form[own] + luck[own]
    out[PACE_AHEAD] = paces[a] + form[a] + luck[a] - pace
    out[PACE_BEHIND] = paces[b] + form[b] + luck[b] - pace
    mine = lap_cost(tyres, compound[own], wear[own])
    out[TYRE_LOSS_AHEAD] = lap_cost(tyres, compound[a], wear[a]) - mine
    out[TYRE_LOSS_BEHIND] = lap_cost(tyres, compound[b], wear[b]) - mine
    leader = time[order[0]]
    here = time[own] - leader
    ahead, behind, rejoin = 0, 0, 0
    for q in range(running):
        car = order[q]
        gap = here - (time[car] - leader)
        ahead += (q < p) & (gap < CLOSE_S)
        behind += (q > p) & (-gap < CLOSE_S)
        back = gap + cost
        rejoin += (car != own) & (back >= ZERO) & (back < REJOIN_S)
    out[CLOSE_AHEAD], out[CLOSE_BEHIND] = np.float32(ahead), np.float32(behind)
    out[AT_REJOIN] = np.float32(rejoin)


@kernel(inline=True)
def write_rejoin(out, own, timing, cost):
    """Where a stop costing `cost` seconds now would bring the car back out; and who around it has just boxed."""
    time, order, stopped = timing.time, timing.order, timing.stopped
    p = timing.place[own]
    leader = time[order[0]]
    mine = time[own] - leader
    back = mine + cost
    lost = 0
    ahead, behind = NO_GAP, NO_GAP
    boxed_ahead, boxed_behind = 0, 0
    for q in range(p + 1, timing.running):
        car = order[q]
        there = time[car] - leader
        gap = back - there
        if gap >= ZERO:
            lost += 1
            ahead = gap
        else:
            behind = min(behind, -gap)
        if there - mine < cost:
            boxed_behind |= stopped[car]
    for q in range(p):
        boxed_ahead |= stopped[order[q]]
    within = 0
    for q in range(p - 1, -1, -1):
        if mine - (time[order[q]] - leader) > cost:
            break
        within += 1
    if lost == 0 and p > 0:
        ahead = min(back - (time[order[p - 1]] - leader), NO_GAP)
    out[PIT_S] = cost
    out[PIT_PLACES] = np.float32(lost)
    out[REJOIN_AHEAD], out[REJOIN_BEHIND] = min(ahead, NO_GAP), behind
    out[WINDOW] = np.float32(within)
    out[BOXED_AHEAD], out[BOXED_BEHIND] = np.float32(boxed_ahead), np.float32(boxed_behind)


@kernel(inline=True)
def write_outlook(out, own, timing, table, expectation, tyres, valid, cost):
    """Clean-air cost of each call against the best of them, at most CAP."""
    lap, compound = timing.lap, timing.compound[own]
    after = min(timing.age[own] + 1, table.shape[3] - 1)
    out[OUTLOOK] = table[lap + 1, valid, compound, after]
    best = out[OUTLOOK]
    for new in range(3):
        used = 1 if valid == 1 or new != compound else 0
        value = cost + tyres[new, 3] + table[lap + 1, used, new, set_to_fit(expectation, timing.sets_left, new)]
        if timing.sets_left[new] < 1:
            value = np.float32(1.0e6)
        out[OUTLOOK + 1 + new] = value
        best = min(best, value)
    for action in range(4):
        out[OUTLOOK + action] = min(out[OUTLOOK + action] - best, CAP)


@kernel(inline=True)
def write_expected(out, own, timing, expectation):
    """Expected cost of each call that allows for safety cars, against the best of them, at most CAP."""
    calls = out[EXPECTED : EXPECTED + 4]
    age = np.float32(timing.age[own]) if expectation.max_laps_per_set > 0 else timing.wear[own]
    expected_calls_s(expectation, timing.lap, timing.status, timing.sets_left, timing.compound[own], age, timing.used, calls)
    best = min(min(calls[0], calls[1]), min(calls[2], calls[3]))
    for action in range(4):
        calls[action] = min(calls[action] - best, CAP)


@kernel(inline=True)
def observe(out, own, timing, context, laps, tyres):
    """Fill a raw row float32 [RAW_SIZE] for car `own` of `timing`, a `TimingData`.

    `context` is the car's `RaceContext`, with `paces` in the order of `timing`; `laps` of the race; `tyres` figures float32 [3, 4].
    """
    c = timing.compound[own]
    status = timing.status
    valid = 1 if (timing.used & (timing.used - 1)) != 0 else 0
    out[TRACK] = np.float32(context.track)
    out[SAFETY_CAR] = np.float32(min(status, SC))  # a red flag reads as a safety car under which a stop costs nothing
    out[POSITION] = np.float32(timing.place[own] + 1)
    out[PROGRESS] = np.float32(timing.lap) / np.float32(laps)
    out[TYRE] = np.float32(c)
    out[DEGRADATION] = lap_cost(tyres, c, timing.wear[own]) - lap_cost(tyres, c, 0)
    for s in range(3):
        out[SOFT_AVAILABLE + s] = np.float32(1.0) if timing.sets_left[s] > 0 else ZERO
        out[SOFT_SETS + s] = np.float32(timing.sets_left[s])
    out[LAST_LAP] = min(timing.last_lap[own] / context.reference_s, np.float32(2.0))
    out[VALID] = np.float32(valid)
    out[LAPS_LEFT] = np.float32(laps - timing.lap)
    out[AGE] = np.float32(timing.age[own])
    out[STOPS] = np.float32(timing.stops[own])
    out[SINCE] = np.float32(timing.since) if status != GREEN else ZERO
    cost = context.pit_cost_s[status]
    write_gaps(out, own, timing)
    write_neighbours(out, own, timing)
    write_rejoin(out, own, timing, cost)
    write_field(out, own, timing, context.paces, tyres, cost)
    write_outlook(out, own, timing, context.outlook, context.expectation, tyres, valid, cost)
    write_expected(out, own, timing, context.expectation)
    write_projection(out, own, timing, context, laps, tyres, cost, valid)
    for i in range(context.figures.shape[0]):
        out[FIRST_FIGURE + i] = context.figures[i]


@kernel()
def observe_row(out, own, timing, context, laps, tyres):
    """`observe`, for callers in Python."""
    observe(out, own, timing, context, laps, tyres)
