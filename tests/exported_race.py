"""A simulated race told as a lap table, with what a timing system would have seen: crossings of the line, passages of the pit lane."""

from typing import NamedTuple

import numpy as np
import polars as pl

from rsrl.laps import LAP_SCHEMA
from rsrl.season import COMPOUNDS, GREEN, RED, SC, VSC, RaceRecord
from rsrl.simulator import layout as at
from rsrl.state import Action, UnifiedRaceState, UnifiedRaceStrategy
from rsrl.state.race_context import mean_stop_s
from rsrl.translators import SimulatedRace

START_S = 3600.0
LANE_S = 20.0
ENTRY_S = 2.0
DIGITS = {GREEN: "1", VSC: "6", SC: "4", RED: "5"}


class Exported(NamedTuple):
    """The states that the simulator's own translator gave before each lap, by laps completed, and the race as a lap table."""

    states: dict[int, UnifiedRaceState]
    table: pl.DataFrame
    slow_laps: int
    red_laps: int


def export_race(record: RaceRecord, car: int, seed: int, race: int, stops: tuple[int, ...]) -> Exported:
    """Run a simulated race to its end for the car, which boxes at the end of the laps `stops` for the hardest set it has left."""
    simulated = SimulatedRace(record, car, seed, race)
    states: dict[int, UnifiedRaceState] = {}
    rows: list[dict[str, object]] = []
    spans: list[tuple[float, int]] = []
    pit_out: dict[int, float] = {}
    f, k, r = (array[0] for array in (simulated.batch.f, simulated.batch.k, simulated.batch.r))
    while (state := simulated.state()) is not None:
        lap, status = state.laps_completed, state.track_status
        states[lap] = state
        first_s = START_S + r[at.R_CLOCK_MS] / 1000 + float(f[at.F_TIME, : len(record.cars)].min() if lap else 0.0)
        spans.append((first_s, status))
        before = k.copy()
        hardest = max((code for code in range(3) if state.sets_left[code]), default=-1)
        simulated.apply(UnifiedRaceStrategy(Action(1 + hardest) if lap + 1 in stops else Action.NO_PIT))
        rows += _rows(simulated, lap + 1, status, before, pit_out)
    table = pl.DataFrame(_with_digits(rows, spans), schema=LAP_SCHEMA).sort("driver", "lap")
    statuses = [state.track_status for state in states.values()]
    return Exported(states, table, sum(s in (SC, VSC) for s in statuses), statuses.count(RED))


def _rows(simulated: SimulatedRace, lap: int, status: int, before: np.ndarray, pit_out: dict[int, float]) -> list[dict[str, object]]:
    record, batch = simulated.record, simulated.batch
    f, k, r = batch.f[0], batch.k[0], batch.r[0]
    share = float(batch.figures.track[at.T_IN_SHARE])
    rows = []
    for car, entry in enumerate(record.cars):
        if k[at.K_PLACE, car] >= r[at.R_RUNNING]:
            continue
        crossing = START_S + r[at.R_CLOCK_MS] / 1000 + float(f[at.F_TIME, car]) - float(f[at.F_DUE, car])
        stopped = bool(k[at.K_STOPPED, car])
        row = dict.fromkeys(LAP_SCHEMA) | {
            "season": record.season, "round": record.round, "event": record.event, "driver": entry.driver, "team": entry.team, "lap": lap,
            "lap_time_s": float(f[at.F_LAP, car]), "compound": COMPOUNDS[before[at.K_COMPOUND, car]],
            "tyre_life_laps": float(before[at.K_AGE, car] + 1), "stint": int(before[at.K_STOPS, car] + 1),
            "position": int(k[at.K_PLACE, car] + 1), "session_time_s": crossing, "pit_out_s": pit_out.pop(car, None),
            "pit_in_s": crossing - ENTRY_S if stopped else None, "fresh_tyre": before[at.K_BEFORE, car] == 0,
        }  # fmt: skip
        if stopped:
            loss = float(f[at.F_DUE, car]) / (1 - share)
            usual = 0.0 if status == RED else float(mean_stop_s(batch.figures, car)[status])
            pit_out[car] = crossing - ENTRY_S + LANE_S + loss - usual
        rows.append(row)
    return rows


def _with_digits(rows: list[dict[str, object]], spans: list[tuple[float, int]]) -> list[dict[str, object]]:
    """With the digits of all statuses that were out during each lap, as the leader's laps had them."""
    latest: dict[object, float] = {}
    ends = [*(begin for begin, _ in spans[1:]), float("inf")]
    for row in rows:
        begin, end = latest.get(row["driver"], START_S), float(str(row["session_time_s"]))
        latest[row["driver"]] = end
        seen = {DIGITS[status] for (from_s, status), until in zip(spans, ends, strict=True) if from_s < end and until > begin}
        row["track_status"] = "".join(sorted(seen))
    return rows
