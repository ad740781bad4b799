"""Figures put into simulated seasons come out of analysis and pooling again, within their standard errors and close in plain seconds."""

import dataclasses
import statistics

import pytest
from calibration_laps import C_NUMBERS, facts_of, figure, known_record
from calibration_seasons import EVENTS, SEASONS, known_seasons, known_track, one_race

from rsrl.calibration import RaceAnalysis, SeasonModel, analyse_race, pool
from rsrl.calibration.pooling.traffic import RACED_S
from rsrl.season import COMPOUNDS, Figure, RaceRecord
from rsrl.simulator import trace_races


def check(found: Figure, truth: float, tolerance: float) -> None:
    assert found.value == pytest.approx(truth, abs=tolerance)
    assert abs(found.value - truth) < 3.5 * found.se  # of sixty figures checked one in forty runs is further off by chance
    assert found.se < tolerance  # an error bar that holds everything proves nothing


@pytest.fixture(scope="module")
def model() -> SeasonModel:
    return pool(known_seasons())


@pytest.fixture(scope="module", params=range(len(SEASONS) * len(EVENTS)))
def analysis(request: pytest.FixtureRequest) -> RaceAnalysis:
    return known_seasons()[request.param]


@pytest.fixture(scope="module")
def truth(analysis: RaceAnalysis) -> RaceRecord:
    return known_track(analysis.entry.grand_prix, analysis.entry.season)


@pytest.fixture(scope="module")
def found(model: SeasonModel, analysis: RaceAnalysis) -> RaceRecord:
    return model.record(analysis.entry)


def test_wear_and_offsets_of_each_track(found: RaceRecord, truth: RaceRecord) -> None:
    for c in COMPOUNDS:
        check(found.tyres[c].wear_s_per_lap, truth.tyres[c].wear_s_per_lap.value, 0.015)
    for c in ("S", "H"):
        check(found.tyres[c].offset_s, truth.tyres[c].offset_s.value, 0.2)


def test_gain_over_the_race_is_fuel_and_track_together(found: RaceRecord, truth: RaceRecord) -> None:
    fuel = truth.track.fuel_s_per_kg.value * truth.track.fuel_start_kg.value
    gain = found.track.fuel_s_per_kg.value * found.track.fuel_start_kg.value + found.track.evolution_s.value
    assert gain == pytest.approx(fuel + truth.track.evolution_s.value, abs=0.3)


def test_base_lap_and_pace_of_every_car(found: RaceRecord, truth: RaceRecord) -> None:
    mean = statistics.fmean(car.pace_s.value for car in truth.cars)
    check(found.track.base_lap_s, truth.track.base_lap_s.value + mean, 0.25)
    for mine, true in zip(found.cars, truth.cars, strict=True):
        assert mine.pace_s.value == pytest.approx(true.pace_s.value - mean, abs=0.25)


def test_noise_is_told_from_the_pace_of_a_stint(found: RaceRecord, truth: RaceRecord) -> None:
    check(found.track.lap_noise_sd_s, truth.track.lap_noise_sd_s.value, 0.04)
    assert found.track.stint_sd_s.value == pytest.approx(truth.track.stint_sd_s.value, abs=0.06)


def test_pit_loss_and_where_it_falls(found: RaceRecord, truth: RaceRecord) -> None:
    check(found.pit.loss_green_s, truth.pit.loss_green_s.value, 1.2)
    assert found.pit.in_lap_share.value == pytest.approx(truth.pit.in_lap_share.value, abs=0.08)


def test_start(found: RaceRecord, truth: RaceRecord) -> None:
    check(found.track.start_loss_s, truth.track.start_loss_s.value, 1.3)
    check(found.track.start_per_place_s, truth.track.start_per_place_s.value, 0.12)
    assert found.track.start_sd_s.value == pytest.approx(truth.track.start_sd_s.value, abs=0.8)


def test_traffic(found: RaceRecord, truth: RaceRecord) -> None:
    check(found.track.following_gap_s, truth.track.following_gap_s.value, 0.08)
    assert found.track.dirty_air_loss_s.value == pytest.approx(truth.track.dirty_air_loss_s.value, abs=0.2)
    assert found.track.pass_threshold_s.value - RACED_S == pytest.approx(truth.track.pass_threshold_s.value, abs=0.4)
    assert found.track.pass_per_gap is not None
    assert truth.track.pass_per_gap is not None
    assert found.track.pass_per_gap.value == pytest.approx(truth.track.pass_per_gap.value, abs=0.7)
    assert found.track.pass_scale_s.value == pytest.approx(truth.track.pass_scale_s.value, abs=0.15)
    assert found.track.passed_loss_s.value == pytest.approx(truth.track.passed_loss_s.value, abs=0.35)


def test_tracks_keep_their_order(model: SeasonModel) -> None:
    thresholds = [model.traffic.passing.threshold(slug).value for slug in EVENTS]
    assert thresholds == sorted(thresholds)


def test_safety_cars_and_retirements_are_counted() -> None:
    record = known_record(sc=0.03, vsc=0.03)
    record = dataclasses.replace(record, cars=tuple(dataclasses.replace(c, retire_per_lap=figure(0.004)) for c in record.cars))
    trace = trace_races(record, 1, 8)
    race = one_race(record, trace, 2023, 1)
    analysis = analyse_race(race, facts_of(record, race), C_NUMBERS)
    assert analysis.incidents is not None
    slow = race.filter(race["track_status"] != "1")["lap"].unique()
    runs = [d.lap for d in analysis.incidents.deployments]
    assert len(runs) >= 2
    assert sum(len(d.excess) for d in analysis.incidents.deployments) == len(slow)
    assert len(analysis.retired) == int((~trace.running[0, -1, : len(record.cars)]).sum()) > 0
