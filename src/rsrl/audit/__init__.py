"""Recorded races audited for their whole field: what calls were worth, and who would have called as the teams did."""

from rsrl.audit.callers import BEST_PLAN, IMITATION
from rsrl.audit.car import TEAM, Settings
from rsrl.audit.field import KnownCar, KnownLap, follow_field, moments
from rsrl.audit.race import RecordedField, audit_race, places_of, recorded_field
from rsrl.audit.season import SeasonRaces, audit_season, season_races

__all__ = [
    "BEST_PLAN",
    "IMITATION",
    "TEAM",
    "KnownCar",
    "KnownLap",
    "RecordedField",
    "SeasonRaces",
    "Settings",
    "audit_race",
    "audit_season",
    "follow_field",
    "moments",
    "places_of",
    "recorded_field",
    "season_races",
]
