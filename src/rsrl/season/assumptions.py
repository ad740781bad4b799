"""Assumptions of a race changed one by one, such as `pit_loss_s=+1` or `wear.S=x1.2`, without a season file of one's own.

An absolute value is taken as known: its standard error is 0. A figure that is shifted keeps its standard error, one that is multiplied
keeps its relative error.
"""

import math
import re
from collections.abc import Iterable
from dataclasses import replace
from typing import Any, Final, NamedTuple

from rsrl.errors import RsrlError
from rsrl.season.bounds import bounds_of
from rsrl.season.compound_words import c_numbers, read_compound
from rsrl.season.library import find_car
from rsrl.season.records import CarFigures, Figure, IncidentFigures, RaceRecord
from rsrl.season.tyre_sets import MAX_SETS, SETS_FORM, TyreSets, impossible_sets, read_sets
from rsrl.season.vocabulary import COMPOUNDS

ASSUMPTIONS: Final = {
    "pit_loss_s": "time lost by a stop on a racing lap; stops under safety cars keep their share of it",
    "pit_loss_vsc_s": "time lost by a stop under a virtual safety car",
    "pit_loss_sc_s": "time lost by a stop under a safety car",
    "wear.TYRE": "lap time lost for each lap of a tyre's age, s",
    "offset.TYRE": "lap time of the new tyre against the new medium, s",
    "sets.TYRE": "sets that each car has for the race",
    "sets.DRIVER": "a car's own sets, such as S2M1H2, or S1S2u3M1H2 where two softs have run 3 laps",
    "pace.DRIVER": "lap time against the average car's, s; below zero is quicker",
    "grid.DRIVER": "place on the grid; the cars between move by one",
    "pass_threshold_s": "lap time advantage at which half the attempts to pass succeed",
    "sc_chance": "probability of a safety car at some time in the race",
    "vsc_chance": "probability of a virtual safety car at some time in the race",
    "fuel_s_per_kg": "lap time for each kg of fuel on board, s",
}
"""What can be assumed and what it means; TYRE is a compound, DRIVER a driver who started."""

_FIELDS: Final = {
    "pit_loss_vsc_s": ("pit", "loss_vsc_s"),
    "pit_loss_sc_s": ("pit", "loss_sc_s"),
    "pass_threshold_s": ("track", "pass_threshold_s"),
    "fuel_s_per_kg": ("track", "fuel_s_per_kg"),
}
_TYRE_FIELDS: Final = {"wear": "wear_s_per_lap", "offset": "offset_s"}
_NUMBER: Final = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)")
ALL_CARS: Final = "all"


class Assumption(NamedTuple):
    """One assumption as it was written: `text`, its name, the compound or driver it is of, and how the figure changes.

    `change` is `=` for an absolute value, `+` for a shift by `amount`, which may be negative, `x` for a factor.
    """

    text: str
    name: str
    of: str
    change: str
    amount: float

    def applied(self, value: float) -> float:
        """The changed value of a figure."""
        return {"=": self.amount, "+": value + self.amount, "x": value * self.amount}[self.change]


def parse_assumption(text: str) -> Assumption:
    """Read `NAME=VALUE`: `20` absolute, `+1` or `-1` relative, `x1.2` a factor, `=-0.5` absolute though negative.

    Raises:
        RsrlError: the name is unknown or the value does not parse.
    """
    left, sign, value = (part.strip() for part in text.partition("="))
    name, _, of = (part.strip() for part in left.partition("."))
    kinds = {key.partition(".")[0]: key.partition(".")[2] for key in ASSUMPTIONS}
    if name.casefold() not in kinds or bool(kinds[name.casefold()]) != bool(of):
        raise RsrlError(f"--set {text}: unknown name {left!r}; names are {', '.join(ASSUMPTIONS)}")
    absolute, factor = value.startswith("="), value[:1] in ("x", "X", "*")
    number = value[1:].strip() if absolute or factor else value
    if not sign or not _NUMBER.fullmatch(number) or not math.isfinite(float(number)) or (factor and number[0] in "+-"):
        raise RsrlError(f"--set {text}: write NAME=20 for a value, NAME=+1 or NAME=-1 for a shift, NAME=x1.2 for a factor")
    change = "x" if factor else "+" if number[0] in "+-" and not absolute else "="
    return Assumption(text.strip(), name.casefold(), of, change, float(number))


