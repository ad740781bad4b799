"""A race's figures drawn within their uncertainty: other values that fit the measurements as well.

Figures that cannot be negative are multiplied by exp(scale x se / value x normal), kept between 1/2 and 2 at scale 1; to the others
scale x se x normal is added. Errors with a common source are drawn once: a team's stops and reliability, the field's form, most of the
pace of a team's two cars, most of what a cold tyre costs on any compound.
"""

import math
from collections.abc import Mapping
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any, Final

from rsrl.errors import RsrlError
from rsrl.season.bounds import bounds_of
from rsrl.season.records import CarFigures, Figure, IncidentFigures, PitFigures, RaceRecord, RivalFigures, TrackFigures, TyreFigures

if TYPE_CHECKING:  # the command line reads season files without NumPy
    from numpy.random import Generator

SHARED: Final = 0.8
"""Share of the error's variance that a team's cars, or a race's compounds, have in common."""

BELOW_GREEN: Final = 0.99
"""A stop under a safety car costs at most this share of a stop on a racing lap."""

SIGNED: Final = frozenset({"evolution_s", "pass_threshold_s", "offset_s", "cold_loss_s", "pace_s", "start_gain_s", "stop_loss_s"})
"""Figures that may be negative: their error is added."""

FIELD_WIDE: Final = frozenset({"form_sd_s", "retire_lap1"})
TEAM_WIDE: Final = frozenset({"retire_per_lap", "stop_loss_s", "stop_tail_factor"})
KEPT: Final = frozenset({"base_lap_s"})
"""Not drawn: the level of all lap times makes no difference between cars."""


def _names(kind: type) -> tuple[str, ...]:
    return tuple(f.name for f in fields(kind) if f.type is Figure and f.name not in KEPT)


TRACK, TYRE, PIT, INCIDENTS, CAR, RIVALS = (
    _names(kind) for kind in (TrackFigures, TyreFigures, PitFigures, IncidentFigures, CarFigures, RivalFigures)
)


def perturbed(record: RaceRecord, rng: "Generator", scale: float = 1.0) -> RaceRecord:
    """The record with its figures drawn within `scale` times their standard errors; scale 0 gives the record's own figures.

    Not drawn: figures without an error (rules, the medium's offset), those that a file may lack, the level of the lap, durations of safety
    cars, sets, laps, the grid, plans, and the coefficients of reactive rivals, whose covariances are not in the file. Usual stints are
    drawn. The bounds of `season.bounds` hold; a stop under a safety car stays cheaper than one on a racing lap. A figure that is multiplied
    keeps its relative error.

    Args:
        record: a race.
        rng: source of the draws; the same state gives the same record.
        scale: factor on all errors, 0 or more. Figures are multiplied by 2 at most at scale 1, by 4 at scale 3.

    Raises:
        RsrlError: the scale is negative, infinite or NaN.
    """
    if not 0 <= scale < math.inf:
        raise RsrlError(f"scale is {scale}; errors are scaled by 0 or more")
    return replace(
        record,
        track=_draw(record.track, TRACK, rng, scale),
        tyres=_draw_tyres(record.tyres, rng, scale),
        pit=_draw_pit(record.pit, rng, scale),
        incidents=_draw(record.incidents, INCIDENTS, rng, scale),
        cars=_draw_cars(record.cars, rng, scale),
        rivals=_draw_rivals(record.rivals, rng, scale),
    )


def most_factor(scale: float) -> float:
    """Largest factor by which a positive figure is multiplied: 2 at scale 1, 4 at scale 3."""
    return 2.0 ** min(scale, (1.0 + scale) / 2)


def drawn(name: str, figure: Figure, z: float, scale: float) -> Figure:
    """A figure moved by `z` scaled standard errors. `name`: as in the season file, `table.name` where names are not fixed."""
    value, se, n, note = figure
    if se == 0 or scale == 0:
        return figure
    low, high = bounds_of(name)
    if name in SIGNED or value <= 0:
        # a figure that cannot be negative and was fitted at zero may rise, never fall
        floor = low if name in SIGNED or value < 0 else max(low, 0.0)
        return Figure(min(max(value + scale * se * z, floor), high), se, n, note)
    most = math.log(most_factor(scale))
    moved = min(max(value * math.exp(min(max(scale * se / value * z, -most), most)), low), high)
    return Figure(moved, se * moved / value, n, note)


def _draw(part: Any, names: tuple[str, ...], rng: "Generator", scale: float) -> Any:
    """A record with the named figures drawn independently."""
    z = rng.standard_normal(len(names)).tolist()
    return replace(part, **{name: drawn(name, getattr(part, name), z[i], scale) for i, name in enumerate(names)})


def _mixed(common: float, own: float) -> float:
    return math.sqrt(SHARED) * common + math.sqrt(1 - SHARED) * own


def _draw_tyres(tyres: Mapping[str, TyreFigures], rng: "Generator", scale: float) -> dict[str, TyreFigures]:
    cold = float(rng.standard_normal())
    result = {}
    for compound, tyre in tyres.items():
        z = dict(zip(TYRE, rng.standard_normal(len(TYRE)).tolist(), strict=True))
        z["cold_loss_s"] = _mixed(cold, z["cold_loss_s"])
        changed: dict[str, Any] = {name: drawn(name, getattr(tyre, name), z[name], scale) for name in TYRE}
        result[compound] = replace(tyre, **changed)
    return result


def _draw_pit(pit: PitFigures, rng: "Generator", scale: float) -> PitFigures:
    """Pit figures; the losses under safety cars are capped, so that they stay below the loss on a racing lap."""
    result: PitFigures = _draw(pit, PIT, rng, scale)
    green = pit.loss_green_s.value
    capped = {}
    for name in ("loss_vsc_s", "loss_sc_s"):
        figure: Figure = getattr(result, name)
        most = result.loss_green_s.value * max(BELOW_GREEN, getattr(pit, name).value / green)
        if figure.value > most and scale > 0:
            capped[name] = figure._replace(value=most)
    return replace(result, **capped) if capped else result


def _draw_cars(cars: tuple[CarFigures, ...], rng: "Generator", scale: float) -> tuple[CarFigures, ...]:
    field = rng.standard_normal(len(CAR)).tolist()
    teams = {team: rng.standard_normal(len(CAR)).tolist() for team in dict.fromkeys(car.team for car in cars)}
    own = rng.standard_normal((len(cars), len(CAR))).tolist()
    result = []
    for i, car in enumerate(cars):
        changed: dict[str, Any] = {}
        for j, name in enumerate(CAR):
            team_z, own_z = teams[car.team][j], own[i][j]
            if name == "pace_s":
                z = _mixed(team_z, own_z)
            else:
                z = field[j] if name in FIELD_WIDE else team_z if name in TEAM_WIDE else own_z
            changed[name] = drawn(name, getattr(car, name), z, scale)
        result.append(replace(car, **changed))
    return tuple(result)


def _draw_rivals(rivals: RivalFigures, rng: "Generator", scale: float) -> RivalFigures:
    """Rivals' windows and usual stints; a compound's first and later stints share their error."""
    result: RivalFigures = _draw(rivals, RIVALS, rng, scale)
    z = {compound: float(rng.standard_normal()) for compound in sorted({name[0] for name in rivals.life_laps})}
    lives = {name: drawn(f"life_laps.{name}", figure, z[name[0]], scale) for name, figure in rivals.life_laps.items()}
    return replace(result, life_laps=lives)
