"""Chances of safety cars with and without a retirement, such that a race has as many of each kind as the figures say.

`sc_lap1`, `sc_per_lap` and `vsc_per_lap` are totals: they count the safety cars that come with a retirement too. A retirement brings out
one with the probability of `sc_per_retirement` and the like; what the cars' own hazards then make of the total is taken off, and the rest
comes without a retirement. Where retirements alone would give more than the total, each of them brings out fewer.
"""

import math
from typing import NamedTuple

from rsrl.season import Figure, RaceRecord


class IncidentChances(NamedTuple):
    """Probabilities. `alone`: on a racing lap without such a retirement; `by_retirement`: of each car that retires on it."""

    sc_lap1_alone: float
    sc_alone: float
    vsc_alone: float
    sc_by_retirement_lap1: float
    sc_by_retirement: float
    vsc_by_retirement: float


def incident_chances(record: RaceRecord) -> IncidentChances:
    """The chances of a race; without figures for retirements the totals themselves."""
    i = record.incidents
    first, first_alone = _on_lap1(record, _given(i.sc_per_retirement_lap1), i.sc_lap1.value)
    out = _retirements_a_lap(record)
    sc, vsc = (
        min(given, total / out) if out > 0 else given
        for given, total in ((_given(i.sc_per_retirement), i.sc_per_lap.value), (_given(i.vsc_per_retirement), i.vsc_per_lap.value))
    )
    left = 1.0 - (sc + vsc) * out  # share of racing laps on which no retirement brings out anything
    sc_alone, vsc_alone = (max(total - given * out, 0.0) / left for given, total in ((sc, i.sc_per_lap.value), (vsc, i.vsc_per_lap.value)))
    return IncidentChances(first_alone, sc_alone, vsc_alone, first, sc, vsc)


def _given(figure: Figure | None) -> float:
    return figure.value if figure else 0.0


def _on_lap1(record: RaceRecord, given: float, total: float) -> tuple[float, float]:
    """Chance that a car out on lap 1 brings out the safety car, and the chance of one without such a car."""

    def none(chance: float) -> float:
        return math.prod(1.0 - car.retire_lap1.value * chance for car in record.cars)

    # the logarithm of `none` is nearly proportional to the chance, as cars seldom stop on lap 1
    caused = 1.0 - none(given)
    if caused > total:
        return given * math.log1p(-total) / math.log1p(-caused), 0.0
    return given, (total - caused) / (1.0 - caused)


def _retirements_a_lap(record: RaceRecord) -> float:
    """Mean number of cars that retire on a lap after the first and before the last: fewer late in the race, as fewer cars are left."""
    laps = range(2, record.laps)
    return sum(
        (1.0 - car.retire_lap1.value) * car.retire_per_lap.value * (1.0 - car.retire_per_lap.value) ** (lap - 2)
        for car in record.cars
        for lap in laps
    ) / len(laps)