def parse_sets(texts: str | Iterable[str]) -> tuple[str, ...]:
    """Assumptions for sets as `--sets` takes them: `S3M2H2` for all cars (also `ALL=S3M2H2`), `HAM=S1M2H2` for one driver's.

    Those of all cars come first, so that a driver's own sets stand whatever the order.

    Raises:
        RsrlError: a text does not parse.
    """
    every: list[str] = []
    own: list[str] = []
    for text in (texts,) if isinstance(texts, str) else texts:
        who, _, written = (part.strip() for part in text.rpartition("="))
        sets = read_sets(written)
        if sets is None or ("=" in text and not who):
            raise RsrlError(f"--sets {text}: write the sets of all three compounds, such as {SETS_FORM}, for one driver HAM=S2M1H2")
        if who and who.casefold() != ALL_CARS:
            own.append(f"sets.{who}={written}")
        elif any(any(laps) for laps in sets.values()):
            every.append(f"sets.{ALL_CARS}={written}")
        else:
            every += [f"sets.{compound}={len(laps)}" for compound, laps in sets.items()]
    return (*every, *own)


def assume(record: RaceRecord, changes: str | Iterable[str]) -> RaceRecord:
    """The record with assumptions changed, in the order given.

    Args:
        record: a race.
        changes: one or several, such as `pit_loss_s=+1`, `wear.S=x1.2`, `grid.HAM=3`; `ASSUMPTIONS` lists the names.

    Raises:
        RsrlError: a name, compound or driver is unknown, a value does not parse or is outside the range of `season.bounds`.
    """
    for text in (changes,) if isinstance(changes, str) else changes:
        own = _own_sets(text)
        record = _with_own_sets(record, text, *own) if own else _assumed(record, parse_assumption(text))
    return record


def _own_sets(text: str) -> tuple[str, TyreSets] | None:
    """Driver, or `ALL_CARS`, and sets of an assumption such as `sets.HAM=S2M1H2`; None where it is another."""
    name, _, written = (part.strip() for part in text.partition("="))
    table, _, who = (part.strip() for part in name.partition("."))
    sets = read_sets(written) if table.casefold() == "sets" and who else None
    return None if sets is None else (who, sets)


def _assumed(record: RaceRecord, a: Assumption) -> RaceRecord:
    if a.name == "grid":
        return replace(record, cars=_regridded(record, a))
    if a.name == "pace":
        car = record.cars[find_car(record, a.of)]
        moved = replace(car, pace_s=_figure(car.pace_s, "pace_s", a))
        return replace(record, cars=tuple(moved if other is car else other for other in record.cars))
    if a.name == "sets":
        return _with_sets(record, a)
    if a.name in _TYRE_FIELDS:
        compound, key = _compound(record, a), _TYRE_FIELDS[a.name]
        changed: dict[str, Any] = {key: _figure(getattr(record.tyres[compound], key), key, a)}
        return replace(record, tyres={**record.tyres, compound: replace(record.tyres[compound], **changed)})
    if a.name in ("sc_chance", "vsc_chance"):
        return replace(record, incidents=_incidents(record, a))
    if a.name == "pit_loss_s":
        return _with_pit_loss(record, a)
    part, key = _FIELDS[a.name]
    changed = {key: _figure(getattr(getattr(record, part), key), key, a)}
    table: dict[str, Any] = {part: replace(getattr(record, part), **changed)}
    return replace(record, **table)


def _figure(figure: Figure, key: str, a: Assumption) -> Figure:
    """A figure changed as assumed; raises RsrlError where it leaves its range."""
    value = a.applied(figure.value)
    _check(value, key, a)
    se = {"=": 0.0, "+": figure.se, "x": figure.se * a.amount}[a.change]
    return Figure(value, se, 0, f"assumed: {a.text}, fitted: {figure.value:.6g}")


def _check(value: float, key: str, a: Assumption) -> None:
    low, high = bounds_of(key)
    if not low <= value <= high:
        raise RsrlError(f"--set {a.text}: {key} would be {value:g}, outside the believable range {low:g} to {high:g}")


def _with_pit_loss(record: RaceRecord, a: Assumption) -> RaceRecord:
    """The loss of a stop on a racing lap changed, and those under safety cars by the same factor."""
    pit = record.pit
    green = _figure(pit.loss_green_s, "loss_green_s", a)
    same = a._replace(change="x", amount=green.value / pit.loss_green_s.value)
    slow: dict[str, Any] = {key: _figure(getattr(pit, key), key, same) for key in ("loss_vsc_s", "loss_sc_s")}
    return replace(record, pit=replace(pit, loss_green_s=green, **slow))


