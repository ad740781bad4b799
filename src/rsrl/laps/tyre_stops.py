"""Did this car change its tyres at the end of this lap? The one answer, for stints, calibration and backtest alike.

A passage of the pit lane is not yet a stop: it may be a drive-through, a stop-and-go, or a safety car that leads the field through the
pit lane. The source's tyre record (`compound`, `tyre_life`) tells most of them apart, but it misses some sets altogether and notes others
some laps late. Where it says that the old set goes on, the time in the pit lane decides: a drive-through is about 5 s quicker than a stop.
"""

from typing import Final

import polars as pl

from rsrl.laps.schema import CAR, RACE
from rsrl.laps.track_status import RED, SC, with_status

DRIVE_THROUGH_S: Final = 3.0
"""A passage this much quicker than the race's usual stop had no stop in it; of recorded stops of 2018-2024 0.2 % were as quick."""

STOP_AND_GO_S: Final = 5.0
"""A passage this much slower, noted by the source as one without new tyres, was a stop-and-go penalty or a repair."""

LED_THROUGH_SHARE: Final = 0.5
"""Of the cars on track: so many in the pit lane on one lap behind the safety car are being led through it."""

FEWEST_RECORDED: Final = 5
"""Stops with a recorded new set for the usual time in the pit lane; with fewer, all passages of the race count."""

FEWEST_PASSAGES: Final = 3
"""With fewer, a race's usual time in the pit lane is unknown, and the tyre record decides alone."""


def with_tyre_stops(table: pl.DataFrame) -> pl.DataFrame:
    """Add `tyre_stop` (new tyres at the end of this lap) and `red_stop` (such a stop under a red flag: it cost no time).

    `compound` and `compound_c` are put right on laps on a set that the source noted late (the set noted later in the same stint) or
    never (null: unknown). Sorted by race, driver and lap.
    """
    laps = with_status(table).sort(*CAR, "lap")
    laps = _with_passages(laps)
    laps = laps.join(_usual_lane(laps), on=RACE, how="left", maintain_order="left")
    laps = laps.with_columns(tyre_stop=_is_stop())
    laps = _with_fitted_compounds(laps)
    return laps.with_columns(red_stop=pl.col("tyre_stop") & pl.col("_red")).select(*table.columns, "tyre_stop", "red_stop")


def tyre_stops(table: pl.DataFrame) -> pl.DataFrame:
    """Every change of tyres: `season, round, driver, lap, compound, next_compound, status, red`; the stop is at the end of `lap`.

    `next_compound` is null where the source never noted the new set; `red`: under a red flag, so that the stop cost no time.
    """
    laps = with_status(with_tyre_stops(table)).with_columns(next_compound=pl.col("compound").shift(-1).over(*CAR))
    return laps.filter("tyre_stop").select(*CAR, "lap", "compound", "next_compound", "status", red="red_stop")


def _with_passages(laps: pl.DataFrame) -> pl.DataFrame:
    """Add what the rule asks of each lap and the car's next one: passage, time in the pit lane, red flag, what the record says."""
    following = {name: pl.col(name).shift(-1).over(*CAR) for name in ("compound", "tyre_life_laps", "stint", "pit_out_s", "lap", "status")}
    laps = laps.with_columns(**{f"_next_{name}": column for name, column in following.items()})
    other_compound = (pl.col("compound") != pl.col("_next_compound")).fill_null(False)
    goes_on = (pl.col("_next_tyre_life_laps") == pl.col("tyre_life_laps") + 1).fill_null(False)
    passage = pl.col("pit_in_s").is_not_null() | pl.col("_next_pit_out_s").is_not_null()
    laps = laps.with_columns(
        _passage=passage & pl.col("_next_lap").is_not_null(),
        _lane_s=pl.col("_next_pit_out_s") - pl.col("pit_in_s"),
        _red=(pl.col("status") == RED) | (pl.col("_next_status") == RED).fill_null(False),
        _other_compound=other_compound,
        _new_set=other_compound | (pl.col("_next_tyre_life_laps") != pl.col("tyre_life_laps") + 1).fill_null(False),
        _same_set=goes_on & ~other_compound,
        _counted=(pl.col("_next_stint") > pl.col("stint")).fill_null(False),
    )
    share = pl.col("_passage").mean().over(*RACE, "lap")
    return laps.with_columns(_led=(pl.col("status") == SC) & (share >= LED_THROUGH_SHARE))


def _usual_lane(laps: pl.DataFrame) -> pl.DataFrame:
    """The race's usual time in the pit lane of a tyre stop, `_usual_s`: the speed limit is the same under any track status."""
    lanes = laps.filter("_passage", ~pl.col("_red"), pl.col("_lane_s").is_not_null())
    recorded, free = pl.col("_lane_s").filter("_new_set"), pl.col("_lane_s").filter(~pl.col("_led"))
    usual = pl.when(recorded.len() >= FEWEST_RECORDED).then(recorded.median()).when(free.len() >= FEWEST_PASSAGES).then(free.median())
    return lanes.group_by(*RACE).agg(_usual_s=usual)


def _is_stop() -> pl.Expr:
    over_s = pl.col("_lane_s") - pl.col("_usual_s")
    stood = ~(over_s < -DRIVE_THROUGH_S).fill_null(False)  # taken so where the time is not known
    timed, led = over_s.is_not_null(), pl.col("_led")
    # A visit that the source counted without new tyres is a penalty or a repair, unless it took just as long as a tyre stop.
    long_visit = pl.col("_counted") & (over_s > STOP_AND_GO_S)
    set_missed = timed & stood & ~long_visit & ~led & ~pl.col("_red")
    # Without a tyre record any passage is a stop, but for a start from the pit lane: no time, on lap 1.
    no_record = stood & ~led & (timed | (pl.col("lap") > 1))
    after_passage = pl.when("_new_set").then(stood | ~led).when("_same_set").then(set_missed).otherwise(no_record)
    return pl.when("_passage").then(after_passage).otherwise(pl.col("_red") & pl.col("_other_compound"))


def _with_fitted_compounds(laps: pl.DataFrame) -> pl.DataFrame:
    """Compounds of sets that the source did not note at the stop: from its later note in the same stint, else null."""
    begins = pl.col("tyre_stop").shift(1, fill_value=False)
    missed = (pl.col("tyre_stop") & pl.col("_same_set")).shift(1, fill_value=False)
    laps = laps.with_columns(_stint=begins.over(*CAR).cast(pl.Int64).cum_sum().over(*CAR), _missed=missed.over(*CAR))
    stint = [*CAR, "_stint"]
    noted = (pl.col("_new_set") & ~pl.col("tyre_stop")).any().over(stint)
    found = {
        name: pl.when(~pl.col("_missed").any().over(stint)).then(name).when(noted).then(pl.col(name).drop_nulls().last().over(stint))
        for name in ("compound", "compound_c")
    }
    return laps.with_columns(**found)
