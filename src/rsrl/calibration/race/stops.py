"""Table of pit stops: the time each lost against the cars that stayed out on the same two laps."""

import polars as pl

from rsrl.laps import CAR, RACE, with_gaps, with_status, with_stint_ages

MIN_REFERENCES = 4  # cars that stayed out, for a median


def stop_table(table: pl.DataFrame) -> pl.DataFrame:
    """One row per tyre stop (no drive-through) with a whole in-lap and out-lap, the car staying on track after it.

    Columns: `season, round, driver, team, lap` (of the in-lap), `status` and `status_out` of the two laps, `compound_c`,
    `compound_out`, `compound_c_out`, `age_laps`, `in_s`, `out_s`, `lane_s` (entry to exit of the pit lane), `loss_s` (both laps against the
    median car that stayed out), `slow_in`, `slow_out` (that median over the race's median green lap), `gap_start_s` (to the car ahead
    as the in-lap begins), `out_gap_s` (as the out-lap ends).
    """
    laps = with_gaps(with_status(with_stint_ages(table))).sort(*CAR, "lap")
    after = laps.select(
        *CAR,
        (pl.col("lap") - 1).alias("lap"),
        pl.col("lap_time_s").alias("out_s"),
        pl.col("pit_out_s").alias("lane_out_s"),
        pl.col("status").alias("status_out"),
        pl.col("compound").alias("compound_out"),
        pl.col("compound_c").alias("compound_c_out"),
        pl.col("in_lap").alias("in_again"),
        pl.col("gap_ahead_s").alias("out_gap_s"),
    )
    stayed = laps.filter(~pl.col("in_lap") & ~pl.col("out_lap"))
    reference = (
        stayed.group_by(*RACE, "lap").agg(stayed_s=pl.col("lap_time_s").median(), cars=pl.len()).filter(pl.col("cars") >= MIN_REFERENCES)
    )
    green = stayed.filter((pl.col("status") == 0) & (pl.col("lap") > 1)).group_by(*RACE).agg(green_s=pl.col("lap_time_s").median())
    later = reference.select(*RACE, (pl.col("lap") - 1).alias("lap"), pl.col("stayed_s").alias("stayed_out_s"))
    return (
        laps.filter(pl.col("tyre_stop") & pl.col("in_lap") & (pl.col("lap") > 1))
        .rename({"lap_time_s": "in_s"})
        .join(after, on=[*CAR, "lap"])
        .filter(~pl.col("in_again"))
        .join(reference, on=[*RACE, "lap"], how="left")
        .join(later, on=[*RACE, "lap"], how="left")
        .join(green, on=RACE)
        .with_columns(
            lane_s=pl.col("lane_out_s") - pl.col("pit_in_s"),
            loss_s=pl.col("in_s") + pl.col("out_s") - pl.col("stayed_s") - pl.col("stayed_out_s"),
            slow_in=pl.col("stayed_s") / pl.col("green_s"),
            slow_out=pl.col("stayed_out_s") / pl.col("green_s"),
        )
        .sort(*RACE, "lap", "driver")
    )


def green_stops(stops: pl.DataFrame) -> pl.DataFrame:
    """Stops of which both laps were green and neither the field nor the stop was slowed by anything else."""
    return stops.filter(
        (pl.col("status") == 0)
        & (pl.col("status_out") == 0)
        & (pl.col("slow_in").fill_null(1.0) < 1.05)
        & (pl.col("slow_out").fill_null(1.0) < 1.05)
        & pl.col("in_s").is_not_null()
        & pl.col("out_s").is_not_null()
        & (pl.col("lane_s") < 60.0)
    )
