"""What follows from the lap table by counting: stints, neutralised laps, gaps on the track."""

from typing import Final

import polars as pl

from rsrl.laps.schema import CAR, RACE

SLOW_LAP: Final = 1.15
"""A lap this much slower than the race's median green lap was driven under a neutralisation."""


def with_stint_ages(table: pl.DataFrame) -> pl.DataFrame:
    """Add `in_lap`, `out_lap`, `stint_number` (from 1) and `age_laps` (laps of this stint before this lap).

    Stints are counted from pit stops, and from a change of compound where the stop was not recorded (red flag), not
    from the source's `stint` and `tyre_life` columns, which disagree with the stops on about a fifth of the rows.
    """
    changed = (pl.col("compound") != pl.col("compound").shift(1)).fill_null(False)
    out = pl.col("pit_out_s").is_not_null() & (pl.col("lap") > 1) | pl.col("pit_in_s").shift(1).is_not_null()
    return (
        table.sort(*CAR, "lap")
        .with_columns(
            in_lap=pl.col("pit_in_s").is_not_null(),
            out_lap=out.fill_null(False).over(*CAR),
            _new=(out.fill_null(False) | changed).over(*CAR),
        )
        .with_columns(stint_number=(1 + pl.col("_new").cast(pl.Int64).cum_sum()).over(*CAR))
        .with_columns(age_laps=(pl.col("lap") - pl.col("lap").min()).over(*CAR, "stint_number"))
        .drop("_new")
    )


def stints(table: pl.DataFrame) -> pl.DataFrame:
    """One row per stint: `compound`, `compound_c`, `first_lap`, `last_lap`, `laps`, `used_laps` (on the set before), `fresh_tyre`."""
    return (
        with_stint_ages(table)
        .group_by(*CAR, "team", "stint_number", maintain_order=True)
        .agg(
            compound=pl.col("compound").drop_nulls().first(),
            compound_c=pl.col("compound_c").drop_nulls().first(),
            first_lap=pl.col("lap").min(),
            last_lap=pl.col("lap").max(),
            laps=pl.len(),
            used_laps=(pl.col("tyre_life_laps") - pl.col("age_laps") - 1).first(),
            fresh_tyre=pl.col("fresh_tyre").first(),
        )
    )


def with_status(table: pl.DataFrame) -> pl.DataFrame:
    """Add `status` per row: 0 green, 1 VSC, 2 SC, 3 red, and `yellow`, from the digits seen during the lap."""
    digits = pl.col("track_status").fill_null("")
    return table.with_columns(
        status=pl.when(digits.str.contains("5"))
        .then(3)
        .when(digits.str.contains("4"))
        .then(2)
        .when(digits.str.contains("[67]"))
        .then(1)
        .otherwise(0),
        yellow=digits.str.contains("2"),
    )


def neutralised_laps(table: pl.DataFrame) -> pl.DataFrame:
    """The race laps driven slowly behind a safety car or under a virtual one: `season, round, lap, status, factor`.

    A lap counts where the median car both saw the status (2 SC, 1 VSC, 3 red) and lapped `SLOW_LAP` (for a VSC half that
    excess) slower than the race's median green lap: the digits alone also mark laps in which it came or went for a moment.
    `factor` is the median lap time over the median green lap time.
    """
    marked = with_status(table)
    green = (
        marked.filter((pl.col("status") == 0) & pl.col("pit_in_s").is_null() & (pl.col("lap") > 1))
        .group_by(*RACE)
        .agg(green_s=pl.col("lap_time_s").median())
    )
    laps = (
        marked.filter(pl.col("pit_in_s").is_null() & (pl.col("pit_out_s").is_null() | (pl.col("lap") == 1)))
        .group_by(*RACE, "lap")
        .agg(median_s=pl.col("lap_time_s").median(), status=pl.col("status").cast(pl.Float64).median().round().cast(pl.Int64))
        .join(green, on=RACE, how="left")
        .with_columns(factor=pl.col("median_s") / pl.col("green_s"))
    )
    limit = pl.when(pl.col("status") == 1).then(1 + (SLOW_LAP - 1) / 2).otherwise(SLOW_LAP)
    slow = (pl.col("factor") > limit) | pl.col("factor").is_null()
    return laps.filter((pl.col("status") > 0) & slow).select(*RACE, "lap", "status", "factor").sort(*RACE, "lap")


def with_gaps(table: pl.DataFrame) -> pl.DataFrame:
    """Add the traffic each car met, from the times it and the others crossed the line.

    `gap_ahead_s`, `driver_ahead`, `lap_ahead`: to the car that crossed last before it at the END of this lap, whatever
    lap that one was on (a car about to be lapped counts: it is in the way); the `_start` columns are the same at the end of the lap before.
    """
    crossing = (
        table.filter(pl.col("session_time_s").is_not_null())
        .sort(*RACE, "session_time_s", "position")
        .with_columns(
            gap_ahead_s=(pl.col("session_time_s") - pl.col("session_time_s").shift(1)).over(*RACE),
            driver_ahead=pl.col("driver").shift(1).over(*RACE),
            lap_ahead=pl.col("lap").shift(1).over(*RACE),
        )
        .select(*CAR, "lap", "gap_ahead_s", "driver_ahead", "lap_ahead")
    )
    before = crossing.select(
        *CAR,
        (pl.col("lap") + 1).alias("lap"),
        pl.col("gap_ahead_s").alias("gap_start_s"),
        pl.col("driver_ahead").alias("driver_ahead_start"),
        pl.col("lap_ahead").alias("lap_ahead_start"),
    )
    joined = table.join(crossing, on=[*CAR, "lap"], how="left").join(before, on=[*CAR, "lap"], how="left")
    return joined.sort(*CAR, "lap")
