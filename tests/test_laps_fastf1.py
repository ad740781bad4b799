"""Reading a FastF1 session without FastF1: any frame with its columns will do."""

from datetime import timedelta
from typing import Any

import pytest

from rsrl.errors import RsrlError
from rsrl.laps import LAP_SCHEMA, read_fastf1_session


class Frame:
    """What a pandas frame offers of its columns."""

    def __init__(self, data: dict[str, list[Any]]) -> None:
        self.data = data
        self.columns = list(data)

    def to_dict(self, orient: str) -> dict[str, list[Any]]:
        assert orient == "list"
        return self.data


NAN = float("nan")


def session() -> dict[str, list[Any]]:
    return {
        "Time": [timedelta(seconds=3700), timedelta(seconds=3800.25)],
        "Driver": ["HAM", "HAM"],
        "DriverNumber": ["44", "44"],
        "LapTime": [None, timedelta(minutes=1, seconds=40.25)],
        "LapNumber": [1.0, 2.0],
        "Stint": [1.0, 1.0],
        "PitOutTime": [timedelta(seconds=1500), None],
        "PitInTime": [None, timedelta(seconds=3799)],
        "Compound": ["SOFT", "nan"],
        "TyreLife": [4.0, NAN],
        "FreshTyre": [False, True],
        "Team": ["Mercedes", "Mercedes"],
        "LapStartTime": [None, timedelta(seconds=3700)],
        "TrackStatus": ["12", "1"],
        "Position": [7.0, NAN],
        "IsAccurate": [False, True],
    }


def test_session_becomes_the_lap_table() -> None:
    laps = read_fastf1_session(Frame(session()), 2023, 1, "Bahrain Grand Prix", {"S": "C3", "M": "C2", "H": "C1"})
    assert dict(laps.schema) == LAP_SCHEMA
    first, second = laps.iter_rows(named=True)
    assert (first["compound"], first["compound_c"], first["tyre_life_laps"], first["lap_time_s"]) == ("S", "C3", 4.0, None)
    assert (second["compound"], second["compound_c"], second["position"], second["lap_time_s"]) == (None, None, None, 100.25)
    assert second["pit_in_s"] == 3799.0
    assert first["lap_time_source"] is None


def test_missing_column_and_wrong_value_are_named() -> None:
    broken = session()
    del broken["TyreLife"]
    with pytest.raises(RsrlError, match=r"2023 round 1: column TyreLife is missing"):
        read_fastf1_session(Frame(broken), 2023, 1, "Bahrain Grand Prix")
    broken = session() | {"LapTime": [None, "1:40.25"]}
    with pytest.raises(RsrlError, match=r"row 1, column LapTime: '1:40.25' is not a time span"):
        read_fastf1_session(Frame(broken), 2023, 1, "Bahrain Grand Prix")
    broken = session() | {"Compound": ["SOFT", "HYPERSOFT"]}
    with pytest.raises(RsrlError, match=r"row 1, column compound: unknown compound 'HYPERSOFT'"):
        read_fastf1_session(Frame(broken), 2023, 1, "Bahrain Grand Prix")
