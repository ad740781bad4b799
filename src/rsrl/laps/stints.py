"""Stints and the age of the tyres on every lap."""

import polars as pl

from rsrl.laps.schema import CAR
from rsrl.laps.tyre_stops import with_tyre_stops


def with_stint_ages(table: pl.DataFrame) -> pl.DataFrame:
    """Add `in_lap`, `out_lap`, `stint_number` (from 1), `age_laps` (laps of this stint before this lap); `with_tyre_stops` adds its own.

    A stint begins with new tyres (`rsrl.laps.tyre_stops`), not with the source's `stint`, which also counts drive-throughs and
    misses stops. `in_lap` and `out_lap` mark every passage of the pit lane, with new tyres or without: neither lap is a racing lap.
    """
    out = pl.col("pit_out_s").is_not_null() & (pl.col("lap") > 1) | pl.col("pit_in_s").shift(1).is_not_null()
    new_tyres = pl.col("tyre_stop").shift(1, fill_value=False)
    return (
        with_tyre_stops(table)
        .with_columns(in_lap=pl.col("pit_in_s").is_not_null(), out_lap=out.fill_null(False).over(*CAR))
        .with_columns(stint_number=(1 + new_tyres.cast(pl.Int64).cum_sum()).over(*CAR))
        .with_columns(age_laps=(pl.col("lap") - pl.col("lap").min()).over(*CAR, "stint_number"))
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
