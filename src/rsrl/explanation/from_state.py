"""Moments made from states: the simulator's arrays of a `UnifiedRaceState`, and the same moment under another track status.

What a pit wall sees is set as the state has it, so the arrays give exactly the observation of the state. What it cannot see (forms, plans,
retirements, random keys) is neutral here; rollouts draw it anew in every future.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rsrl.environment.kernels import observe_race, write_legal
from rsrl.errors import RsrlError
from rsrl.explanation.moment import Arrays, Moment
from rsrl.explanation.state_file import check_history, check_race, check_state
from rsrl.season import COMPOUNDS, GREEN, RED, SC, VSC, RaceRecord
from rsrl.simulator import Figures
from rsrl.simulator import layout as at
from rsrl.simulator.lap import OUT
from rsrl.simulator.traffic import FAR
from rsrl.simulator.tyres import next_set
from rsrl.state import RAW_SIZE, CarState, Observer, UnifiedRaceState

SHOWN_LAPS = 5.0
"""Laps that a set of known `set_luck_s` is assumed to have shown; a state does not say how many, and later beliefs build on them."""


def moment_from_state(
    record: RaceRecord,
    car: int,
    state: UnifiedRaceState,
    history: Sequence[UnifiedRaceState] = (),
    *,
    where: str = "state",
    observer: Observer | None = None,
) -> Moment:
    """The decision that a state of the car `car` of the record asks for: the call for the coming lap.

    Args:
        history: states of the laps before, one a lap, the last of them one lap before `state`; may be empty. A recurrent policy needs them
            all, and they show which compounds the rivals have used.
        where: begins the message of an error.
        observer: of the race and car; made anew if None.

    Raises:
        RsrlError: the state is of another race or car, or impossible; the message names the field.
    """
    check_state(state, where)
    if check_race(state, record, where) != car:
        raise RsrlError(f"{where}: driver is {state.driver}, not {record.cars[car].driver}")
    check_history(state, history, where)
    observer = observer or Observer(record, car)
    arrays = arrays_of_state(record, observer.figures, car, state, history)
    legal = np.zeros(4, np.bool_)
    write_legal(observer.figures.whole, arrays[1], arrays[2], car, legal)
    seen = [*history, state]
    return Moment(
        record=record,
        car=car,
        lap=state.laps_completed + 1,
        raw=np.stack([observer.row(s) for s in seen]),
        legal=legal,
        calls=np.array([_call_before(s) for s in seen[1:]], np.int8),
        arrays=arrays,
    )


def arrays_of_state(record: RaceRecord, figures: Figures, car: int, state: UnifiedRaceState, history: Sequence[UnifiedRaceState]) -> Arrays:
    """f, k, r (`simulator.layout`) of a state that has been checked."""
    f, k = np.zeros((at.F_ROWS, at.CARS), np.float32), np.zeros((at.K_ROWS, at.CARS), np.int32)
    f[at.F_TIME], f[at.F_USE] = OUT, 1.0
    k[at.K_PLAN], k[at.K_WANT], k[at.K_NEXT], k[at.K_RETIRE] = -1, -1, at.NO_STOP, at.NO_STOP
    listed = sorted(state.cars, key=lambda c: (not c.running, c.position))
    order = [record.car_index(c.driver) for c in listed]
    order += [i for i in range(at.CARS) if i not in order]  # cars that did not start come last
    k[at.K_ORDER] = order
    k[at.K_PLACE, order] = np.arange(at.CARS)
    used = _compounds_used(record, state, history)
    ahead = None
    for entry, i in zip(listed, order, strict=False):
        _set_car(figures, f, k, i, entry, used[entry.driver])
        if i == car:
            k[at.K_SOFT_SETS : at.K_SOFT_SETS + 3, car] = state.sets_left
        k[at.K_BEFORE, i] = _laps_before(figures, k, i)
        _set_shown(figures, f, i, entry, entry.tyre_age_laps - int(k[at.K_BEFORE, i]))
        if entry.running:
            f[at.F_GAP, i] = 0.0 if ahead is None else f[at.F_TIME, i] - f[at.F_TIME, ahead]
            ahead = i
        else:
            k[at.K_RETIRE, i] = 0
            f[at.F_TIME, i] = OUT
        k[at.K_CALLER, i] = at.REACTIVE if len(figures.rivals.age) else at.PLANNED
    k[at.K_CALLER, car] = at.CALLED
    f[at.F_GAP, car] = FAR if state.previous_gap_ahead_s is None else state.previous_gap_ahead_s
    return f, k, _race_row(figures, state, history)


def _set_car(figures: Figures, f: NDArray[np.float32], k: NDArray[np.int32], i: int, entry: CarState, used: frozenset[str]) -> None:
    compound = COMPOUNDS.index(entry.compound)
    tyre = figures.tyres[compound]
    f[at.F_TIME, i] = OUT if entry.gap_to_leader_s is None else entry.gap_to_leader_s
    f[at.F_LAP, i] = entry.last_lap_s
    f[at.F_WEAR, i] = entry.tyre_age_laps if entry.worn_laps is None else entry.worn_laps
    f[at.F_OFFSET, i] = tyre[at.Y_OFFSET] + np.float32(entry.set_luck_s)
    f[at.F_LINEAR, i], f[at.F_QUADRATIC, i] = tyre[at.Y_LINEAR], tyre[at.Y_QUADRATIC]
    f[at.F_COLD, i] = tyre[at.Y_COLD] if entry.just_stopped else 0.0
    if entry.just_stopped:  # the part of the pit loss that falls into the out-lap
        loss = figures.track[at.T_PIT] + figures.cars[at.C_STOP, i] + figures.tail.mean() * figures.cars[at.C_TAIL, i]
        f[at.F_DUE, i] = loss * (1 - figures.track[at.T_IN_SHARE])
    f[at.F_PACE, i] = figures.cars[at.C_PACE, i] + np.float32(entry.form_s)
    k[at.K_COMPOUND, i], k[at.K_AGE, i], k[at.K_STOPS, i] = compound, entry.tyre_age_laps, entry.stops
    k[at.K_STOPPED, i] = entry.just_stopped
    k[at.K_USED, i] = sum(1 << COMPOUNDS.index(c) for c in used)
    for code, c in enumerate(COMPOUNDS):
        k[at.K_SOFT_SETS + code, i] = max(int(figures.sets[code, i]) - (c in used), 0)


def _laps_before(figures: Figures, k: NDArray[np.int32], i: int) -> int:
    """Laps that the set on a car had run when it was fitted, K_BEFORE, if sets are fitted the freshest first."""
    compound, age = k[at.K_COMPOUND, i], int(k[at.K_AGE, i])
    if k[at.K_STOPPED, i]:
        return age
    fitted = next_set(int(figures.sets[compound, i]), int(k[at.K_SOFT_SETS + compound, i]) + 1, figures.laps_before.shape[1])
    return min(int(figures.laps_before[compound, fitted, i]), age)


def _set_shown(figures: Figures, f: NDArray[np.float32], i: int, entry: CarState, stint_laps: int) -> None:
    """Set the sums from which the simulator's filter of form and set luck gets exactly the values of the state.

    A state gives the estimates but not the evidence for them. It is assumed that each earlier set and this one have shown SHOWN_LAPS laps
    (this one at most its `stint_laps`). For n laps with mean surprise s, `simulator.pace_posterior` estimates the form
    F = b + (s - b) v / t and the luck of the set L = (s - b) l / t, where b is the form estimated from the sets before, v its variance,
    l the prior variance of L and t = v + l + noise / n. These equations are solved for b and s.
    """
    f[at.F_FORM, i], f[at.F_LUCK, i] = entry.form_s, entry.set_luck_s
    form, luck = float(figures.cars[at.C_FORM, i]) ** 2, float(figures.track[at.T_STINT]) ** 2
    noise = float(figures.cars[at.C_NOISE, i]) ** 2
    if form <= 0 or luck <= 0 or (entry.form_s == 0 and entry.set_luck_s == 0):
        return
    weight = entry.stops / (luck + noise / SHOWN_LAPS)
    precision = 1 / form + weight
    laps = min(float(stint_laps), SHOWN_LAPS)
    if laps < 1:
        f[at.F_FORM_WEIGHT, i], f[at.F_FORM_SUM, i] = weight, entry.form_s * precision
        return
    total = 1 / precision + luck + noise / laps
    surprise = entry.set_luck_s * total / luck  # s - b
    before = entry.form_s - surprise / (precision * total)
    f[at.F_SHOWN_LAPS, i], f[at.F_SHOWN_SUM, i] = laps, laps * (before + surprise)
    f[at.F_FORM_WEIGHT, i], f[at.F_FORM_SUM, i] = weight, before * precision


def _race_row(figures: Figures, state: UnifiedRaceState, history: Sequence[UnifiedRaceState]) -> NDArray[np.int32]:
    r = np.zeros(at.R_SIZE, np.int32)
    before = history[-1].track_status if history else None
    green = state.track_status == GREEN
    r[at.R_LAP], r[at.R_STATUS], r[at.R_SINCE] = state.laps_completed, state.track_status, state.status_laps
    r[at.R_LEFT] = 0 if green else 1
    r[at.R_RUNNING] = sum(c.running for c in state.cars)
    r[at.R_RETIREMENT] = at.NO_STOP
    r[at.R_WATCHED] = 1
    r[at.R_RESTART] = green and before == RED
    r[at.R_NO_DRS] = _laps_without_drs(int(figures.whole[at.I_DRS_OFF_LAPS]), state, history)
    return r


def _laps_without_drs(rule: int, state: UnifiedRaceState, history: Sequence[UnifiedRaceState]) -> int:
    """Laps for which DRS is still off, the coming one included. `rule`: laps without it after the start, a safety car or a red flag.

    A green period whose beginning is not in `history` is taken to have followed a safety car.
    """
    left = max(rule - state.laps_completed, 0)
    status, since = state.track_status, state.status_laps
    for past in reversed(history):
        if status == GREEN and past.track_status >= SC:
            return max(left, rule - (state.laps_completed - past.laps_completed - 1), 0)
        status = past.track_status
    if not history and status == GREEN and since < state.laps_completed:
        return max(left, rule - since, 0)
    return left


def _compounds_used(record: RaceRecord, state: UnifiedRaceState, history: Sequence[UnifiedRaceState]) -> dict[str, frozenset[str]]:
    """Compounds each car has run on: as the state says for its own car, as seen for a rival, plus a likely one for a rival that has stopped
    but was seen on one compound only."""
    used = {c.driver: {c.compound} for c in state.cars}
    for past in history:
        for c in past.cars:
            used.get(c.driver, set()).add(c.compound)
    for c in state.cars:
        if c.stops > 0 and len(used[c.driver]) == 1:
            used[c.driver].add(_likely_other(record, c.compound))
    used[state.driver] = set(state.compounds_used)
    return {driver: frozenset(compounds) for driver, compounds in used.items()}


def _likely_other(record: RaceRecord, compound: str) -> str:
    """The commonest starting compound of the teams' plans, other than this one."""
    weights = dict.fromkeys((c for c in COMPOUNDS if c != compound), 0.0)
    for plan in record.rivals.plans:
        if plan.plan[0] in weights:
            weights[plan.plan[0]] += plan.weight
    return max(weights, key=lambda c: weights[c])


