"""The audit of one recorded race: the field followed once, then every car."""

import hashlib
from collections.abc import Callable, Collection
from typing import Final, NamedTuple

import polars as pl

from rsrl.audit.car import Settings, audit_car
from rsrl.audit.field import KnownCar, follow_field
from rsrl.errors import RsrlError
from rsrl.explanation import AnyPolicy
from rsrl.feeds.lap_files import lap_events
from rsrl.results import RaceAudit
from rsrl.season import RaceRecord, race_hash

OWN_RACE: Final = "this race among them"
"""What the season file notes on the level of lap times where it was fitted to the race itself too."""

Progress = Callable[[int, int], None]
"""Called with (cars done, cars in all)."""


class RecordedField(NamedTuple):
    """A race to be audited.

    Attributes:
        name: such as `bahrain-2023`.
        table: its lap table (`rsrl.laps.LAP_SCHEMA`).
        drivers: codes of those to be audited.
    """

    name: str
    table: pl.DataFrame
    record: RaceRecord
    drivers: tuple[str, ...]

    def laps_hash(self) -> str:
        """First 16 hex digits of the SHA-256 of the lap table."""
        return hashlib.sha256(self.table.write_csv().encode()).hexdigest()[:16]


def recorded_field(name: str, table: pl.DataFrame, record: RaceRecord, drivers: Collection[str] | None) -> RecordedField:
    """A race with those of `drivers` who started and are in the season file, all of them for None."""
    started = set(table["driver"].unique())
    known = [car.driver for car in record.cars if car.driver in started]
    return RecordedField(name, table, record, tuple(d for d in known if drivers is None or d in drivers))


def audit_race(field: RecordedField, policy: AnyPolicy, settings: Settings, progress: Progress | None = None) -> RaceAudit:
    """Audit the calls of every driver of a race.

    Raises:
        RsrlError: the laps cannot be told as a race, or the race was wet.
    """
    try:
        cars = follow_field(lap_events(field.table), field.record, field.drivers)
    except RsrlError as error:
        raise RsrlError(f"{field.name}: {error}") from None
    places = places_of(field.table)
    audits = []
    for done, known in enumerate(cars):
        if progress:
            progress(done, len(cars))
        audits.append(audit_car(policy, known, field.record, _team(field, known), places.get(known.driver), settings))
    first = field.table.row(0, named=True)
    return RaceAudit(
        race=field.name,
        season=first["season"],
        round=first["round"],
        event=first["event"],
        model=policy.name,
        model_hash=policy.hash,
        race_hash=race_hash(field.record),
        laps_hash=field.laps_hash(),
        rollouts=settings.rollouts,
        seed=settings.seed,
        knows_race=OWN_RACE in field.record.track.base_lap_s.note,
        cars=tuple(audits),
    )


def still_holds(stored: RaceAudit, field: RecordedField, policy: AnyPolicy, settings: Settings) -> bool:
    """Whether a stored audit is of these laps, season file, policy, drivers and settings."""
    drivers = {car.driver for car in stored.cars}
    rests_on = (stored.race, stored.model_hash, stored.race_hash, stored.laps_hash, stored.rollouts, stored.seed)
    asked = (field.name, policy.hash, race_hash(field.record), field.laps_hash(), settings.rollouts, settings.seed)
    return rests_on == asked and drivers == set(field.drivers)


def _team(field: RecordedField, known: KnownCar) -> str:
    return field.record.cars[known.car].team


def places_of(table: pl.DataFrame) -> dict[str, int]:
    """Places of the cars that took the flag: in which they crossed the line on their last lap, those with more laps ahead."""
    last = table.filter(pl.col("position").is_not_null()).sort("lap").group_by("driver").last()
    distance = last["lap"].max()
    order = last.sort(["lap", "position"], descending=[True, False])
    finished = order.filter(pl.col("lap") >= 0.9 * pl.lit(distance))
    return {driver: place for place, driver in enumerate(finished["driver"], 1)}
