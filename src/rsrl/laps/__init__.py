"""The lap table: typed columns with units, readers, cleaning with attrition, tyre stops, stints, gaps, neutralised laps."""

from rsrl.laps.cleaning import BROKEN_RACES, Cleaned, clean
from rsrl.laps.csv_reader import (
    events_of_season,
    file_fingerprint,
    read_lap_csv,
    read_seasons,
    refuse_hardly_run,
    season_file,
    write_lap_csv,
)
from rsrl.laps.fastf1_reader import read_fastf1_session
from rsrl.laps.gaps import with_gaps
from rsrl.laps.schema import CAR, DRY, KEY, LAP_SCHEMA, RACE, WET, check_table
from rsrl.laps.shapes import RaceHead
from rsrl.laps.stints import stints, with_stint_ages
from rsrl.laps.track_status import RED, neutralised_laps, with_status
from rsrl.laps.tyre_stops import tyre_stops, with_tyre_stops

__all__ = [
    "BROKEN_RACES",
    "CAR",
    "DRY",
    "KEY",
    "LAP_SCHEMA",
    "RACE",
    "RED",
    "WET",
    "Cleaned",
    "RaceHead",
    "check_table",
    "clean",
    "events_of_season",
    "file_fingerprint",
    "neutralised_laps",
    "read_fastf1_session",
    "read_lap_csv",
    "read_seasons",
    "refuse_hardly_run",
    "season_file",
    "stints",
    "tyre_stops",
    "with_gaps",
    "with_status",
    "with_stint_ages",
    "with_tyre_stops",
    "write_lap_csv",
]
