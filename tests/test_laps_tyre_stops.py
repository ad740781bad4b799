"""Which passages of the pit lane were tyre stops: each way in which the source errs, on invented laps, and real races that show it."""

from pathlib import Path
from typing import Any

import polars as pl
import pytest
from invented_laps import new_set, passage, race, row, stop, table

from rsrl.laps import read_seasons, track_status, tyre_stops, with_stint_ages
from rsrl.season import GREEN, RED, SC, VSC


def stops_of(rows: list[dict[str, Any]], driver: int = 0) -> list[int]:
    return tyre_stops(table(rows)).filter(pl.col("driver") == f"D{driver:02d}")["lap"].to_list()


def ages_of(rows: list[dict[str, Any]], driver: int = 0) -> list[int]:
    return with_stint_ages(table(rows)).filter(pl.col("driver") == f"D{driver:02d}")["age_laps"].to_list()


def usual_race() -> list[dict[str, Any]]:
    """Eight cars of which six stop on lap 10, each in 25 s: the race's usual time in the pit lane."""
    rows = race(8)
    for driver in range(2, 8):
        stop(rows, driver, 10)
    return rows


def test_status_codes_are_those_of_the_season_package() -> None:
    assert (track_status.GREEN, track_status.VSC, track_status.SC, track_status.RED) == (GREEN, VSC, SC, RED)


def test_recorded_stops_are_found_and_begin_a_stint() -> None:
    rows = usual_race()
    assert stops_of(rows) == []
    assert stops_of(rows, 5) == [10]
    assert ages_of(rows) == [*range(20)]
    assert ages_of(rows, 5) == [*range(10), *range(10)]


@pytest.mark.parametrize("counted", [False, True], ids=["visit not counted", "visit counted"])
@pytest.mark.parametrize("lane_s", [19.0, 33.0], ids=["as quick as", "queuing"])
def test_a_field_led_through_the_pit_lane_keeps_its_tyres(lane_s: float, counted: bool) -> None:
    """Netherlands 2022, Austria 2023 (quick), Qatar 2024 (queuing): all cars pass behind the safety car, and one of them does stop."""
    rows = usual_race()
    for lap in (14, 15):
        for driver in range(8):
            row(rows, driver, lap)["track_status"] = "4"
            passage(rows, driver, lap, lane_s)
            for later in range(lap + 1, 21):
                row(rows, driver, later)["stint"] += counted
    stop(rows, 1, 15, lane_s=25.0)
    assert stops_of(rows) == []
    assert ages_of(rows) == [*range(20)]
    assert stops_of(rows, 1) == [15]
    assert stops_of(rows, 5) == [10]
    assert ages_of(rows, 5) == [*range(10), *range(10)]


def test_in_laps_and_out_laps_are_passages_with_or_without_new_tyres() -> None:
    rows = usual_race()
    passage(rows, 0, 14, lane_s=19.0)
    laps = with_stint_ages(table(rows)).filter(pl.col("driver") == "D00")
    assert laps.filter("in_lap")["lap"].to_list() == [14]
    assert laps.filter("out_lap")["lap"].to_list() == [15]
    assert laps["stint_number"].unique().to_list() == [1]


def test_a_set_that_the_source_missed_is_a_stop_on_unknown_tyres() -> None:
    """Austria 2022: the car stood as long as all others, but compound, age and stint go on in the record."""
    rows = usual_race()
    passage(rows, 0, 12)
    found = tyre_stops(table(rows)).filter(pl.col("driver") == "D00")
    assert found.select("lap", "compound", "next_compound").rows() == [(12, "S", None)]
    assert ages_of(rows) == [*range(12), *range(8)]
    laps = with_stint_ages(table(rows)).filter(pl.col("driver") == "D00")
    assert laps["compound"].to_list() == ["S"] * 12 + [None] * 8
    assert laps["compound_c"].to_list() == ["C3"] * 12 + [None] * 8


def test_a_set_noted_some_laps_late_was_fitted_at_the_stop() -> None:
    """Hungary 2019: HAM stopped on lap 48, the source has his mediums from lap 50 on."""
    rows = usual_race()
    passage(rows, 0, 12)
    new_set(rows, 0, 15, "M")
    found = tyre_stops(table(rows)).filter(pl.col("driver") == "D00")
    assert found.select("lap", "next_compound").rows() == [(12, "M")]
    assert ages_of(rows) == [*range(12), *range(8)]
    assert with_stint_ages(table(rows)).filter(pl.col("driver") == "D00")["compound"].to_list() == ["S"] * 12 + ["M"] * 8