def _call_before(state: UnifiedRaceState) -> int:
    own = next(c for c in state.cars if c.driver == state.driver)
    return 1 + COMPOUNDS.index(own.compound) if own.just_stopped else 0


def under_status(moment: Moment, status: int, observer: Observer | None = None) -> Moment:
    """The moment with the track status of the coming lap just changed to `status`: 0 green, 1 virtual safety car, 2 safety car.

    How long it lasts is drawn in every future, and so is whether a safety car turns into a red flag.

    Args:
        observer: of the race and car; made anew if None.

    Raises:
        RsrlError: another status, or a moment before lap 2, since no safety car comes out on the grid.
    """
    if status not in (GREEN, VSC, SC):
        raise RsrlError(f"track status {status} cannot be asked for; 0 green, 1 virtual safety car, 2 safety car")
    if moment.lap < 2:
        raise RsrlError("no safety car comes out before lap 1; ask about lap 2 or a later one")
    r = moment.arrays[2].copy()
    r[at.R_STATUS], r[at.R_SINCE], r[at.R_RESTART] = status, 0, 0
    r[at.R_LEFT] = 0 if status == GREEN else 1
    return reobserved(moment, (*moment.arrays[:2], r), observer or Observer(moment.record, moment.car))


def reobserved(moment: Moment, arrays: Arrays, observer: Observer) -> Moment:
    """The moment with other arrays; its last observation and its legal calls follow from them."""
    raw, legal = moment.raw.copy(), np.zeros(4, np.bool_)
    raw[-1] = observed(arrays, observer)
    write_legal(observer.figures.whole, arrays[1], arrays[2], moment.car, legal)
    return replace(moment, raw=raw, legal=legal, arrays=arrays, seed=None, race=None)


def observed(arrays: Arrays, observer: Observer) -> NDArray[np.float32]:
    """Raw row float32 [RAW_SIZE] of a race's arrays."""
    row = np.zeros(RAW_SIZE, np.float32)
    observe_race(observer.figures.whole, observer.figures.tyres, row, *arrays, observer.car, observer.context)
    return row
