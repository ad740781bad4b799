"""Safety cars that come with a retirement, and form of the day that team mates share: what they change, and what they leave alone."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from synthetic_race import figure, synthetic_race

from rsrl.season import GREEN, SC, VSC, RaceRecord
from rsrl.simulator import RaceBatch, Trace, compile_figures, trace_races
from rsrl.simulator import layout as at
from rsrl.simulator.incident_chances import incident_chances
from rsrl.state.expectation import status_chances

SIGMAS = 4.5
RACES = 1500


def crashing(sc: float, vsc: float, lap1: float, **figures: float) -> RaceRecord:
    """A race in which a retirement brings out safety cars."""
    record = synthetic_race(**{"laps": 20, "retire_per_lap": 0.004, "retire_lap1": 0.02, **figures})  # type: ignore[arg-type]
    caused: dict[str, Any] = {"sc_per_retirement": figure(sc), "vsc_per_retirement": figure(vsc), "sc_per_retirement_lap1": figure(lap1)}
    return dataclasses.replace(record, incidents=dataclasses.replace(record.incidents, **caused))


def out_on(trace: Trace) -> np.ndarray:
    """Whether a car retired on each lap, [races, laps]."""
    running = trace.running.sum(axis=2)
    return np.diff(running, axis=1, prepend=20) < 0


def starts_of(trace: Trace, status: int) -> np.ndarray:
    """Whether a neutralisation begins on the lap after each lap but the last, [races, laps - 1]."""
    return (trace.track_status[:, :-1] == GREEN) & (trace.track_status[:, 1:] == status)


def test_a_retirement_brings_out_the_safety_car_of_the_next_lap() -> None:
    record = crashing(1.0, 0.0, 1.0, sc_per_lap=0.09, sc_lap1=0.4, vsc_per_lap=0.0)
    trace = trace_races(record, RACES, 1)
    racing = trace.track_status[:, :-1] == GREEN
    out = out_on(trace)[:, :-1] & racing
    assert out.sum() > 500
    assert (trace.track_status[:, 1:][out] == SC).all()


def test_without_any_other_cause_a_safety_car_follows_a_lap_with_a_retirement() -> None:
    record = crashing(0.9, 0.0, 0.9, sc_per_lap=0.03, sc_lap1=0.1, vsc_per_lap=0.0)  # fewer than retirements alone would give
    chances = incident_chances(record)
    assert chances.sc_lap1_alone == chances.sc_alone == 0.0
    assert chances.sc_by_retirement < 0.5
    trace = trace_races(record, RACES, 1)
    starts = starts_of(trace, SC)
    assert starts.sum() > 300
    assert out_on(trace)[:, :-1][starts].all()


@pytest.mark.parametrize(("sc", "vsc", "lap1"), [(0.3, 0.2, 0.6), (0.9, 0.1, 0.9), (0.0, 0.0, 0.0)])
def test_there_are_as_many_of_each_kind_as_the_figures_say(sc: float, vsc: float, lap1: float) -> None:
    record = crashing(sc, vsc, lap1, sc_per_lap=0.04, vsc_per_lap=0.02, sc_lap1=0.25)
    trace = trace_races(record, 4000, 2)
    racing = trace.track_status[:, :-1] == GREEN
    for status, rate in ((SC, record.incidents.sc_per_lap.value), (VSC, record.incidents.vsc_per_lap.value)):
        laps = racing[:, 1:].sum()
        seen = starts_of(trace, status)[:, 1:].sum()
        # fewer cars run late in the race: the mean over its laps is what is kept, so a little more than chance is allowed
        assert abs(seen - rate * laps) < SIGMAS * np.sqrt(rate * laps) + 0.03 * rate * laps
    first = starts_of(trace, SC)[:, 0].mean()
    assert abs(first - 0.25) < SIGMAS * np.sqrt(0.25 * 0.75 / 4000) + 0.005


def test_the_draw_is_its_own() -> None:
    """Retirements and the laps up to the first neutralisation are those of the race without the figures."""
    plain = synthetic_race(laps=20, retire_per_lap=0.004, retire_lap1=0.02)
    caused = crashing(0.5, 0.2, 0.5)
    one, other = (trace_races(record, 200, 3) for record in (plain, caused))
    np.testing.assert_array_equal(one.running, other.running)
    slow = (one.track_status != GREEN) | (other.track_status != GREEN)
    before = ~np.maximum.accumulate(slow, axis=1)
    assert (one.track_status != other.track_status).any()
    np.testing.assert_array_equal(one.lap_time_s[before], other.lap_time_s[before])


def test_the_tables_of_expected_status_keep_the_totals() -> None:
    plain = synthetic_race(laps=20, retire_per_lap=0.004, retire_lap1=0.02)
    np.testing.assert_array_equal(status_chances(compile_figures(plain)), status_chances(compile_figures(crashing(0.5, 0.2, 0.5))))
    chances = incident_chances(plain)
    i = plain.incidents
    assert chances == (i.sc_lap1.value, i.sc_per_lap.value, i.vsc_per_lap.value, 0.0, 0.0, 0.0)


def forms(share: float | None, cars: int = 20) -> np.ndarray:
    """Form of every car in many races, s."""
    record = synthetic_race(cars=cars, form_sd_s=0.5, pace_step_s=0.0)
    own = tuple(dataclasses.replace(car, team_form_share=None if share is None else figure(share)) for car in record.cars)
    figures = compile_figures(dataclasses.replace(record, cars=own))
    batch = RaceBatch(figures, 4000)
    batch.start(1, np.arange(4000))
    return np.asarray(batch.f[:, at.F_PACE, :cars])


def test_team_mates_share_their_form_and_nobody_else_does() -> None:
    found = np.corrcoef(forms(0.75).T)
    mates = found[np.arange(0, 20, 2), np.arange(1, 20, 2)]
    np.testing.assert_allclose(mates, 0.75, atol=0.04)
    strangers = found[::2, ::2][~np.eye(10, dtype=bool)]
    assert np.abs(strangers).max() < SIGMAS / np.sqrt(4000)
    np.testing.assert_allclose(forms(0.75).std(axis=0), 0.5, atol=0.03)
    np.testing.assert_array_equal(forms(1.0)[:, ::2], forms(1.0)[:, 1::2])
    alone = np.corrcoef(forms(None).T)[0, 1]
    assert abs(alone) < SIGMAS / np.sqrt(4000)


def test_a_car_without_a_team_mate_has_the_whole_spread() -> None:
    assert forms(0.75, cars=3)[:, 2].std() == pytest.approx(0.5, abs=0.03)
