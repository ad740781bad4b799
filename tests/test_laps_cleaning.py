"""Cleaning, stints, neutralised laps and gaps, on laps written out by hand."""

from typing import Any

import polars as pl
import pytest
from invented_laps import race, row, stop, table

from rsrl.laps import clean, neutralised_laps, stints, with_gaps, with_stint_ages


def removed(rows: list[dict[str, Any]], **options: Any) -> dict[str, int]:
    cleaned = clean(table(rows), **options)
    counts = {name: n for name, n, _ in cleaned.attrition.iter_rows() if n}
    assert cleaned.laps.height == cleaned.attrition["left"][-1] == len(rows) - sum(counts.values())
    return counts


def test_only_first_laps_go_from_a_plain_race() -> None:
    assert removed(race()) == {"lap 1": 4}


def test_each_fault_is_counted_under_its_own_filter() -> None:
    rows = race()
    stop(rows, 0, 10)
    row(rows, 1, 5)["lap_time_s"] = None
    row(rows, 1, 20)["lap_time_s"] = 150.0
    row(rows, 1, 8)["track_status"] = "24"
    row(rows, 1, 9)["track_status"] = "67"
    row(rows, 2, 5)["lap_time_s"] = 95.0
    row(rows, 3, 7).update(track_status="2", lap_time_s=92.0)
    row(rows, 3, 12)["compound"] = None
    row(rows, 3, 13)["track_status"] = "5"
    assert removed(rows) == {
        "no lap time": 1,
        "phantom lap of 150 s": 1,
        "unknown compound": 1,
        "lap 1": 4,
        "in-lap": 1,
        "out-lap": 1,
        "red flag": 1,
        "safety car": 1,
        "virtual safety car": 1,
        "yellow flag and slower than 1.5 % of the stint": 1,
        "outlier against the stint": 1,
    }


def test_wet_race_goes_as_a_whole_unless_asked_for() -> None:
    rows = race()
    row(rows, 0, 3)["compound"] = "I"
    assert removed(rows) == {"race with wet tyres": 80}
    assert removed(rows, dry_only=False) == {"wet tyres": 1, "lap 1": 4}


def test_laps_beyond_the_distance_and_broken_races_go() -> None:
    assert removed(race(), race_laps={(2023, 1): 18}) == {"beyond the classified distance": 8, "lap 1": 4}
    assert removed(race(season=2020)) == {"race known to be broken": 80}


def test_stints_follow_the_stops_not_the_source() -> None:
    rows = race(2)
    stop(rows, 0, 7)
    for r in rows:
        r["stint"] = 9  # the source is wrong
    found = stints(table(rows)).filter(pl.col("driver") == "D00")
    assert found.select("compound", "first_lap", "last_lap", "laps").rows() == [("S", 1, 7, 7), ("H", 8, 20, 13)]
    ages = with_stint_ages(table(rows)).filter(pl.col("driver") == "D00")
    assert ages["age_laps"].to_list() == [*range(7), *range(13)]
    assert ages.filter(pl.col("out_lap"))["lap"].to_list() == [8]


def test_a_stop_for_the_same_compound_starts_a_stint() -> None:
    rows = race(1)
    stop(rows, 0, 7, compound="S")
    assert stints(table(rows))["laps"].to_list() == [7, 13]


def test_used_laps_of_a_set_are_those_before_the_race() -> None:
    rows = race(1)
    for r in rows:
        r["tyre_life_laps"] += 3
    assert stints(table(rows))["used_laps"].to_list() == [3.0]


def test_neutralised_laps_need_the_flag_and_the_slowness() -> None:
    rows = race()
    for d in range(4):
        row(rows, d, 6).update(track_status="4", lap_time_s=130.0)
        row(rows, d, 7).update(track_status="4", lap_time_s=90.5)  # it had gone in: a racing lap
        row(rows, d, 9).update(track_status="67", lap_time_s=110.0)
        row(rows, d, 12)["lap_time_s"] = 130.0  # slow, but nobody said why
    found = neutralised_laps(table(rows))
    assert found.select("lap", "status").rows() == [(6, 2), (9, 1)]
    assert found["factor"].to_list() == pytest.approx([130 / 90, 110 / 90])


def test_a_safety_car_that_leads_the_field_through_the_pit_lane_is_one() -> None:
    """Nobody stays out on laps 6 and 7: without laps through the lane there would be none to see the safety car on."""
    rows = race(5)
    for d in range(5):
        for lap in (6, 7):
            row(rows, d, lap).update(track_status="4", lap_time_s=140.0, pit_in_s=100.0 * lap)
            row(rows, d, lap + 1)["pit_out_s"] = 100.0 * lap + 15.0
        row(rows, d, 10).update(track_status="5", lap_time_s=200.0, pit_in_s=1000.0)
        row(rows, d, 11).update(track_status="4", lap_time_s=1500.0, pit_out_s=2400.0)  # from the pit lane to a standing restart
    found = neutralised_laps(table(rows))
    assert found.select("lap", "status").rows() == [(6, 2), (7, 2)]
    assert found["factor"].to_list() == pytest.approx([140 / 90, 140 / 90])
    for d in range(3):  # three stay out on lap 6, at racing speed: the others' laps are slow for their stops
        row(rows, d, 6).update(lap_time_s=90.0, pit_in_s=None)
        row(rows, d, 7)["pit_out_s"] = None
    assert neutralised_laps(table(rows))["lap"].to_list() == [7]


def test_gap_is_to_the_car_that_crossed_before_whatever_its_lap() -> None:
    rows = race(2, laps=4)
    for r in rows:
        if r["driver"] == "D01":
            r["session_time_s"] += 89.0  # nearly a lap down: the leader's next crossing is 1 s before
    gaps = with_gaps(table(rows)).filter((pl.col("driver") == "D01") & (pl.col("lap") == 2)).row(0, named=True)
    assert gaps["gap_ahead_s"] == pytest.approx(1.0)
    assert (gaps["driver_ahead"], gaps["lap_ahead"]) == ("D00", 3)
    assert gaps["gap_start_s"] == pytest.approx(1.0)
