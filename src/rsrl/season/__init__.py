"""Typed, frozen records of the fitted figures of a race, and their TOML files with provenance."""

from rsrl.season.assumptions import ASSUMPTIONS, assume, parse_sets
from rsrl.season.circuits import circuit_of, grand_prix_of, track_code
from rsrl.season.compound_words import c_numbers, read_compound
from rsrl.season.drivers import codes_called
from rsrl.season.groups import GROUPS, STUDY_TRACKS, UNSEEN_TRACKS, group_races, held_out_races, study_races, track_of
from rsrl.season.library import RaceHead, find_car, load_race, race_heads, race_names, shipped_folder
from rsrl.season.perturbation import perturbed
from rsrl.season.race_resolver import resolve_race
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
from rsrl.season.rival_features import CHOICE_FEATURES, HAZARD_FEATURES, LIFE_NAMES
from rsrl.season.toml_io import race_hash, read_race, write_race
from rsrl.season.tyre_sets import MAX_LAPS_BEFORE, TyreSets, read_sets, write_sets
from rsrl.season.vocabulary import (
    COMPOUND_NAMES,
    COMPOUNDS,
    FEWEST_SETS,
    FIELD_SIZE,
    FOLLOWING_AIDS,
    GRAND_PRIX,
    GREEN,
    MAX_CARS,
    POINTS,
    RED,
    SC,
    TRACK_STATUS_NAMES,
    VSC,
)

__all__ = [
    "ASSUMPTIONS",
    "CHOICE_FEATURES",
    "COMPOUNDS",
    "COMPOUND_NAMES",
    "FEWEST_SETS",
    "FIELD_SIZE",
    "FOLLOWING_AIDS",
    "GRAND_PRIX",
    "GREEN",
    "GROUPS",
    "HAZARD_FEATURES",
    "LIFE_NAMES",
    "MAX_CARS",
    "MAX_LAPS_BEFORE",
    "POINTS",
    "RED",
    "SC",
    "STUDY_TRACKS",
    "TRACK_STATUS_NAMES",
    "UNSEEN_TRACKS",
    "VSC",
    "CarFigures",
    "Figure",
    "IncidentFigures",
    "PitFigures",
    "Provenance",
    "RaceHead",
    "RaceRecord",
    "RivalFigures",
    "RivalPlan",
    "TrackFigures",
    "TyreFigures",
    "TyreSets",
    "assume",
    "c_numbers",
    "circuit_of",
    "codes_called",
    "find_car",
    "grand_prix_of",
    "group_races",
    "held_out_races",
    "load_race",
    "parse_sets",
    "perturbed",
    "race_hash",
    "race_heads",
    "race_names",
    "read_compound",
    "read_race",
    "read_sets",
    "resolve_race",
    "shipped_folder",
    "study_races",
    "track_code",
    "track_of",
    "write_race",
    "write_sets",
]
