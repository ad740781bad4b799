"""A race record as the arrays that the compiled race reads. Nothing here changes during a race."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.season import COMPOUNDS, RaceRecord
from rsrl.simulator import layout as at
from rsrl.simulator.incident_chances import incident_chances
from rsrl.simulator.plans import Plan, check_plan, plan_table
from rsrl.simulator.rival_tables import RivalTables, rival_tables
from rsrl.simulator.script import Script, check_script

FloatArray = NDArray[np.float32]
IntArray = NDArray[np.int32]


class Figures(NamedTuple):
    """Compiled parameters of a race; rows and columns are named in layout.py."""

    track: FloatArray  # [T_SIZE]
    cars: FloatArray  # [C_ROWS, CARS]
    tyres: FloatArray  # [3, 5]
    whole: IntArray  # laps, cars, laps a set may run (0: no limit), laps without DRS after a start, stops asked, disqualified (bits)
    sets: IntArray  # [3, CARS] of each car, the one it starts on included
    laps_before: IntArray  # [3, sets, CARS] laps each set has run before the race, the freshest first; at least one 0 follows the last
    sc_laps: FloatArray  # cumulative probability of 1, 2, ... laps
    vsc_laps: FloatArray
    tail: FloatArray  # [1025] quantiles of the stop time beyond the quickest, s
    rival_plans: IntArray  # [plans, P_COLUMNS]
    rival_shares: FloatArray  # [CARS, plans] cumulative, by car: of plans it has the sets for, if there are any, else of those it can start
    mates: IntArray  # [CARS] index of the team's other car, -1 none
    rivals: RivalTables  # of reactive rivals; empty where the record has none
    script_status: NDArray[np.int8]  # [laps + 1] track status of lap 1, 2 ... (0 unused); empty: incidents are drawn
    script_retire: IntArray  # [CARS] lap on which the car does not reach the line, NO_STOP never; empty: drawn


def compile_figures(record: RaceRecord, *, script: Script | None = None, as_dry: bool = False) -> Figures:
    """Flatten a record.

    Args:
        script: incidents and retirements as they happened; it lifts the limit on laps a set, so that only scripted stops are made.
        as_dry: run a wet race as if it had been dry, as a forecast made before the race would.

    Raises:
        RsrlError: a wet race (there is no wet model), more cars than there is room for, a rival plan that breaks the rules, a script that
            does not fit.
    """
    if record.wet and not as_dry:
        raise RsrlError(f"{record.name} was a wet race and there is no wet-weather model; choose a dry one (see `rsrl races`)")
    if len(record.cars) > at.CARS:
        raise RsrlError(f"{record.name}: {len(record.cars)} cars; the simulated race has room for {at.CARS}")
    if script:
        check_script(script, record)
    plans = [_rival_plan(p.plan, record) for p in record.rivals.plans]
    sets, laps_before = _sets(record)
    return Figures(
        track=_track(record),
        cars=_cars(record),
        tyres=_tyres(record),
        whole=_whole(record, script),
        sets=sets,
        laps_before=laps_before,
        sc_laps=_cumulative(record.incidents.sc_laps),
        vsc_laps=_cumulative(record.incidents.vsc_laps),
        tail=_tail(record),
        rival_plans=plan_table(plans),
        rival_shares=_rival_shares(record, plans, sets),
        mates=_mates(record),
        rivals=rival_tables(record, _mates(record), record.pit.loss_green_s.value + float(np.median(_tail(record)))),
        script_status=np.array((0, *script.status) if script else (), np.int8),
        script_retire=np.array([script.retire.get(i, at.NO_STOP) for i in range(at.CARS)] if script else (), np.int32),
    )


def _whole(record: RaceRecord, script: Script | None) -> IntArray:
    limit = 0 if script else record.max_laps_per_set
    disqualified = sum(1 << car for car in script.disqualified) if script else 0
    return np.array([record.laps, len(record.cars), limit, record.drs_off_laps, record.stops_asked, disqualified], np.int32)


def _mates(record: RaceRecord) -> IntArray:
    mates = np.full(at.CARS, -1, np.int32)
    for i, car in enumerate(record.cars):
        mates[i] = next((j for j, other in enumerate(record.cars) if j != i and other.team == car.team), -1)
    return mates


def _rival_plan(text: str, record: RaceRecord) -> Plan:
    plan = Plan.parse(text)
    check_plan(plan, record)
    r = record.rivals
    return Plan(plan.compounds, plan.laps, round(r.sc_window_laps.value), round(r.vsc_window_laps.value))


def _sets(record: RaceRecord) -> tuple[IntArray, IntArray]:
    """Sets of each car, and the laps that each set has run before the race: `Figures.sets` and `Figures.laps_before`."""
    own = [record.sets_of(car) for car in range(len(record.cars))]
    most = max(len(laps) for car in own for laps in car)
    sets, laps_before = np.zeros((3, at.CARS), np.int32), np.zeros((3, most + 1, at.CARS), np.int32)
    for car, compounds in enumerate(own):
        for code, laps in enumerate(compounds):
            sets[code, car] = len(laps)
            laps_before[code, : len(laps), car] = laps
    return sets, laps_before


def _rival_shares(record: RaceRecord, plans: list[Plan], sets: IntArray) -> FloatArray:
    """`Figures.rival_shares`.

    Raises:
        RsrlError: a car has no set of any compound that the plans start on.
    """
    weights = np.array([p.weight for p in record.rivals.plans])
    needed = np.array([[plan.compounds.count(code) for code in range(3)] for plan in plans])
    shares = np.ones((at.CARS, len(plans)), np.float32)
    for i, car in enumerate(record.cars):
        enough, starts = (needed <= sets[:, i]).all(axis=1), np.array([sets[plan.compounds[0], i] > 0 for plan in plans])
        if not starts.any():
            raise RsrlError(f"{record.name}: {car.driver} has no set of a tyre that any team started on; give it one")
        own = np.where(enough if enough.any() else starts, weights, 0.0)
        shares[i] = _cumulative(tuple(own / own.sum()))
        shares[i, np.flatnonzero(own)[-1] :] = 1.0  # rounding must not leave a plan behind the last one its chance
    return shares


def _cumulative(shares: tuple[float, ...]) -> FloatArray:
    total = np.cumsum(np.array(shares, np.float64))
    total[-1] = 1.0
    return total.astype(np.float32)


def _tail(record: RaceRecord) -> FloatArray:
    """Quantiles of the log-logistic excess (after Heilmeier et al. 2020), cut at tail_max_s."""
    u = np.arange(1025) / 1024
    u[-1] = 1 - 0.3 / 1024
    excess = record.pit.tail_scale_s.value * (u / (1 - u)) ** (1 / record.pit.tail_shape.value)
    return np.minimum(excess, record.pit.tail_max_s.value).astype(np.float32)


def _cars(record: RaceRecord) -> FloatArray:
    table = np.zeros((at.C_ROWS, at.CARS), np.float32)
    track = record.track
    for i, car in enumerate(record.cars):
        table[at.C_PACE, i] = car.pace_s.value
        table[at.C_FORM, i] = car.form_sd_s.value
        table[at.C_NOISE, i] = car.noise_factor.value * track.lap_noise_sd_s.value
        table[at.C_START, i] = track.start_per_place_s.value * (car.grid - 1) + car.start_gain_s.value
        table[at.C_RETIRE, i] = car.retire_per_lap.value
        table[at.C_STOP, i] = car.stop_loss_s.value
        table[at.C_LAP1, i] = car.retire_lap1.value
        table[at.C_TAIL, i] = car.stop_tail_factor.value
        table[at.C_TEAM_FORM, i] = np.sqrt(car.team_form_share.value) if car.team_form_share else 0.0
    return table


def _tyres(record: RaceRecord) -> FloatArray:
    launch = {c: f.value for c, f in (record.track.launch_loss_s or {}).items()}
    rows = [(record.tyres[c], launch.get(c, 0.0)) for c in COMPOUNDS]
    values = [(t.offset_s.value, t.wear_s_per_lap.value, t.curvature_s_per_lap2.value, t.cold_loss_s.value, start) for t, start in rows]
    return np.array(values, np.float32)


def _track(record: RaceRecord) -> FloatArray:
    t, p, s, r = record.track, record.pit, record.incidents, record.rivals
    v = np.zeros(at.T_SIZE, np.float32)
    v[at.T_BASE] = t.base_lap_s.value
    v[at.T_FUEL] = t.fuel_s_per_kg.value * t.fuel_start_kg.value / record.laps
    v[at.T_START], v[at.T_START_SD] = t.start_loss_s.value, t.start_sd_s.value
    v[at.T_DRS], v[at.T_DRS_WINDOW] = t.drs_gain_s.value, t.drs_window_s.value
    v[at.T_DIRTY], v[at.T_DIRTY_WINDOW] = t.dirty_air_loss_s.value, t.dirty_air_window_s.value
    v[at.T_FOLLOW] = t.following_gap_s.value
    v[at.T_PASS], v[at.T_PASS_SCALE], v[at.T_PASS_LOSS] = t.pass_threshold_s.value, t.pass_scale_s.value, t.pass_loss_s.value
    v[at.T_PASS_GAP] = t.pass_per_gap.value if t.pass_per_gap else 0.0
    v[at.T_BLUE], v[at.T_LAPPING] = t.blue_flag_loss_s.value, t.lapping_loss_s.value
    v[at.T_PIT], v[at.T_PIT_VSC], v[at.T_PIT_SC] = p.loss_green_s.value, p.loss_vsc_s.value, p.loss_sc_s.value
    v[at.T_SC_LAP1], v[at.T_SC], v[at.T_VSC] = s.sc_lap1.value, s.sc_per_lap.value, s.vsc_per_lap.value
    v[at.T_SC_FACTOR], v[at.T_SC_CATCH], v[at.T_VSC_FACTOR] = s.sc_lap_factor.value, s.sc_catch_factor.value, s.vsc_lap_factor.value
    v[at.T_SC_GAP], v[at.T_WEAR_SC], v[at.T_WEAR_VSC] = s.sc_gap_s.value, s.sc_wear_factor.value, s.vsc_wear_factor.value
    v[at.T_STINT], v[at.T_EVOLUTION], v[at.T_PASSED_LOSS] = t.stint_sd_s.value, t.evolution_s.value, t.passed_loss_s.value
    v[at.T_RED], v[at.T_IN_SHARE], v[at.T_STACK] = s.red_share.value, p.in_lap_share.value, p.stack_s.value
    v[at.T_PER_PLACE] = t.start_per_place_s.value
    v[at.T_SC_LAP1_ALONE : at.T_VSC_BY_OUT + 1] = incident_chances(record)
    v[at.T_JITTER], v[at.T_REACT_SC], v[at.T_REACT_VSC] = r.jitter_sd_laps.value, r.sc_reaction.value, r.vsc_reaction.value
    return v
