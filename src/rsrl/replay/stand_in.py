"""The season file of another race in place of one that is missing: its track, tyres and incidents, its cars under other drivers."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

from rsrl.errors import RsrlError
from rsrl.season import CarFigures, RaceRecord
from rsrl.simulator import Plan

__all__ = ["StandIn", "stand_in"]


class StandIn(NamedTuple):
    """The record, and in words whose figures stand for whose."""

    record: RaceRecord
    note: str


class _Starter(NamedTuple):
    driver: str
    team: str | None
    grid: int | None


def stand_in(
    record: RaceRecord, name: str, season: int, event: str, laps: int | None, field: Iterable[tuple[str, str | None, int | None]]
) -> StandIn:
    """The record of a race from another one's.

    Args:
        record: of the other race.
        name, season, event: of the race.
        laps: its distance; None for the other's.
        field: driver code, team and grid place of its cars. A driver of the other race has their own figures, another driver of a team
            those of a car of it; whoever is left has those of the car in the middle of the field by pace.

    Raises:
        RsrlError: the field is too small, or too long a race for any plan of the record's rivals.
    """
    distance = laps or record.laps
    starters = sorted((_Starter(*one) for one in field), key=lambda s: s.grid or len(record.cars) + 1)
    if len(starters) < 2:
        raise RsrlError(f"{name}: of {len(starters)} cars the source has told so far, and a race has two at least")
    own = {car.driver: car for car in record.cars}
    middle = sorted(record.cars, key=lambda car: car.pace_s.value)[len(record.cars) // 2]
    teams: list[str] = []
    others: list[str] = []
    cars = []
    for place, starter in enumerate(starters, 1):
        figures = own.get(starter.driver)
        if figures is None:
            figures = _of_team(record.cars, starter.team)
            (others if figures is None else teams).append(starter.driver)
        cars.append(replace(figures or middle, driver=starter.driver, team=starter.team or (figures or middle).team, grid=place))
    plans = tuple(plan for plan in record.rivals.plans if _last_stop(plan.plan, record) < distance)
    if not plans:
        raise RsrlError(f"{name}: no plan of {record.name} fits a race of {distance} laps; name another season file with --season-from")
    published = tuple(plan for plan in record.published if _last_stop(plan, record) < distance)
    default = record.default_driver if record.default_driver in {s.driver for s in starters} else starters[0].driver
    changed = replace(
        record, name=name, season=season or record.season, event=event, laps=distance, cars=tuple(cars), default_driver=default,
        rivals=replace(record.rivals, plans=plans), published=published,
    )  # fmt: skip
    return StandIn(changed, _note(record.name, teams, others))


def _of_team(cars: Sequence[CarFigures], team: str | None) -> CarFigures | None:
    return next((car for car in cars if team is not None and car.team.casefold() == team.casefold()), None)


def _last_stop(plan: str, record: RaceRecord) -> int:
    return max(Plan.parse(plan, record).laps, default=0)


def _note(name: str, teams: Sequence[str], others: Sequence[str]) -> str:
    notes = [f"the figures are those of {name}"]
    if teams:
        notes.append(f"{', '.join(teams)} with those of a car of the team")
    if others:
        notes.append(f"{', '.join(others)} with those of the car in the middle of the field")
    return "; ".join(notes)
