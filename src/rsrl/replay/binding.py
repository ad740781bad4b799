"""Which race a source is of, with which season file it is called, and whose car: settled once the field is known."""

from collections.abc import Mapping
from typing import NamedTuple

from rsrl.errors import RsrlError
from rsrl.feeds import Session
from rsrl.replay.stand_in import stand_in
from rsrl.season import RaceRecord, codes_called, find_car, grand_prix_of, load_race, race_names, resolve_race
from rsrl.translators import RaceTracker, TrackedCar

__all__ = ["Asked", "Bound", "DriverNotHeardOfError", "bind", "refuse_other_sessions", "season_asked"]


class Asked(NamedTuple):
    """What was asked for.

    Attributes:
        race: a race's name in any form that `rsrl.season.resolve_race` reads, or a season file; None for what the source says.
        driver: code, number or surname; None for the default driver of the season file.
        season_from: a race or season file whose figures stand for those that are missing.
    """

    race: str | None = None
    driver: str | None = None
    season_from: str | None = None


class Bound(NamedTuple):
    """A race with its season file and the called car's driver code.

    Attributes:
        record: None where the race is tracked without calls; `note` says why.
        note: what there is to say of the season file; None for nothing.
    """

    name: str
    record: RaceRecord | None
    note: str | None
    driver: str


def bind(asked: Asked, tracker: RaceTracker) -> Bound:
    """Settle race, season file and driver.

    Args:
        tracker: has heard of the session and of its cars.

    Raises:
        RsrlError: the race or the driver is unknown, or no driver was named and there is no season file with a default one.
    """
    assert tracker.session is not None
    name = _name(asked, tracker.session)
    record, note = _record(asked, name, tracker)
    driver = _driver(asked.driver, name, record, tracker)
    if record is not None and driver not in {car.driver for car in record.cars}:
        note = f"{driver} is not in the season file of {record.name}: tracked without calls (try --season-from {record.name})"
        record = None
    return Bound(name or "unknown", record, note, driver)


class DriverNotHeardOfError(RsrlError):
    """A driver is not among the cars that a source has told of so far."""


def season_asked(asked: Asked) -> int:
    """Season of the race that was asked for, by which car numbers mean drivers where a source does not say; 0 for unknown."""
    if asked.race is None:
        return 0
    name = load_race(asked.race).name if asked.race.endswith(".toml") else _named(asked.race, race_names()) or asked.race
    season = name.rpartition("-")[2]
    return int(season) if len(season) == 4 and season.isdecimal() else 0


def refuse_other_sessions(session: Session) -> None:
    """Raise RsrlError for a session that is no race."""
    if session.kind not in ("race", "sprint"):
        where = f"{session.event} {session.season}: " if session.event else ""
        raise RsrlError(f"{where}this is a {session.kind} session, in which there is nothing to call; a race or sprint was expected")


def _name(asked: Asked, session: Session) -> str | None:
    """Name of the race; None where neither the source nor anyone else says."""
    known = race_names()
    said = _source_name(session, known)
    if asked.race is None:
        return said
    if asked.race.endswith(".toml"):
        return load_race(asked.race).name
    if said is not None and (meant := _named(asked.race, [said])):
        return meant
    if asked.season_from is not None:
        return _named(asked.race, known) or asked.race
    return resolve_race(asked.race, known)


def _source_name(session: Session, known: list[str]) -> str | None:
    if not session.event:
        return None
    name = f"{grand_prix_of(session.event)}-{session.season}"
    return name if name in known else _named(f"{session.event} {session.season}", known) or name


def _named(text: str, known: list[str]) -> str | None:
    """The race of a name with a season file; None for none. Games name circuits, and most of the races of the past have no file."""
    try:
        return resolve_race(text, known)
    except RsrlError:
        return None


def _record(asked: Asked, name: str | None, tracker: RaceTracker) -> tuple[RaceRecord | None, str | None]:
    """The season file, and what there is to say of it or why there is none."""
    session = tracker.session
    assert session is not None
    if asked.season_from is not None:
        field = [(car.driver, car.team, car.grid) for car in tracker.cars.values()]
        other = load_race(asked.season_from)
        record, note = stand_in(other, name or other.name, session.season, session.event or other.event, tracker.total_laps, field)
        note += "" if tracker.total_laps else f"; so is the distance, {record.laps} laps"
    elif asked.race is not None and asked.race.endswith(".toml"):
        record, note = load_race(asked.race), None
    elif name is None:
        return None, "the source does not say which race it is of: name it with --race; it is tracked without calls"
    elif name not in race_names():
        return None, f"no season file of {name}: the race is tracked without calls (see `rsrl races`, or give one with --season-from)"
    else:
        record, note = load_race(name), None
    if record.wet:
        return None, f"{record.name} was a wet race and there is no wet-weather model: it is tracked without calls"
    return record, note


def _driver(asked: str | None, name: str | None, record: RaceRecord | None, tracker: RaceTracker) -> str:
    """Code of the driver asked for."""
    started, season = _started(tracker.cars), tracker.session.season if tracker.session else 0
    if record is not None and (asked is None or asked.upper() not in started):
        codes = codes_called(asked, started, season) if asked is not None else ()
        return codes[0] if len(codes) == 1 else record.cars[find_car(record, asked)].driver
    if asked is None:
        raise RsrlError(f"{name or 'the race'} has no season file, which would name a driver; name one with --driver: {_list(started)}")
    codes = codes_called(asked, started, season)
    if len(codes) != 1:
        found = f"may be {' or '.join(codes)}" if codes else "did not start"
        raise DriverNotHeardOfError(f"driver {asked!r} {found} at {name or 'this race'}; who did: {_list(started)}")
    return codes[0]


def _started(cars: Mapping[int, TrackedCar]) -> list[str]:
    return sorted(car.driver for car in cars.values())


def _list(drivers: list[str]) -> str:
    return ", ".join(drivers)
