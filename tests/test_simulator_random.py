"""The random streams: uniform, unrelated to each other, and of the distributions their tables promise."""

import numba
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from rsrl.simulator import random as rng

RACES, LAPS, CARS = 40, 60, 20
SIGMAS = 5.0  # tests are derandomised: this is how far chance may be from its mean, once and for all


@numba.njit
def fill(seed, first_race, words):  # type: ignore[no-untyped-def]
    """Draws of words[purpose, race, lap, car]."""
    for race in range(words.shape[1]):
        key0, key1 = rng.race_keys(seed, first_race + race)
        for purpose in range(words.shape[0]):
            for lap in range(words.shape[2]):
                for car in range(words.shape[3]):
                    words[purpose, race, lap, car] = rng.draw(key0, key1, lap, car, purpose)


@numba.njit
def through_table(words, table, out):  # type: ignore[no-untyped-def]
    for i in range(words.shape[0]):
        out[i] = rng.from_table(words[i], table)


@numba.njit
def to_unit(words, out):  # type: ignore[no-untyped-def]
    for i in range(words.shape[0]):
        out[i] = rng.unit(words[i])


def drawn(seed: int, first_race: int = 0) -> NDArray[np.uint32]:
    words = np.empty((10, RACES, LAPS, CARS), np.uint32)
    fill(seed, first_race, words)
    return words


WORDS = drawn(1)
UNIT = WORDS / 2.0**32


def test_every_draw_is_its_own() -> None:
    """Among n draws of 32 bits about n^2 / 2^33 pairs are alike; a counter that collides would give whole rows of them."""
    n = WORDS.size
    alike = n - len(np.unique(WORDS))
    expected = n * n / 2**33
    assert abs(alike - expected) < SIGMAS * np.sqrt(expected)
    a = drawn(1)
    np.testing.assert_array_equal(a, WORDS)
    assert np.mean(drawn(2) == WORDS) < 1e-4
    np.testing.assert_array_equal(drawn(1, 3)[:, : RACES - 3], WORDS[:, 3:])


@pytest.mark.parametrize("purpose", range(10))
def test_draws_of_a_purpose_are_uniform(purpose: int) -> None:
    u = UNIT[purpose].ravel()
    n = len(u)
    assert abs(u.mean() - 0.5) < SIGMAS * np.sqrt(1 / 12 / n)
    assert abs(u.var() - 1 / 12) < SIGMAS * np.sqrt(1 / 180 / n)
    assert stats.chisquare(np.bincount((u * 256).astype(int), minlength=256)).pvalue > 1e-5
    bits = (WORDS[purpose].ravel()[:, None] >> np.arange(32, dtype=np.uint32)) & 1
    assert np.abs(bits.mean(axis=0) - 0.5).max() < SIGMAS * 0.5 / np.sqrt(n)


@pytest.mark.parametrize("axis", [0, 1, 2, 3], ids=["purposes", "races", "laps", "cars"])
@pytest.mark.parametrize("lag", [1, 2, 7])
def test_neighbouring_draws_are_not_correlated(axis: int, lag: int) -> None:
    x = np.moveaxis(UNIT, axis, 0)
    a, b = x[:-lag].ravel(), x[lag:].ravel()
    assert abs(np.corrcoef(a, b)[0, 1]) < SIGMAS / np.sqrt(len(a))
    assert abs(np.corrcoef((a - 0.5) ** 2, (b - 0.5) ** 2)[0, 1]) < SIGMAS / np.sqrt(len(a))


def test_neighbouring_seeds_are_not_correlated() -> None:
    a, b = UNIT.ravel(), (drawn(2) / 2.0**32).ravel()
    assert abs(np.corrcoef(a, b)[0, 1]) < SIGMAS / np.sqrt(len(a))


def test_unit_draws_stay_inside_the_open_interval() -> None:
    words = np.array([0, 255, 256, 2**31, 2**32 - 1], np.uint32)
    out = np.empty(len(words), np.float32)
    to_unit(words, out)
    assert out.min() > 0.0
    assert out.max() < 1.0
    np.testing.assert_allclose(out, (words >> 9) * 2.0**-23 + 2.0**-24, rtol=0)


def test_the_normal_table_is_standard_normal() -> None:
    words = WORDS[:4].ravel()
    z = np.empty(len(words), np.float32)
    through_table(words, rng.NORMAL, z)
    n = len(z)
    assert abs(z.mean()) < SIGMAS / np.sqrt(n)
    assert abs(z.var() - 1) < SIGMAS * np.sqrt(2 / n)
    assert abs(stats.skew(z)) < SIGMAS * np.sqrt(6 / n)
    grid = np.linspace(0.01, 0.99, 99)
    np.testing.assert_allclose(np.quantile(z, grid), stats.norm.ppf(grid), atol=0.03)
    np.testing.assert_array_equal(rng.NORMAL, -rng.NORMAL[::-1])
    exact = rng.NORMAL.astype(float)  # variance of the interpolated quantile function, in closed form
    assert np.mean((exact[:-1] ** 2 + exact[:-1] * exact[1:] + exact[1:] ** 2) / 3) == pytest.approx(1.0, abs=1e-6)


def test_the_logistic_table_is_standard_logistic() -> None:
    words = WORDS[4:8].ravel()
    z = np.empty(len(words), np.float32)
    through_table(words, rng.LOGISTIC, z)
    grid = np.linspace(0.01, 0.99, 99)
    np.testing.assert_allclose(np.quantile(z, grid), stats.logistic.ppf(grid), atol=0.05)


def test_an_inlined_kernel_says_that_python_cannot_call_it() -> None:
    with pytest.raises(TypeError, match="unit is inlined"):
        rng.unit(np.uint32(1))