@pytest.mark.parametrize(
    ("lane_s", "counted", "stopped"),
    [(19.5, False, False), (19.5, True, False), (24.5, True, True), (33.0, True, False), (33.0, False, True)],
    ids=["drive-through", "drive-through counted", "usual time", "stop-and-go", "slow stop not counted"],
)
def test_time_in_the_pit_lane_decides_where_the_record_goes_on(lane_s: float, counted: bool, stopped: bool) -> None:
    rows = usual_race()
    passage(rows, 0, 12, lane_s)
    for lap in range(13, 21):
        row(rows, 0, lap)["stint"] += counted
    assert stops_of(rows) == ([12] if stopped else [])


def test_where_no_time_is_known_the_record_decides() -> None:
    rows = usual_race()
    row(rows, 0, 12)["pit_in_s"] = 1.0  # never came out again
    row(rows, 1, 2)["pit_out_s"] = 1.0  # started from the pit lane
    assert stops_of(rows) == stops_of(rows, 1) == []
    new_set(rows, 0, 13)
    assert stops_of(rows) == [12]


def test_without_a_tyre_record_a_passage_is_a_stop() -> None:
    rows = usual_race()
    for r in rows:
        r.update(compound=None, tyre_life_laps=None)
    passage(rows, 0, 12)
    row(rows, 1, 2)["pit_out_s"] = 1.0
    assert stops_of(rows) == [12]
    assert stops_of(rows, 1) == []


def test_a_change_in_the_record_without_a_passage_is_no_stop_but_under_a_red_flag() -> None:
    rows = usual_race()
    new_set(rows, 0, 13)
    assert stops_of(rows) == []
    row(rows, 0, 12)["track_status"] = "5"
    found = tyre_stops(table(rows)).filter(pl.col("driver") == "D00")
    assert found.select("lap", "red").rows() == [(12, True)]


@pytest.fixture(scope="module")
def laps(real_data: Path) -> pl.DataFrame:
    return read_seasons(real_data / "laps", (2018, 2019, 2021, 2022, 2023, 2024))


def race_of(laps: pl.DataFrame, season: int, number: int) -> pl.DataFrame:
    return laps.filter((pl.col("season") == season) & (pl.col("round") == number))


@pytest.mark.real_data
@pytest.mark.parametrize(
    ("season", "number", "led", "stops"),
    [(2018, 13, (1,), 17), (2021, 3, (2, 3), 22), (2021, 19, (7, 8), 37), (2022, 15, (), 56), (2023, 9, (), 44), (2024, 23, (36, 37), 26)],
    ids=["Belgium 2018", "Portugal 2021", "Brazil 2021", "Netherlands 2022", "Austria 2023", "Qatar 2024"],
)
def test_real_fields_led_through_the_pit_lane(laps: pl.DataFrame, season: int, number: int, led: tuple[int, ...], stops: int) -> None:
    """The pit-stop table of the results less its passages behind the safety car, which it counts as stops."""
    found = tyre_stops(race_of(laps, season, number))
    assert found.height == stops
    assert found.filter(pl.col("lap").is_in(led)).height <= 1


@pytest.mark.real_data
def test_real_cars_led_through_go_on_with_the_age_of_their_tyres(laps: pl.DataFrame) -> None:
    netherlands = with_stint_ages(race_of(laps, 2022, 15)).filter(pl.col("driver") == "ALO")
    assert netherlands.filter(pl.col("lap").is_in([57, 58, 59]))["age_laps"].diff().drop_nulls().to_list() == [1, 1]
    austria = with_stint_ages(race_of(laps, 2023, 9)).filter(pl.col("lap") == 4)
    assert (austria["age_laps"] == 3).sum() >= 18


@pytest.mark.real_data
def test_real_stops_that_the_source_missed(laps: pl.DataFrame) -> None:
    austria = tyre_stops(race_of(laps, 2022, 11))
    assert austria.height == 42  # as in the pit-stop table of the results
    assert austria.filter(pl.col("driver") == "HAM")["lap"].to_list() == [28, 51]
    hungary = tyre_stops(race_of(laps, 2019, 12)).filter(pl.col("driver") == "HAM")
    assert hungary.select("lap", "next_compound").rows() == [(31, "H"), (48, "M")]


@pytest.mark.real_data
def test_real_penalties_are_no_stops(laps: pl.DataFrame) -> None:
    """Drive-throughs (KVY, China 2019) and stop-and-go penalties (VET, Monza 2019; LAT, Azerbaijan 2022)."""
    for season, number, driver, lap in ((2019, 3, "KVY", 7), (2019, 14, "VET", 12), (2022, 8, "LAT", 3)):
        assert lap not in tyre_stops(race_of(laps, season, number)).filter(pl.col("driver") == driver)["lap"].to_list()
