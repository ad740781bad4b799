"""Whether a car changed its tyres at the end of a lap: decided here, for stints, calibration and backtest alike.

A passage of the pit lane need not be a tyre stop: it may be a drive-through, a stop-and-go penalty, or a safety car leading the field
through the pit lane. The tyre record of the source (`compound`, `tyre_life`) separates most of them, but it misses some new sets and has
others laps late. Where the record shows no new set, the time in the pit lane decides: a drive-through is about 5 s quicker.
"""

from typing import Final

import polars as pl

from rsrl.laps.schema import CAR, RACE
from rsrl.laps.track_status import RED, SC, with_status

DRIVE_THROUGH_S: Final = 3.0
"""A passage this much quicker than the race's usual stop was driven through; 0.2 % of the recorded stops of 2018-2024 were as quick."""

STOP_AND_GO_S: Final = 5.0
"""A passage this much slower, recorded as a visit without new tyres, was a stop-and-go penalty or a repair."""

LED_THROUGH_SHARE: Final = 0.5
"""With this share of the cars in the pit lane on one lap behind the safety car, it leads the field through."""

FEWEST_RECORDED: Final = 5
"""Stops with a recorded new set that the usual time in the pit lane needs; with fewer, it is taken over all passages of the race."""

FEWEST_PASSAGES: Final = 3
"""With fewer, the usual time in the pit lane is unknown and the tyre record alone decides."""


def with_tyre_stops(table: pl.DataFrame) -> pl.DataFrame:
    """Add `tyre_stop` (new tyres at the end of this lap) and `red_stop` (such a stop under a red flag: it cost no time).

    `compound` and `compound_c` are corrected on sets that the record has late (to what it has later in the stint) or misses (to null,
    unknown). Sorted by race, driver and lap.
    """
    laps = with_status(table).sort(*CAR, "lap")
    laps = _with_passages(laps)
    laps = laps.join(_usual_lane(laps), on=RACE, how="left", maintain_order="left")
    laps = laps.with_columns(tyre_stop=_is_stop())
    laps = _with_fitted_compounds(laps)
    return laps.with_columns(red_stop=pl.col("tyre_stop") & pl.col("_red")).select(*table.columns, "tyre_stop", "red_stop")


def tyre_stops(table: pl.DataFrame) -> pl.DataFrame:
    """Every change of tyres: `season, round, driver, lap, compound, next_compound, status, red`; the stop is at the end of `lap`.

    `next_compound` is null where the record misses the new set; `red`: under a red flag, so that the stop cost no time.
    """
    laps = with_status(with_tyre_stops(table)).with_columns(next_compound=pl.col("compound").shift(-1).over(*CAR))
    return laps.filter("tyre_stop").select(*CAR, "lap", "compound", "next_compound", "status", red="red_stop")


def _with_passages(laps: pl.DataFrame) -> pl.DataFrame:
    """Add what the rule needs of each lap and the next: passage, time in the pit lane, red flag, tyre record, field led through."""
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
    stood = ~(over_s < -DRIVE_THROUGH_S).fill_null(False)  # assumed where the time is unknown
    timed, led = over_s.is_not_null(), pl.col("_led")
    # A visit recorded without new tyres (`stint` goes up, the age goes on) was a penalty or repair, unless it took as long as a tyre stop.
    long_visit = pl.col("_counted") & (over_s > STOP_AND_GO_S)
    set_missed = timed & stood & ~long_visit & ~led & ~pl.col("_red")
    # Without a tyre record any passage is a stop, but for a start from the pit lane: no time, on lap 1.
    no_record = stood & ~led & (timed | (pl.col("lap") > 1))
    after_passage = pl.when("_new_set").then(stood | ~led).when("_same_set").then(set_missed).otherwise(no_record)
    return pl.when("_passage").then(after_passage).otherwise(pl.col("_red") & pl.col("_other_compound"))


def _with_fitted_compounds(laps: pl.DataFrame) -> pl.DataFrame:
    """Compounds of sets that the record misses at the stop: what it has later in the stint, else null."""
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
