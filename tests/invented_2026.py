"""The first three races of an invented 2026, as its lap file may look: 22 cars, two teams nobody knew, circuits without a history.

Two races are dry and one of them is on compounds without C-numbers; the third one has laps on tyres that are not on record.
"""

from typing import Final

import polars as pl
from calibration_laps import known_record, simulated

EVENTS: Final = ("Barcelona Grand Prix", "Spanish Grand Prix", "Grand Prix of Atlantis")
NAMES: Final = ("barcelona-2026", "spain-2026", "atlantis-2026")
NEW_TEAMS: Final = ("Audi", "Cadillac")
CARS: Final = 22
UNKNOWN_LAPS: Final = 9


def season_2026(races: int = len(EVENTS)) -> pl.DataFrame:
    """The lap table of the first races."""
    return pl.concat([_race(number, event) for number, event in enumerate(EVENTS[:races], 1)])


def _race(number: int, event: str) -> pl.DataFrame:
    table = simulated(known_record(base_lap_s=80.0 + 4 * number), 40 + number, (2026,))
    names = {"season": pl.lit(2026, pl.Int64), "round": pl.lit(number, pl.Int64), "event": pl.lit(event)}
    team = pl.col("team").replace({"Alfa Romeo": NEW_TEAMS[0]})
    laps = pl.concat([table.with_columns(team=team), _late_pair(table)]).with_columns(**names)
    if number == 2:
        laps = laps.with_columns(compound_c=pl.lit(None, pl.String))
    if number == 3:
        lost = (pl.col("driver") == "HAM") & (pl.col("lap") <= UNKNOWN_LAPS)
        laps = laps.with_columns(compound=pl.when(~lost).then("compound"), compound_c=pl.when(~lost).then("compound_c"))
    return laps.sort("driver", "lap")


def _late_pair(table: pl.DataFrame) -> pl.DataFrame:
    """Two more cars: as the last pair of the field, two tenths slower a lap."""
    last = table.filter(pl.col("lap") == 1).sort("position")["driver"].to_list()[-2:]
    behind = 4.0 + 0.2 * pl.col("lap")
    times = {name: pl.col(name) + behind for name in ("session_time_s", "pit_in_s", "pit_out_s")}
    return table.filter(pl.col("driver").is_in(last)).with_columns(
        driver=pl.col("driver").replace(dict(zip(last, ("NEW", "OLD"), strict=True))),
        team=pl.lit(NEW_TEAMS[1]),
        lap_time_s=pl.col("lap_time_s") + 0.2,
        position=pl.col("position") + 2,
        **times,
    )
