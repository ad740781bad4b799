"""Lap files as people have them: FastF1's `to_csv`, OpenF1's columns, semicolons, plain files, Parquet, the lap table's own names."""

from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from invented_laps import race, table
from test_laps_fastf1 import Frame, session

from rsrl.errors import RsrlError
from rsrl.laps import RaceHead, read_fastf1_session, read_lap_csv, season_file, write_lap_csv

HEAD = RaceHead(2023, 1, "Test Grand Prix")
NAMES = {"S": "SOFT", "M": "MEDIUM", "H": "HARD"}
FASTF1 = {
    "driver": "Driver", "team": "Team", "lap": "LapNumber", "lap_time_s": "LapTime", "compound": "Compound", "tyre_life_laps": "TyreLife",
    "stint": "Stint", "position": "Position", "track_status": "TrackStatus", "pit_in_s": "PitInTime", "pit_out_s": "PitOutTime",
    "session_time_s": "Time", "fresh_tyre": "FreshTyre",
}  # fmt: skip
SPANS = ("LapTime", "PitInTime", "PitOutTime", "Time")
START = datetime(2023, 3, 5, 15, 3, 12, tzinfo=UTC)


def laps() -> pl.DataFrame:
    """Three cars, 12 laps; D01 stops at the end of lap 5."""
    rows = race(drivers=3, laps=12)
    own = [row for row in rows if row["driver"] == "D01"]
    own[4]["pit_in_s"], own[5]["pit_out_s"] = own[4]["session_time_s"] - 3.0, own[4]["session_time_s"] + 18.0
    for lap, row in enumerate(own[5:]):
        row.update(compound="H", stint=2, tyre_life_laps=float(1 + lap), fresh_tyre=True)
    return table(rows)


def as_pandas_writes(seconds: float | None) -> str | None:
    """A time span as a frame of pandas has it in its `to_csv`."""
    if seconds is None:
        return None
    whole, micro = divmod(round(seconds * 1e6), 1_000_000)
    return f"0 days {whole // 3600:02d}:{whole // 60 % 60:02d}:{whole % 60:02d}.{micro:06d}"


def fastf1(laps: pl.DataFrame) -> pl.DataFrame:
    found = laps.select(*FASTF1).rename(FASTF1).with_columns(pl.col("Compound").replace(NAMES), pl.col("LapNumber").cast(pl.Float64))
    spans = {name: pl.Series([as_pandas_writes(value) for value in found[name]], dtype=pl.String) for name in SPANS}
    dates = [str(START + timedelta(seconds=value)) for value in laps["session_time_s"]]
    return found.with_columns(**spans, LapStartDate=pl.Series(dates)).with_row_index("")


def alike(found: pl.DataFrame, wanted: pl.DataFrame, without: tuple[str, ...] = ()) -> bool:
    kept = [name for name in wanted.columns if name not in without]
    return found.select(kept).equals(wanted.select(kept))


def test_fastf1_written_by_pandas_is_the_lap_table(tmp_path: Path) -> None:
    wanted = laps()
    fastf1(wanted).write_csv(tmp_path / "laps.csv")
    found = read_lap_csv(tmp_path / "laps.csv", HEAD)
    assert alike(found, wanted, ("compound_c", "lap_time_source"))
    assert found["lap_time_source"].drop_nulls().unique().to_list() == ["timing"]


def test_without_the_race_the_missing_columns_are_named(tmp_path: Path) -> None:
    fastf1(laps()).write_csv(tmp_path / "laps.csv")
    with pytest.raises(RsrlError, match=r"laps.csv: column round, event is missing"):
        read_lap_csv(tmp_path / "laps.csv")
    fastf1(laps()).drop("TrackStatus", "Team").write_csv(tmp_path / "laps.csv")
    with pytest.raises(RsrlError, match=r"column team, track_status is missing"):
        read_lap_csv(tmp_path / "laps.csv", HEAD)


def test_semicolons_decimal_commas_tabs_and_parquet(tmp_path: Path) -> None:
    wanted = laps()
    write_lap_csv(wanted, tmp_path / "plain.csv")
    text = pl.read_csv(tmp_path / "plain.csv", infer_schema=False)
    text.with_columns(pl.all().str.replace(r"^(\d+)\.(\d+)$", "$1,$2")).write_csv(tmp_path / "semicolons.csv", separator=";")
    text.write_csv(tmp_path / "tabs.csv", separator="\t")
    text.write_parquet(tmp_path / "laps.parquet")
    own = fastf1(wanted).with_columns(
        (pl.from_epoch((pl.Series(wanted[name]) * 1e6).cast(pl.Int64), time_unit="us") - pl.datetime(1970, 1, 1)).alias(FASTF1[name])
        for name in ("lap_time_s", "pit_in_s", "pit_out_s", "session_time_s")
    )
    own.write_parquet(tmp_path / "fastf1.parquet")
    assert own.schema["LapTime"] == pl.Duration("us")
    for name in ("plain.csv", "semicolons.csv", "tabs.csv", "laps.parquet"):
        assert read_lap_csv(tmp_path / name).equals(wanted), name
    assert alike(read_lap_csv(tmp_path / "fastf1.parquet", HEAD), wanted, ("compound_c", "lap_time_source"))


