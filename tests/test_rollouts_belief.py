"""The belief of a pit wall, read from a single state: the posterior of normal laws."""

import numpy as np
import pytest
from synthetic_race import synthetic_race

from rsrl.environment import RaceEnvironment
from rsrl.rollouts import B_PACE, B_PACE_SD, B_STINT, B_STINT_BY_PACE, B_STINT_SD, belief_of, prior_belief
from rsrl.simulator import compile_figures
from rsrl.simulator import layout as at

CAR = 9
RACE = synthetic_race(laps=20, sc_per_lap=0.15, vsc_per_lap=0.1, stint_sd_s=0.15)


def test_belief_before_a_lap_is_the_prior() -> None:
    figures = compile_figures(RACE)
    environment = RaceEnvironment(RACE, CAR)
    environment.reset(2, np.array([0], np.int64))
    assert belief_of(figures, environment.races.f[0]) == pytest.approx(prior_belief(figures), abs=1e-6)


def test_belief_on_a_first_set_is_the_posterior() -> None:
    """Against the textbook formula: form ~ N(0, a), luck ~ N(0, b), n laps each form + luck + N(0, c)."""
    figures = compile_figures(RACE)
    f = np.zeros((at.F_ROWS, at.CARS), np.float32)
    f[at.F_SHOWN_LAPS] = 4.0
    a, b = figures.cars[at.C_FORM].astype(float) ** 2, float(figures.track[at.T_STINT]) ** 2
    c = figures.cars[at.C_NOISE].astype(float) ** 2 / 4.0
    belief = belief_of(figures, f)
    for car in range(len(RACE.cars)):
        prior = np.diag([max(a[car], 1e-6), b])
        gain = prior @ np.ones(2) / (prior.sum() + c[car])
        posterior = prior - np.outer(gain, np.ones(2) @ prior)
        sd = np.sqrt(posterior[0, 0])
        assert belief[B_PACE_SD, car] == pytest.approx(sd, rel=1e-4)
        assert belief[B_STINT_BY_PACE, car] == pytest.approx(posterior[0, 1] / sd, rel=1e-4, abs=1e-7)
        assert belief[B_STINT_SD, car] == pytest.approx(np.sqrt(max(posterior[1, 1] - (posterior[0, 1] / sd) ** 2, 0)), rel=1e-3, abs=1e-4)
    assert (belief[B_PACE] == figures.cars[at.C_PACE]).all()
    assert (belief[B_STINT] == 0).all()


def test_belief_after_an_earlier_set_is_the_posterior() -> None:
    """Against the normal posterior by matrices: a form shown by one earlier set and n laps on this one."""
    figures = compile_figures(synthetic_race(laps=14, stint_sd_s=0.1))
    f = np.zeros((at.F_ROWS, at.CARS), np.float32)
    form, luck, noise = 0.1**2, 0.1**2, 0.3**2
    weight, n = 30.0, 4.0
    f[at.F_FORM_WEIGHT], f[at.F_SHOWN_LAPS], f[at.F_FORM], f[at.F_LUCK] = weight, n, 0.03, -0.02
    prior = np.diag([1 / (1 / form + weight), luck])
    h = np.array([1.0, 1.0])
    covariance = prior - np.outer(prior @ h, prior @ h) / (h @ prior @ h + noise / n)
    b = belief_of(figures, f)[:, CAR]
    assert b[B_PACE_SD] ** 2 == pytest.approx(covariance[0, 0], rel=1e-4)
    assert b[B_PACE_SD] * b[B_STINT_BY_PACE] == pytest.approx(covariance[0, 1], rel=1e-4)
    assert b[B_STINT_BY_PACE] ** 2 + b[B_STINT_SD] ** 2 == pytest.approx(covariance[1, 1], rel=1e-4)
    assert b[B_PACE] == pytest.approx(figures.cars[at.C_PACE, CAR] + 0.03, abs=1e-6)
    assert b[B_STINT] == pytest.approx(-0.02)
