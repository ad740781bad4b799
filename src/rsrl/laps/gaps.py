"""Gaps at the line: who crossed it just before whom, and how long before."""

import polars as pl

from rsrl.laps.schema import CAR, RACE


def with_gaps(table: pl.DataFrame) -> pl.DataFrame:
    """Add the gap of each car to the one that crossed the line before it.

    `gap_ahead_s`, `driver_ahead`, `lap_ahead`: at the end of this lap, whatever lap that car was on (a car about to be lapped counts, as it
    is in the way). `gap_start_s`, `driver_ahead_start`, `lap_ahead_start`: the same at the end of the lap before.
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
