"""What really happened in a race, read from its laps and its result: the truth a prediction is scored against, and the replay's script."""

import numpy as np
import polars as pl
from numpy.typing import NDArray

from rsrl.calibration import RaceFacts
from rsrl.evaluation.backtest.scores import Actual
from rsrl.laps import clean, neutralised_laps, tyre_stops
from rsrl.season import COMPOUNDS, GREEN, SC
from rsrl.simulator import MAX_STOPS, Plan, Script

WET_TYRE_STANDS_FOR = COMPOUNDS.index("M")
"""What an intermediate or wet tyre is in the dry replay of a wet race."""


def observe_race(race: pl.DataFrame, facts: RaceFacts) -> Actual:
    """The truth of one race.

    Args:
        race: all laps of the race.
        facts: its result; cars are in grid order.
    """
    drivers = list(facts.grid)
    laps = race.filter(pl.col("lap") <= facts.laps)
    racing = clean(laps, dry_only=False).laps
    stops = tyre_stops(race).filter(pl.col("lap") < facts.laps)
    made = {d: sorted(stops.filter(pl.col("driver") == d)["lap"].to_list()) for d in drivers}
    neutralised = neutralised_laps(race)
    return Actual(
        positions=np.array([float(facts.positions[d]) for d in drivers]),
        classified=np.array([d in facts.classified for d in drivers]),
        stops=np.array([float(len(made[d])) if d in facts.classified else np.nan for d in drivers]),
        first_stop=np.array([float(made[d][0]) if made[d] else np.nan for d in drivers]),
        lap_positions=_by_lap(laps, "position", drivers, facts.laps),
        green_lap_s=_by_lap(racing, "lap_time_s", drivers, facts.laps),
        sc_laps=neutralised.filter(pl.col("status") == SC).height,
    )


def race_times_s(race: pl.DataFrame, facts: RaceFacts) -> NDArray[np.float64]:
    """Time from the start to the end of each lap [laps, cars], nan where there is none; cars in grid order.

    Where lap 1 is not on record the start is taken as two median laps before the first car ends lap 2.
    """
    times = _by_lap(race.filter(pl.col("lap") <= facts.laps), "session_time_s", list(facts.grid), facts.laps)
    first = race.filter(pl.col("lap") == 1).select((pl.col("session_time_s") - pl.col("lap_time_s")).min()).item()
    median_s = float(np.nanmedian(race["lap_time_s"].cast(pl.Float64).to_numpy()))
    begin = float(np.nanmin(times[1])) - 2 * median_s if first is None else float(first)
    return times - begin


def _by_lap(laps: pl.DataFrame, column: str, drivers: list[str], distance: int) -> NDArray[np.float64]:
    """[laps, cars] of a column, nan where there is none."""
    out = np.full((distance, len(drivers)), np.nan)
    index = {d: i for i, d in enumerate(drivers)}
    for driver, lap, value in laps.select("driver", "lap", column).drop_nulls().iter_rows():
        if driver in index:
            out[lap - 1, index[driver]] = value
    return out


def replay_script(race: pl.DataFrame, facts: RaceFacts) -> Script:
    """The race's own track status by lap, retirements, stops and disqualifications; cars in grid order.

    A car without a lap on record starts on medium and retires on lap 1. Where a car's tyre is not on record it is taken as the one before.
    """
    drivers = list(facts.grid)
    status = [GREEN] * facts.laps
    for lap, code in neutralised_laps(race).select("lap", "status").iter_rows():
        if lap <= facts.laps:
            status[lap - 1] = int(code)
    retire = {i: min(facts.laps_done[d] + 1, facts.laps) for i, d in enumerate(drivers) if d in facts.retired}
    plans = {i: _plan(race, d, facts.laps) for i, d in enumerate(drivers)}
    return Script(tuple(status), retire, plans, frozenset(i for i, d in enumerate(drivers) if d in facts.disqualified))


def _plan(race: pl.DataFrame, driver: str, distance: int) -> Plan:
    """The compounds and stops of one car, as they were."""
    own = race.filter(pl.col("driver") == driver).sort("lap")
    codes = [_code(c) for c in own["compound"].drop_nulls()]
    compounds = [codes[0] if codes else WET_TYRE_STANDS_FOR]
    laps: list[int] = []
    for lap, fitted in tyre_stops(race).filter(pl.col("driver") == driver).sort("lap").select("lap", "next_compound").iter_rows():
        if lap < distance and len(laps) < MAX_STOPS:
            laps.append(int(lap))
            compounds.append(compounds[-1] if fitted is None else _code(fitted))
    return Plan(tuple(compounds), tuple(laps), 0, 0)


def _code(letter: str) -> int:
    return COMPOUNDS.index(letter) if letter in COMPOUNDS else WET_TYRE_STANDS_FOR
