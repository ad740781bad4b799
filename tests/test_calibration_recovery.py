"""Figures put into simulated races come out of the fits again, within their standard errors and close in plain seconds."""

import dataclasses

import numpy as np
import polars as pl
import pytest
from calibration_laps import C_NUMBERS, facts_of, figure, known_record, simulated

from rsrl.calibration.pace import PaceModel, base_lap, car_pace, fit_pace, lap_noise
from rsrl.calibration.pit import fit_pit
from rsrl.calibration.start import fit_start
from rsrl.calibration.traffic import fit_traffic
from rsrl.calibration.tyres import tyre_figures
from rsrl.laps import clean
from rsrl.season import COMPOUNDS, Figure, RaceRecord

SEEDS = (0, 1)


def check(found: Figure, truth: float, tolerance: float) -> None:
    assert found.value == pytest.approx(truth, abs=tolerance)
    assert abs(found.value - truth) < 3 * found.se
    assert found.se < tolerance  # an error bar that holds everything proves nothing


@pytest.fixture(scope="module")
def record() -> RaceRecord:
    return known_record()


@pytest.fixture(scope="module", params=SEEDS)
def table(request: pytest.FixtureRequest, record: RaceRecord) -> pl.DataFrame:
    return simulated(record, request.param)


@pytest.fixture(scope="module")
def model(table: pl.DataFrame, record: RaceRecord) -> PaceModel:
    return fit_pace(clean(table).laps, 2023, {2022: record.laps, 2023: record.laps}, C_NUMBERS)


def starters(record: RaceRecord) -> list[tuple[str, str]]:
    return [(car.team, car.driver) for car in record.cars]


def test_fuel_and_wear_are_told_apart(model: PaceModel, record: RaceRecord) -> None:
    check(Figure(*model.fit.combine({"fuel": 1.0}), 1), record.track.fuel_s_per_kg.value, 0.003)
    tyres = tyre_figures(model, dict.fromkeys(COMPOUNDS, figure(1.0)), dict.fromkeys(COMPOUNDS, 1))
    for letter in COMPOUNDS:
        check(tyres[letter].wear_s_per_lap, record.tyres[letter].wear_s_per_lap.value, 0.025)
    for letter in ("S", "H"):
        check(tyres[letter].offset_s, record.tyres[letter].offset_s.value, 0.35)


def test_base_lap_and_pace_of_every_car(model: PaceModel, record: RaceRecord) -> None:
    mean = float(np.mean([car.pace_s.value for car in record.cars]))
    check(base_lap(model, starters(record)), record.track.base_lap_s.value + mean, 0.4)
    for car in record.cars:
        check(car_pace(model, starters(record), car.team, car.driver), car.pace_s.value - mean, 0.3)


def test_lap_noise(model: PaceModel, record: RaceRecord) -> None:
    noise, factors = lap_noise(model)
    check(noise, record.track.lap_noise_sd_s.value, 0.04)
    assert all(0.6 < f.value < 1.5 for f in factors.values())


def test_pit_loss(table: pl.DataFrame, model: PaceModel, record: RaceRecord) -> None:
    pit = fit_pit(table, model, [(2022, 1), (2023, 1)])
    check(pit.figures.loss_green_s, record.pit.loss_green_s.value, 1.0)
    for cold in pit.cold_s.values():
        check(cold, 1.0, 0.8)


def test_start(table: pl.DataFrame, model: PaceModel, record: RaceRecord) -> None:
    start = fit_start(table, model, {(s, 1): facts_of(record) for s in (2022, 2023)}, 2023)
    check(start.loss_s, record.track.start_loss_s.value, 1.2)
    check(start.per_place_s, record.track.start_per_place_s.value, 0.1)
    check(start.sd_s, record.track.start_sd_s.value, 0.7)


def test_traffic(table: pl.DataFrame, model: PaceModel, record: RaceRecord) -> None:
    traffic = fit_traffic(clean(table).laps, model, record.track.lap_noise_sd_s.value)
    check(traffic.dirty_air_loss_s, record.track.dirty_air_loss_s.value, 0.3)
    check(traffic.following_gap_s, record.track.following_gap_s.value, 0.05)
    check(traffic.pass_threshold_s, record.track.pass_threshold_s.value, 0.3)
    check(traffic.pass_scale_s, record.track.pass_scale_s.value, 0.3)


def test_wear_that_grows_with_age_is_found(record: RaceRecord) -> None:
    soft = dataclasses.replace(record.tyres["S"], wear_s_per_lap=figure(0.12), curvature_s_per_lap2=figure(0.004))
    curved = dataclasses.replace(record, tyres=record.tyres | {"S": soft})
    laps = clean(simulated(curved, 5)).laps
    fitted = fit_pace(laps, 2023, {2022: record.laps, 2023: record.laps}, C_NUMBERS)
    found = tyre_figures(fitted, dict.fromkeys(COMPOUNDS, figure(1.0)), dict.fromkeys(COMPOUNDS, 1))["S"]
    check(found.curvature_s_per_lap2, 0.004, 0.0015)
