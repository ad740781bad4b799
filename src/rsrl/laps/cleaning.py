"""Selects the laps fit for a dry-pace regression, and counts what each filter removes."""

from collections.abc import Mapping
from typing import Final, NamedTuple

import polars as pl

from rsrl.laps.gaps import with_gaps
from rsrl.laps.schema import CAR, DRY, RACE
from rsrl.laps.stints import with_stint_ages
from rsrl.laps.track_status import RED, SC, VSC, with_status

PHANTOM_S: Final = 150.0
"""Lap time of phantom laps, a fault of the source at the end of some 2023 races."""

OUTLIER_SHARE: Final = 0.035
"""A lap this much above the running median of its stint is no racing lap: a mistake, damage, a car let past."""

BROKEN_RACES: Final = {(2020, 1): "misnumbered laps", (2021, 12): "no race was run"}


class Cleaned(NamedTuple):
    """Kept laps (with stint, status and gap columns) and the attrition: `filter, removed, left`, in order of application."""

    laps: pl.DataFrame
    attrition: pl.DataFrame


def clean(table: pl.DataFrame, race_laps: Mapping[tuple[int, int], int] | None = None, dry_only: bool = True) -> Cleaned:
    """Green-flag racing laps fit for a pace regression.

    Args:
        table: the lap table, all cars of each race (gaps need them all).
        race_laps: classified distance by (season, round); laps beyond it are dropped. None: no such limit.
        dry_only: drop whole races in which any car ran intermediates or wets, besides those laps themselves.
    """
    laps = with_gaps(with_status(with_stint_ages(table)))
    steps: list[tuple[str, int, int]] = [("read", 0, laps.height)]
    for name, keep in _filters(laps, race_laps or {}, dry_only):
        left = laps.filter(keep.fill_null(False))
        steps.append((name, laps.height - left.height, left.height))
        laps = left
    attrition = pl.DataFrame(steps, schema={"filter": pl.String, "removed": pl.Int64, "left": pl.Int64}, orient="row")
    return Cleaned(laps, attrition)


def _filters(laps: pl.DataFrame, race_laps: Mapping[tuple[int, int], int], dry_only: bool) -> list[tuple[str, pl.Expr]]:
    """Filters in order: name, and what is kept. A lap is counted under the first filter that removes it."""
    broken = [f"{s}/{r}" for s, r in BROKEN_RACES]
    wet = laps.filter(pl.col("compound").is_in(["I", "W"])).select(*RACE).unique()
    wet_names = [f"{s}/{r}" for s, r in wet.iter_rows()] if dry_only else []
    race = pl.format("{}/{}", *RACE)
    distance = pl.lit(10_000)
    for (season, number), last in race_laps.items():
        distance = pl.when((pl.col("season") == season) & (pl.col("round") == number)).then(last).otherwise(distance)
    time = pl.col("lap_time_s")
    typical = time.rolling_median(window_size=7, min_samples=1, center=True).over(*CAR, "stint_number")
    return [
        ("race known to be broken", ~race.is_in(broken)),
        ("race with wet tyres", ~race.is_in(wet_names)),
        ("beyond the classified distance", pl.col("lap") <= distance),
        ("no lap time", time.is_not_null() & (time > 0)),
        ("phantom lap of 150 s", time != PHANTOM_S),
        ("unknown compound", pl.col("compound").is_not_null()),
        ("wet tyres", pl.col("compound").is_in(list(DRY))),
        ("lap 1", pl.col("lap") > 1),
        ("in-lap", ~pl.col("in_lap")),
        ("out-lap", ~pl.col("out_lap")),
        ("red flag", pl.col("status") != RED),
        ("safety car", pl.col("status") != SC),
        ("virtual safety car", pl.col("status") != VSC),
        ("yellow flag and slower than 1.5 % of the stint", ~pl.col("yellow") | (time < 1.015 * typical)),
        ("outlier against the stint", time < (1 + OUTLIER_SHARE) * typical),
        ("too quick to be a lap", time > 0.95 * time.median().over(*RACE)),
    ]
