"""Reading lap files: what comes in typed, and what is refused by name."""

import gzip
from pathlib import Path

import polars as pl
import pytest

from rsrl.errors import RsrlError
from rsrl.laps import LAP_SCHEMA, read_lap_csv, read_seasons, refuse_hardly_run

HEADER = (
    "season,round,event,driver,team,lap,lap_time_s,compound,tyre_life,stint,position,track_status,pit_in,pit_out,"
    "session_time_s,driver_number,fresh_tyre,is_accurate,source,lap_time_source,compound_c"
)
ROWS = [
    "2023,1,Bahrain Grand Prix,HAM,Mercedes,1,101.2,SOFT,4,1,7,1,,1560.8,3863.4,44,False,True,x,timing,C3",
    "2023,1,Bahrain Grand Prix,HAM,Mercedes,2,,SOFT,5.0,1,7,26,3965.0,,3964.4,44,False,True,x,,C3",
    "2023,1,Bahrain Grand Prix,HAM,Mercedes,3,99.2,INTER,1,2,7,1,,3990.1,4063.4,44,True,True,x,timing,",
]


def write(folder: Path, rows: list[str], header: str = HEADER) -> Path:
    path = folder / "laps_2023.csv.gz"
    path.write_bytes(gzip.compress("\n".join([header, *rows]).encode()))
    return path


def test_file_becomes_the_declared_table(tmp_path: Path) -> None:
    laps = read_lap_csv(write(tmp_path, ROWS))
    assert dict(laps.schema) == LAP_SCHEMA
    assert laps["compound"].to_list() == ["S", "S", "I"]
    assert laps["lap_time_s"].to_list() == [101.2, None, 99.2]
    assert laps["fresh_tyre"].to_list() == [False, False, True]
    assert laps["track_status"].to_list() == ["1", "26", "1"]
    assert laps["pit_in_s"][1] == 3965.0


def test_uncompressed_file_reads_the_same(tmp_path: Path) -> None:
    plain = tmp_path / "laps.csv"
    plain.write_text("\n".join([HEADER, *ROWS]))
    assert read_lap_csv(plain).equals(read_lap_csv(write(tmp_path, ROWS)))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("101.2", "fast", ["row 2", "lap_time_s", "'fast'", "not a number"]),
        ("101.2", "-3", ["row 2", "lap_time_s", "negative"]),
        ("SOFT,4", "PURPLE,4", ["row 2", "compound", "'PURPLE'", "SOFT"]),
        ("Mercedes,1,", "Mercedes,1.5,", ["row 2", "column lap", "'1.5'", "whole number"]),
        ("Mercedes,1,", "Mercedes,0,", ["row 2", "lap", "below 1"]),
        ("Mercedes,1,", "Mercedes,,", ["row 2", "lap", "blank"]),
        ("Mercedes,1,", "Mercedes,999,", ["row 2", "column lap", "999", "beyond 100"]),
        ("101.2", "10000", ["row 2", "lap_time_s", "longer than any race"]),
        ("3863.4,", "-3863.4,", ["row 2", "session_time_s", "negative"]),
        (",C3", ",C9", ["row 2", "compound_c", "'C9'", "C0 to C6"]),
        ("44,False", "44,perhaps", ["row 2", "fresh_tyre", "'perhaps'", "True or False"]),
    ],
)
def test_bad_value_is_named_with_row_and_column(tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    path = write(tmp_path, [ROWS[0].replace(old, new, 1), *ROWS[1:]])
    with pytest.raises(RsrlError) as error:
        read_lap_csv(path)
    assert all(word in str(error.value) for word in [path.name, *words])
    assert "\n" not in str(error.value)


def test_same_lap_twice_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RsrlError, match="HAM has lap 3 of round 1 more than once"):
        read_lap_csv(write(tmp_path, [*ROWS, ROWS[2]]))


def test_one_lap_of_no_time_is_a_lap_without_a_time_and_more_are_refused(tmp_path: Path) -> None:
    assert read_lap_csv(write(tmp_path, [ROWS[0].replace("101.2", "0.0"), *ROWS[1:]]))["lap_time_s"].to_list() == [None, None, 99.2]
    with pytest.raises(RsrlError, match=r"row 2, column lap_time_s: 0\.0 is zero; leave it blank"):
        read_lap_csv(write(tmp_path, [ROWS[0].replace("101.2", "0.0"), ROWS[1], ROWS[2].replace("99.2", "0")]))


def test_rows_may_come_in_any_order(tmp_path: Path) -> None:
    assert read_lap_csv(write(tmp_path, ROWS[::-1])).equals(read_lap_csv(write(tmp_path, ROWS)))


def test_a_season_in_the_file_of_another_is_refused(tmp_path: Path) -> None:
    write(tmp_path, [*ROWS, ROWS[0].replace("2023,1", "2022,1")])
    with pytest.raises(
        RsrlError, match=r"laps_2023\.csv\.gz: row 5, column season: 2022 in the file of 2023; keep one season in each file"
    ):
        read_seasons(tmp_path, (2023,))


def test_a_race_of_three_laps_is_refused_where_whole_ones_are_needed(tmp_path: Path) -> None:
    write(tmp_path, ROWS)
    table = read_seasons(tmp_path, (2023,))
    with pytest.raises(
        RsrlError, match=r"laps_2023\.csv\.gz: row 2: round 1 \(Bahrain Grand Prix\) ends after lap 3, with 3 rows; give the whole race"
    ):
        refuse_hardly_run(table, tmp_path)


def test_missing_column_is_named(tmp_path: Path) -> None:
    with pytest.raises(RsrlError, match="tyre_life is missing"):
        read_lap_csv(write(tmp_path, ROWS, HEADER.replace("tyre_life", "tyre_age")))


def test_missing_file_and_no_season_are_refused(tmp_path: Path) -> None:
    with pytest.raises(RsrlError, match=r"laps_2019\.csv\.gz: cannot be read.*--laps"):
        read_seasons(tmp_path, (2019,))
    with pytest.raises(RsrlError, match="no season given"):
        read_seasons(tmp_path, ())


def test_truncated_foreign_and_empty_files_are_refused(tmp_path: Path) -> None:
    path = write(tmp_path, ROWS * 50)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(RsrlError, match="no whole gzip file"):
        read_lap_csv(path)
    path.write_bytes(b"not gzip at all")
    with pytest.raises(RsrlError, match="no whole gzip file"):
        read_lap_csv(path)
    path.write_bytes(gzip.compress(b"  \n"))
    with pytest.raises(RsrlError, match="is empty"):
        read_lap_csv(path)
    with pytest.raises(RsrlError, match="holds no laps"):
        read_lap_csv(write(tmp_path, []))


@pytest.mark.real_data
def test_bahrain_2023_is_as_published(real_data: Path) -> None:
    laps = read_lap_csv(real_data / "laps" / "laps_2023.csv.gz").filter(pl.col("round") == 1)
    winner = laps.filter(pl.col("driver") == "VER")
    assert winner.height == 57
    assert winner.filter(pl.col("pit_in_s").is_not_null())["lap"].to_list() == [14, 36]
