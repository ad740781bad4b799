"""From the race as everybody sees it to a raw feature row, compiled; the same code for every source of data.

All arrays are of one race and by car: `time` race time in s (any common origin), `last_lap` s, `compound`, `age` laps, `wear` the
same in racing laps, `stops`, `stopped` 1 after a stop on the last lap, `form` and `luck` what lap times have shown
(simulator/pace_posterior.py), `place` 0 for the leader, `order` the car in each place.

Every gap is a difference of gaps to the leader: that is what timing screens and `UnifiedRaceState` hold, so a state that
went through either gives the same bits.
"""

import numpy as np

from rsrl.compiled import kernel
from rsrl.season import GREEN, SC
from rsrl.state.expectation import expected_calls_s
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
PROJECTED = COLUMN["projected_place"]
EXPECTED = COLUMN["expected_stay_s"]
FIRST_FIGURE = COLUMN[FIGURES[0].name]
CLOSE_S, REJOIN_S = np.float32(5.0), np.float32(4.0)
WINDOW, TO_COME, RUNNING, OUTLOOK = (COLUMN[n] for n in ("cars_in_pit_window", "stops_to_come_ahead", "cars_running", "outlook_stay_s"))


@kernel(inline="always")
def write_gaps(out, own, running, time, place, order, previous_gap):
    """Gaps to the cars around; NO_GAP where there is none."""
    p = place[own]
    leader = time[order[0]]
    mine = time[own] - leader
    ahead = mine - (time[order[p - 1]] - leader) if p > 0 else NO_GAP
    out[GAP_AHEAD] = ahead
    out[TWO_AHEAD] = mine - (time[order[p - 2]] - leader) if p > 1 else NO_GAP
    out[GAP_BEHIND] = (time[order[p + 1]] - leader) - mine if p + 1 < running else NO_GAP
    out[TWO_BEHIND] = (time[order[p + 2]] - leader) - mine if p + 2 < running else NO_GAP
    out[GAP_LEADER] = mine
    out[CLOSING] = max(min(previous_gap, NO_GAP) - ahead, -NO_GAP) if p > 0 else ZERO


@kernel(inline="always")
def write_neighbours(out, own, running, place, order, compound, age, stops):
    """Tyres and stops of the cars ahead and behind; a missing neighbour looks like the car itself."""
    p = place[own]
    a = order[p - 1] if p > 0 else own
    b = order[p + 1] if p + 1 < running else own
    out[AGE_AHEAD], out[AGE_BEHIND] = np.float32(age[a]), np.float32(age[b])
    out[TYRE_AHEAD], out[TYRE_BEHIND] = np.float32(compound[a]), np.float32(compound[b])
    out[STOPS_AHEAD] = np.float32(stops[a] - stops[own])
    out[STOPS_BEHIND] = np.float32(stops[b] - stops[own])
    total = ZERO
    for q in range(p):
        total += np.float32(stops[order[q]] - stops[own])
    out[TO_COME] = total / np.float32(p) if p > 0 else ZERO
    out[RUNNING] = np.float32(running)


@kernel(inline="always")
def write_field(out, own, running, time, place, order, compound, wear, paces, form, luck, tyres, cost):
    """How quick the cars ahead and behind are, and how many cars are near now and after a stop costing `cost` seconds."""
    p = place[own]
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


@kernel(inline="always")
def write_rejoin(out, own, running, time, place, order, cost, stopped):
    """Where a stop costing `cost` seconds now would bring the car back out; and who around it has just boxed."""
    p = place[own]
    leader = time[order[0]]
    mine = time[own] - leader
    back = mine + cost
    lost = 0
    ahead, behind = NO_GAP, NO_GAP
    boxed_ahead, boxed_behind = 0, 0
    for q in range(p + 1, running):
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


@kernel(inline="always")
def write_outlook(out, table, tyres, lap, compound, age, valid, cost, sets_left):
    """Clean-air cost of each call against the best of them, at most CAP."""
    after = min(age + 1, table.shape[3] - 1)
    out[OUTLOOK] = table[lap + 1, valid, compound, after]
    best = out[OUTLOOK]
    for new in range(3):
        used = 1 if valid == 1 or new != compound else 0
        value = cost + tyres[new, 3] + table[lap + 1, used, new, 0]
        if sets_left[new] < 1:
            value = np.float32(1.0e6)
        out[OUTLOOK + 1 + new] = value
        best = min(best, value)
    for action in range(4):
        out[OUTLOOK + action] = min(out[OUTLOOK + action] - best, CAP)


@kernel(inline="always")
def write_expected(out, expectation, lap, status, sets_left, compound, age, used):
    """Expected cost of each call with safety cars in sight, against the best of them, at most CAP."""
    calls = out[EXPECTED : EXPECTED + 4]
    expected_calls_s(expectation, lap, status, sets_left, compound, age, used, calls)
    best = min(min(calls[0], calls[1]), min(calls[2], calls[3]))
    for action in range(4):
        calls[action] = min(calls[action] - best, CAP)


@kernel(inline="always")
def observe(
    out, own, track, laps, lap, status, since, running, reference_s, pit_cost_s, tyres, table, expectation, paces, figures,
    time, last_lap, place, order, compound, age, wear, stops, stopped, form, luck, used, sets_left, previous_gap,
):  # fmt: skip
    """Fill a raw row for car `own` after `lap` completed laps. `sets_left` [3], `used` bit mask, `pit_cost_s` [4] by track status.

    `paces` [cars] and `figures` are what is known before the race: `C_PACE` and the columns of `FIGURES`.
    """
    c = compound[own]
    valid = 1 if (used & (used - 1)) != 0 else 0
    out[TRACK] = np.float32(track)
    out[SAFETY_CAR] = np.float32(min(status, SC))  # a red flag reads as a safety car under which a stop costs nothing
    out[POSITION] = np.float32(place[own] + 1)
    out[PROGRESS] = np.float32(lap) / np.float32(laps)
    out[TYRE] = np.float32(c)
    out[DEGRADATION] = lap_cost(tyres, c, wear[own]) - lap_cost(tyres, c, 0)
    for s in range(3):
        out[SOFT_AVAILABLE + s] = np.float32(1.0) if sets_left[s] > 0 else ZERO
        out[SOFT_SETS + s] = np.float32(sets_left[s])
    out[LAST_LAP] = min(last_lap[own] / reference_s, np.float32(2.0))
    out[VALID] = np.float32(valid)
    out[LAPS_LEFT] = np.float32(laps - lap)
    out[AGE] = np.float32(age[own])
    out[STOPS] = np.float32(stops[own])
    out[SINCE] = np.float32(since) if status != GREEN else ZERO
    cost = pit_cost_s[status]
    write_gaps(out, own, running, time, place, order, previous_gap)
    write_neighbours(out, own, running, place, order, compound, age, stops)
    write_rejoin(out, own, running, time, place, order, cost, stopped)
    write_field(out, own, running, time, place, order, compound, wear, paces, form, luck, tyres, cost)
    write_outlook(out, table, tyres, lap, c, age[own], valid, cost, sets_left)
    write_expected(
        out, expectation, lap, status, sets_left, c, np.float32(age[own]) if expectation.max_laps_per_set > 0 else wear[own], used
    )
    write_projection(
        out, own, running, laps, lap, status, time, order, compound, age, stops, paces, form, luck, tyres, table, cost, valid, sets_left
    )
    for i in range(figures.shape[0]):
        out[FIRST_FIGURE + i] = figures[i]
