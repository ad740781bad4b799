"""The simulator's arrays made from a `UnifiedRaceState`: a decision seen anywhere becomes a moment that can be explained and run on.

What everybody sees is set as the state has it, so that the arrays show the very observation the state does. What nobody sees (forms,
intentions, retirements, random keys) is neutral and drawn anew with every future.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rsrl.environment.kernels import write_legal
from rsrl.explanation.moment import Arrays, Moment
from rsrl.explanation.what_if.state_checks import check_history, check_state
from rsrl.season import COMPOUNDS, GREEN, RED, SC, RaceRecord
from rsrl.simulator import Figures
from rsrl.simulator import layout as at
from rsrl.simulator.lap import OUT
from rsrl.simulator.traffic import LAPS_WITHOUT_DRS
from rsrl.state import CarState, Observer, UnifiedRaceState

SHOWN_LAPS = 5.0
"""So many laps a set is taken to have shown where its luck is known and not how many did: what is believed later builds on them."""


def moment_from_state(record: RaceRecord, car: int, state: UnifiedRaceState, history: Sequence[UnifiedRaceState] = ()) -> Moment:
    """The decision before the coming lap of a state, for car `car` of the record.

    Args:
        history: states of the laps before, one a lap, the last of them one lap before `state`; a policy with a memory needs them all,
            and they tell which compounds the rivals have used. May be empty.

    Raises:
        RsrlError: the state is of another race or car, or impossible; the field is named.
    """
    check_state(record, car, state)
    check_history(state, history)
    observer = Observer(record, car)
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
    order += [i for i in range(at.CARS) if i not in order]  # who did not start stands at the end
    k[at.K_ORDER] = order
    k[at.K_PLACE, order] = np.arange(at.CARS)
    used = _compounds_used(record, state, history)
    ahead = None
    for entry, i in zip(listed, order, strict=False):
        _set_car(figures, f, k, i, entry, used[entry.driver])
        if entry.running:
            f[at.F_GAP, i] = 0.0 if ahead is None else f[at.F_TIME, i] - f[at.F_TIME, ahead]
            ahead = i
        else:
            k[at.K_RETIRE, i] = 0
            f[at.F_TIME, i] = OUT
        k[at.K_CALLER, i] = at.REACTIVE if len(figures.rivals.age) else at.PLANNED
    k[at.K_CALLER, car] = at.CALLED
    k[at.K_SOFT_SETS : at.K_SOFT_SETS + 3, car] = state.sets_left
    f[at.F_GAP, car] = state.previous_gap_ahead_s
    return f, k, _race_row(figures, state, history)


def _set_car(figures: Figures, f: NDArray[np.float32], k: NDArray[np.int32], i: int, entry: CarState, used: frozenset[str]) -> None:
    compound = COMPOUNDS.index(entry.compound)
    offset, linear, quadratic, cold = figures.tyres[compound]
    f[at.F_TIME, i], f[at.F_LAP, i] = entry.gap_to_leader_s, entry.last_lap_s
    f[at.F_WEAR, i] = entry.tyre_age_laps if entry.worn_laps is None else entry.worn_laps
    f[at.F_OFFSET, i], f[at.F_LINEAR, i], f[at.F_QUADRATIC, i] = offset + np.float32(entry.set_luck_s), linear, quadratic
    f[at.F_COLD, i] = cold if entry.just_stopped else 0.0
    if entry.just_stopped:  # the part of the stop's loss that the next lap's time shows
        loss = figures.track[at.T_PIT] + figures.cars[at.C_STOP, i] + figures.tail.mean() * figures.cars[at.C_TAIL, i]
        f[at.F_DUE, i] = loss * (1 - figures.track[at.T_IN_SHARE])
    f[at.F_PACE, i] = figures.cars[at.C_PACE, i] + np.float32(entry.form_s)
    _set_shown(figures, f, i, entry)
    k[at.K_COMPOUND, i], k[at.K_AGE, i], k[at.K_STOPS, i] = compound, entry.tyre_age_laps, entry.stops
    k[at.K_STOPPED, i] = entry.just_stopped
    k[at.K_USED, i] = sum(1 << COMPOUNDS.index(c) for c in used)
    for code, c in enumerate(COMPOUNDS):
        k[at.K_SOFT_SETS + code, i] = max(int(figures.sets[code]) - (c in used), 0)


def _set_shown(figures: Figures, f: NDArray[np.float32], i: int, entry: CarState) -> None:
    """Sums of what laps have shown that give the state's form and luck, as if sets before had shown one and SHOWN_LAPS laps the other.

    Given luck L on n laps and form F, `simulator.pace_watch` has F = b + (s - b) v / t and L = (s - b) l / t, where s is the laps' mean
    surprise, b the form by the sets before, v its variance, l the luck's variance and t = v + l + noise / n.
    """
    f[at.F_FORM, i], f[at.F_LUCK, i] = entry.form_s, entry.set_luck_s
    form, luck = float(figures.cars[at.C_FORM, i]) ** 2, float(figures.track[at.T_STINT]) ** 2
    noise = float(figures.cars[at.C_NOISE, i]) ** 2
    if form <= 0 or luck <= 0 or (entry.form_s == 0 and entry.set_luck_s == 0):
        return
    weight = entry.stops / (luck + noise / SHOWN_LAPS)
    precision = 1 / form + weight
    laps = min(float(entry.tyre_age_laps), SHOWN_LAPS)
    if laps < 1:
        f[at.F_FORM_WEIGHT, i], f[at.F_FORM_SUM, i] = weight, entry.form_s * precision
        return
    total = 1 / precision + luck + noise / laps
    surprise = entry.set_luck_s * total / luck  # beyond the form by the sets before
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
    r[at.R_NO_DRS] = _laps_without_drs(state, history)
    return r


def _laps_without_drs(state: UnifiedRaceState, history: Sequence[UnifiedRaceState]) -> int:
    """Laps for which DRS is still off, the coming one included: after the start, and after a safety car or a red flag went in.

    Where nobody knows what came before a green lap, it was a safety car.
    """
    left = max(LAPS_WITHOUT_DRS - state.laps_completed, 0)
    status, since = state.track_status, state.status_laps
    for past in reversed(history):
        if status == GREEN and past.track_status >= SC:
            return max(left, LAPS_WITHOUT_DRS - (state.laps_completed - past.laps_completed - 1), 0)
        status = past.track_status
    if not history and status == GREEN and since < state.laps_completed:
        return max(left, LAPS_WITHOUT_DRS - since, 0)
    return left


def _compounds_used(record: RaceRecord, state: UnifiedRaceState, history: Sequence[UnifiedRaceState]) -> dict[str, frozenset[str]]:
    """Compounds each car has run on: the called one's as the state says, a rival's as seen, and one more where it must have had another."""
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
    """The commonest starting compound of the teams' plans but this one."""
    weights = dict.fromkeys((c for c in COMPOUNDS if c != compound), 0.0)
    for plan in record.rivals.plans:
        if plan.plan[0] in weights:
            weights[plan.plan[0]] += plan.weight
    return max(weights, key=lambda c: weights[c])


def _call_before(state: UnifiedRaceState) -> int:
    own = next(c for c in state.cars if c.driver == state.driver)
    return 1 + COMPOUNDS.index(own.compound) if own.just_stopped else 0