def test_what_a_session_gives_can_be_written_and_read(tmp_path: Path) -> None:
    made = read_fastf1_session(Frame(session()), 2023, 1, "Bahrain Grand Prix", {"S": "C3", "M": "C2", "H": "C1"})
    made.write_csv(tmp_path / "polars.csv")  # with the table's own names
    write_lap_csv(made, tmp_path / "laps_2023.csv.gz")
    assert read_lap_csv(tmp_path / "laps_2023.csv.gz").equals(made)
    assert alike(read_lap_csv(tmp_path / "polars.csv"), made)
    assert season_file(tmp_path, 2023).name == "laps_2023.csv.gz"
    assert season_file(tmp_path, 2024).name == "laps_2024.csv.gz"
    (tmp_path / "laps_2024.csv").write_text("x")
    assert season_file(tmp_path, 2024).name == "laps_2024.csv"


def openf1(laps: pl.DataFrame) -> pl.DataFrame:
    rows: list[dict[str, Any]] = []
    for row in laps.iter_rows(named=True):
        out = row["pit_out_s"] is not None
        began = START + timedelta(seconds=row["session_time_s"] - row["lap_time_s"])
        rows.append(
            {
                "driver_number": int(row["driver"][1:]) + 1, "name_acronym": row["driver"], "team_name": row["team"],
                "lap_number": row["lap"], "lap_duration": row["lap_time_s"], "date_start": began.isoformat(), "is_pit_out_lap": out,
                "lane_duration": 21.0 if out else None, "stint_number": row["stint"], "compound": NAMES[row["compound"]],
                "tyre_age_at_start": 0 if row["stint"] == 2 else int(row["tyre_life_laps"]) - row["lap"], "track_status": "1",
            }
        )  # fmt: skip
    return pl.DataFrame(rows)


def test_openf1_laps_with_stints_and_stops(tmp_path: Path) -> None:
    wanted = laps()
    openf1(wanted).write_csv(tmp_path / "openf1.csv")
    found = read_lap_csv(tmp_path / "openf1.csv", HEAD)
    first_s = (wanted["session_time_s"] - wanted["lap_time_s"]).min()
    assert first_s is not None
    shifted = wanted.with_columns((pl.col("session_time_s") - first_s).round(3))
    assert alike(found, shifted, ("compound_c", "lap_time_source", "fresh_tyre", "pit_in_s", "pit_out_s", "position"))
    stop = found.filter((pl.col("driver") == "D01") & pl.col("pit_in_s").is_not_null())
    assert stop["lap"].to_list() == [5]
    assert stop["pit_in_s"].to_list() == stop["session_time_s"].to_list()
    out = found.filter((pl.col("driver") == "D01") & pl.col("pit_out_s").is_not_null())
    assert (out["lap"].to_list(), out["pit_out_s"][0] - stop["pit_in_s"][0]) == ([6], 21.0)
    order = found.filter(pl.col("lap") == 12).sort("session_time_s")
    assert order["position"].to_list() == [1, 2, 3]


@pytest.mark.parametrize("missing", ["position", "stint", "lap_time_s", "fresh_tyre", "compound_c", "lap_time_source", "round"])
def test_what_follows_from_other_columns_is_derived(tmp_path: Path, missing: str) -> None:
    wanted = laps()
    write_lap_csv(wanted, tmp_path / "whole.csv")
    pl.read_csv(tmp_path / "whole.csv", infer_schema=False).drop(missing).write_csv(tmp_path / "laps.csv")
    found = read_lap_csv(tmp_path / "laps.csv")
    assert alike(found, wanted, (missing,))
    if missing == "lap_time_s":
        assert found.filter(pl.col("lap") > 1)[missing].to_list() == pytest.approx(wanted.filter(pl.col("lap") > 1)[missing].to_list())
    elif missing in ("position", "stint", "round"):
        assert found[missing].null_count() == 0
    if missing == "stint":
        assert alike(found, wanted)


def test_crossings_are_sums_of_lap_times_where_all_are_known(tmp_path: Path) -> None:
    wanted = laps()
    write_lap_csv(wanted, tmp_path / "whole.csv")
    text = pl.read_csv(tmp_path / "whole.csv", infer_schema=False).drop("session_time_s")
    text.write_csv(tmp_path / "laps.csv")
    summed = wanted.select(pl.col("lap_time_s").cum_sum().over("driver"))
    assert read_lap_csv(tmp_path / "laps.csv")["session_time_s"].to_list() == pytest.approx(summed["lap_time_s"].to_list())
    text.with_columns(lap_time_s=pl.when(pl.col("lap") != "3").then("lap_time_s")).write_csv(tmp_path / "laps.csv")
    with pytest.raises(RsrlError, match="column session_time_s is missing"):
        read_lap_csv(tmp_path / "laps.csv")
