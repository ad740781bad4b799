"""Typed, frozen records of fitted figures, and their TOML files with provenance."""

from rsrl.season.library import find_car, load_race, race_names, shipped_folder
from rsrl.season.records import (
    CarFigures,
    Figure,
    IncidentFigures,
    PitFigures,
    Provenance,
    RaceRecord,
    RivalFigures,
    RivalPlan,
    TrackFigures,
    TyreFigures,
)
from rsrl.season.toml_io import race_hash, read_race, write_race
from rsrl.season.vocabulary import (
    COMPOUND_NAMES,
    COMPOUNDS,
    EVENT_SLUGS,
    FIELD_SIZE,
    GRAND_PRIX,
    GREEN,
    POINTS,
    SC,
    TRACK_STATUS_NAMES,
    VSC,
)

__all__ = [
    "COMPOUNDS",
    "COMPOUND_NAMES",
    "EVENT_SLUGS",
    "FIELD_SIZE",
    "GRAND_PRIX",
    "GREEN",
    "POINTS",
    "SC",
    "TRACK_STATUS_NAMES",
    "VSC",
    "CarFigures",
    "Figure",
    "IncidentFigures",
    "PitFigures",
    "Provenance",
    "RaceRecord",
    "RivalFigures",
    "RivalPlan",
    "TrackFigures",
    "TyreFigures",
    "find_car",
    "load_race",
    "race_hash",
    "race_names",
    "read_race",
    "shipped_folder",
    "write_race",
]
