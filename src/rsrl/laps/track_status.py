"""Track status lap by lap: green, virtual safety car, safety car, red flag."""

from typing import Final

import polars as pl

from rsrl.laps.schema import RACE

GREEN, VSC, SC, RED = 0, 1, 2, 3
"""Values of the column `status`, the same as in `rsrl.season`."""

SLOW_LAP: Final = 1.15
"""A lap this much slower than the race's median green lap was driven under a neutralisation."""

FEWEST_OUT: Final = 3
"""With fewer cars than this outside the pit lane on a lap behind the safety car, it led the field through it."""


def with_status(table: pl.DataFrame) -> pl.DataFrame:
    """Add `status` (`GREEN`, `VSC`, `SC` or `RED`, the gravest seen) and `yellow`, from the digits seen during the lap."""
    digits = pl.col("track_status").fill_null("")
    return table.with_columns(
        status=pl.when(digits.str.contains("5"))
        .then(RED)
        .when(digits.str.contains("4"))
        .then(SC)
        .when(digits.str.contains("[67]"))
        .then(VSC)
        .otherwise(GREEN),
        yellow=digits.str.contains("2"),
    )


def neutralised_laps(table: pl.DataFrame) -> pl.DataFrame:
    """The race laps driven slowly behind a safety car or under a virtual one: `season, round, lap, status, factor`.

    A lap counts where the median car both saw the status and was slower than the race's median green lap by `SLOW_LAP` (under a VSC by
    half that excess): the digits alone also mark laps on which the status came or went for a moment.
    `factor` is the median lap time over the median green lap time. Laps through the pit lane are left out, because stops make them slow;
    where the safety car leads the field through it they are all there is, and count. After a red flag the field leaves the pit lane
    too: that is a restart.
    """
    marked = with_status(table)
    green = (
        marked.filter((pl.col("status") == GREEN) & pl.col("pit_in_s").is_null() & (pl.col("lap") > 1))
        .group_by(*RACE)
        .agg(green_s=pl.col("lap_time_s").median())
    )
    laps = (
        _with_led_through(marked)
        .filter(pl.col("_led") | ~pl.col("_lane"))
        .group_by(*RACE, "lap")
        .agg(median_s=pl.col("lap_time_s").median(), status=pl.col("status").cast(pl.Float64).median().round().cast(pl.Int64))
        .join(green, on=RACE, how="left")
        .with_columns(factor=pl.col("median_s") / pl.col("green_s"))
    )
    limit = pl.when(pl.col("status") == VSC).then(1 + (SLOW_LAP - 1) / 2).otherwise(SLOW_LAP)
    slow = (pl.col("factor") > limit) | pl.col("factor").is_null()
    return laps.filter((pl.col("status") != GREEN) & slow).select(*RACE, "lap", "status", "factor").sort(*RACE, "lap")


def _with_led_through(marked: pl.DataFrame) -> pl.DataFrame:
    """Add `_lane` (in the pit lane at either end of the lap) and `_led` (on a lap on which the safety car led the field through it)."""
    lap = [*RACE, "lap"]
    lane = pl.col("pit_in_s").is_not_null() | (pl.col("pit_out_s").is_not_null() & (pl.col("lap") > 1))
    by_lap = marked.group_by(*lap).agg(
        _few=(~lane).sum() < FEWEST_OUT,
        _behind=pl.col("status").cast(pl.Float64).median() == SC,
        _red=(pl.col("status") == RED).any(),
    )
    stopped = by_lap.filter("_red").select(*lap)
    restarted = pl.concat([stopped, stopped.with_columns(pl.col("lap") + 1)]).unique().with_columns(_restart=True)
    led = by_lap.join(restarted, on=lap, how="left").with_columns(_led=pl.col("_few") & pl.col("_behind") & pl.col("_restart").is_null())
    return marked.with_columns(_lane=lane).join(led.select(*lap, "_led"), on=lap, how="left")
