"""The paper's study of generalisability: its cells, and its result from theirs."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from rsrl.errors import RsrlError
from rsrl.evaluation.study.cells import Cell, make_cell
from rsrl.evaluation.study.estimates import Run, difference
from rsrl.evaluation.study.scoring import Entrant, reference_model, score
from rsrl.results import FORMAT, CarRow, Cars, LeftOut, Participant, Provenance, StudyResult, known
from rsrl.season import load_race, race_names, resolve_race
from rsrl.season.groups import STUDY_SEASON

Slot = tuple[str, str, str]
"""Names of a strategist, a race and a driver."""


@dataclass(frozen=True)
class Study:
    """The request: who calls which races.

    Attributes:
        entrants: models and other strategists.
        races: Grands Prix of the table.
        held_out: Grands Prix of a table of their own.
        cars_at: of `races`, those at which every car is called too.
        cars_by: names of the entrants that call every car.
        driver: whose car is called; None for each race's default driver.
        seed, first_race: races number first_race, first_race + 1 ... of the seed.
    """

    entrants: tuple[Entrant, ...]
    races: tuple[str, ...]
    driver: str | None = None
    seed: int = 7
    first_race: int = 0
    cars_at: tuple[str, ...] = ()
    cars_by: tuple[str, ...] = ()
    held_out: tuple[str, ...] = ()


def race_of_track(track: str) -> str:
    """Name of a race: a track's of the study's season unless a season stands with it, as in `spain-2024`.

    Raises:
        RsrlError: there is no season file of it.
    """
    return resolve_race(track if re.search(r"\d", track) else f"{track}-{STUDY_SEASON}", race_names())


def plan_cells(study: Study) -> dict[Slot, Cell]:
    """The cells of a study by what they are for.

    Raises:
        RsrlError: a race, driver or strategist there is not.
    """
    return {
        (entrant.name, race, cell.driver): cell
        for entrant, race, driver in _wanted(study)
        for cell in [
            make_cell(entrant.strategist, race, driver, seed=study.seed, races=entrant.races, first_race=study.first_race),
        ]
    }


def _wanted(study: Study) -> Iterator[tuple[Entrant, str, str | None]]:
    for race in (*study.races, *study.held_out):
        for entrant in study.entrants:
            yield entrant, race, study.driver
    for race in study.cars_at:
        for entrant in study.entrants:
            if entrant.name in study.cars_by:
                for car in load_race(race).cars:
                    yield entrant, race, car.driver


def generalise(study: Study, cells: Mapping[Slot, Cell], results: Mapping[Cell, Mapping[str, Any]], provenance: Provenance) -> StudyResult:
    """The result of the study.

    Raises:
        RsrlError: no strategist could call any race.
    """
    runs = {slot: Run.of(results[cell]) for slot, cell in cells.items() if "left_out" not in results[cell]}
    if not runs:
        raise RsrlError("no strategist of the study can call any of its races; name others with --strategists or --tracks")
    drivers = {race: next(car for _, where, car in cells if where == race) for race in (*study.races, *study.held_out)}
    own = {(name, race): run for (name, race, driver), run in runs.items() if driver == drivers[race]}
    return StudyResult(
        study="generalise",
        format=FORMAT,
        seed=study.seed,
        first_race=study.first_race,
        driver=study.driver,
        reference=reference_model(study.entrants),
        strategists=tuple(_participant(entrant, cells) for entrant in study.entrants),
        tracks=score(study.entrants, study.races, drivers, own),
        held_out=score(study.entrants, study.held_out, drivers, own) if study.held_out else None,
        cars=tuple(row for race in study.cars_at for row in _cars(study, race, runs)),
        left_out=_left_out(cells, results),
        provenance=provenance,
    )


def _participant(entrant: Entrant, cells: Mapping[Slot, Cell]) -> Participant:
    kind: Literal["model", "baseline", "bound"] = "model" if entrant.is_model else "baseline" if entrant.is_baseline else "bound"
    model = next((cell.model_hash for (name, _, _), cell in cells.items() if name == entrant.name), "")
    return Participant(entrant.name, kind, entrant.races, entrant.trained_on, model or None)


def _left_out(cells: Mapping[Slot, Cell], results: Mapping[Cell, Mapping[str, Any]]) -> tuple[LeftOut, ...]:
    """Who could not call which race, told once a race."""
    rows: dict[tuple[str, str], LeftOut] = {}
    for (name, race, _), cell in cells.items():
        if "left_out" in results[cell]:
            rows[name, race] = LeftOut(name, race, results[cell]["left_out"].removeprefix(f"{race}: "))
    return tuple(rows.values())


def _cars(study: Study, race: str, runs: Mapping[Slot, Run]) -> list[Cars]:
    """Every car called in turn, the others left to themselves: each strategist against the reference model."""
    record, reference = load_race(race), reference_model(study.entrants)
    rows = []
    for name in study.cars_by:
        pairs = [(runs.get((name, race, car.driver)), runs.get((str(reference), race, car.driver))) for car in record.cars]
        own = [(car, a, b) for car, (a, b) in zip(record.cars, pairs, strict=True) if a and b]
        if name == reference or not own:
            continue
        mean = difference([a.position for _, a, _ in own], [b.position for _, _, b in own])
        cars = tuple(_car_row(car.driver, car.grid, a, b) for car, a, b in own)
        sure = [known(car.ci95) or (0.0, 0.0) for car in cars]
        rows.append(
            Cars(
                race=race,
                strategist=name,
                against=str(reference),
                cars=len(cars),
                ahead=sum(car.difference > 0 for car in cars),
                surely_ahead=sum(low > 0 for low, _ in sure),
                surely_behind=sum(high < 0 for _, high in sure),
                difference=mean.difference,
                ci95=mean.ci95,
                races=mean.races,
                by_car=cars,
            )
        )
    return rows


def _car_row(driver: str, grid: int, own: Run, reference: Run) -> CarRow:
    d = difference([own.position], [reference.position])
    return CarRow(driver, grid, float(np.mean(own.position)), float(np.mean(reference.position)), d.difference, d.ci95, d.p_ahead)