def _incidents(record: RaceRecord, a: Assumption) -> IncidentFigures:
    """Hazards that give a chance in the race: with q the chance of none, all of them change by the power log q' / log q of theirs."""
    incidents, later = record.incidents, record.laps - 1
    keys = ("sc_lap1", "sc_per_lap") if a.name == "sc_chance" else ("vsc_per_lap",)
    laps = {"sc_lap1": 1, "sc_per_lap": later, "vsc_per_lap": later}
    fitted: dict[str, float] = {key: getattr(incidents, key).value for key in keys}
    none = math.prod((1 - p) ** laps[key] for key, p in fitted.items())
    chance = a.applied(1 - none)
    if not 0 <= chance < 1:
        raise RsrlError(f"--set {a.text}: {a.name} would be {chance:g}; a chance is from 0 to below 1")
    if 0 < none < 1:
        power = math.log(1 - chance) / math.log(none)
        values = {key: 1 - (1 - p) ** power for key, p in fitted.items()}
    else:  # never or always: nothing to scale, so the same chance on every lap
        values = dict.fromkeys(keys, 1 - (1 - chance) ** (1 / sum(laps[key] for key in keys)))
    changed: dict[str, Any] = {}
    for key, value in values.items():
        old: Figure = getattr(incidents, key)
        _check(value, key, a)
        se = 0.0 if a.change == "=" or old.value == 0 else old.se * value / old.value
        changed[key] = Figure(value, se, 0, f"assumed: {a.text}, fitted: {old.value:.6g}")
    return replace(incidents, **changed)


def _regridded(record: RaceRecord, a: Assumption) -> tuple[CarFigures, ...]:
    """Cars in the new grid order: the driver takes the place asked for, the cars between move by one."""
    index = find_car(record, a.of)
    places = [car.grid for car in record.cars]
    wanted = a.applied(places[index])
    if a.change == "x" or wanted not in places:
        which = f"1 to {places[-1]}" if len(places) == places[-1] else ", ".join(map(str, places))
        raise RsrlError(f"--set {a.text}: write a place on the grid, {which} at {record.name}, or +2 for two places further back")
    cars = list(record.cars)
    cars.insert(places.index(int(wanted)), cars.pop(index))
    return tuple(replace(car, grid=place) for car, place in zip(cars, places, strict=True))


def _with_sets(record: RaceRecord, a: Assumption) -> RaceRecord:
    """Another number of sets of a compound, for cars with sets of their own as well.

    Plans of other teams that need more sets of the compound are left out.
    """
    compound = _compound(record, a)
    sets = a.applied(record.tyres[compound].sets)
    others = sum(tyre.sets for letter, tyre in record.tyres.items() if letter != compound)
    if a.change == "x" or sets != int(sets) or not 0 <= sets <= MAX_SETS or others + sets < 2:
        raise RsrlError(f"--set {a.text}: write a number of sets, 0 to {MAX_SETS}, so that a car has two in all at least")
    plans = tuple(plan for plan in record.rivals.plans if plan.plan.count(compound) <= sets)
    if not plans:
        raise RsrlError(f"--set {a.text}: every strategy that teams ran at {record.name} needs more sets of {compound}")
    tyres = {**record.tyres, compound: replace(record.tyres[compound], sets=int(sets))}
    cars = tuple(car if car.sets is None else replace(car, sets={**car.sets, compound: (0,) * int(sets)}) for car in record.cars)
    published = tuple(plan for plan in record.published if plan.count(compound) <= sets)
    return replace(record, tyres=tyres, cars=cars, rivals=replace(record.rivals, plans=plans), published=published)


def _with_own_sets(record: RaceRecord, text: str, who: str, sets: TyreSets) -> RaceRecord:
    """Sets of one car, or of each of them where `who` is `ALL_CARS`."""
    wanted = set(range(len(record.cars))) if who.casefold() == ALL_CARS else {find_car(record, who)}
    if why := impossible_sets(sets, record.laps, record.max_laps_per_set):
        raise RsrlError(f"--set {text}: {why} at {record.name}")
    if not any(sets[plan.plan[0]] for plan in record.rivals.plans):
        raise RsrlError(f"--set {text}: no team started {record.name} on a tyre of these sets")
    return replace(record, cars=tuple(replace(car, sets=sets) if i in wanted else car for i, car in enumerate(record.cars)))


def _compound(record: RaceRecord, a: Assumption) -> str:
    compound = read_compound(a.of, record.tyres)
    if compound is None:
        raise RsrlError(f"--set {a.text}: unknown compound {a.of!r}; compounds are {', '.join(COMPOUNDS)} ({c_numbers(record.tyres)})")
    return compound
