"""Partial pooling: groups with much data keep their own figure, groups without take the mean, and errors say which."""

import numpy as np
import pytest

from rsrl.calibration.entry import RaceKey
from rsrl.calibration.pooling.hazards import pool_rates
from rsrl.calibration.pooling.mixed_effects import Group, block_diagonal, fit_mixed
from rsrl.calibration.pooling.pit import fit_tail
from rsrl.calibration.pooling.scalars import Spread, pool_scalar
from rsrl.calibration.pooling.traffic import EarlierPassing, carried_over, pool_passing
from rsrl.calibration.race.passing import PassingGrid, passing_grid
from rsrl.season import Figure

SPREAD = Spread(20.0, 5.0, 2.0, 0.3, 0.3)


def race_at(track: str, season: int, number: int) -> RaceKey:
    return RaceKey(season, number, track, 57, {})


def figures_of_races(rng: np.random.Generator, tracks: int, seasons: int) -> tuple[list[tuple[RaceKey, Figure]], dict[str, float]]:
    own = {f"t{i}": 20.0 + 2.0 * z for i, z in enumerate(rng.normal(size=tracks))}
    values = [
        (race_at(t, 2000 + s, i), Figure(v + rng.normal(0, 0.3), 0.3, 10)) for i, (t, v) in enumerate(own.items()) for s in range(seasons)
    ]
    return values, own


def test_a_track_with_data_keeps_its_own_and_one_without_gets_the_mean() -> None:
    values, own = figures_of_races(np.random.default_rng(0), 15, 3)
    pooled = pool_scalar(values, SPREAD, 0.05)
    for track, value in own.items():
        found = pooled.at(race_at(track, 2001, 99))
        assert found.value == pytest.approx(value, abs=0.8)
        assert found.se < 1.0
    unseen = pooled.at(race_at("nowhere", 2001, 99))
    assert unseen.value == pytest.approx(np.mean(list(own.values())), abs=0.6)
    assert unseen.se == pytest.approx(np.std(list(own.values())), rel=0.4)
    assert "0 of them here" in unseen.note


def test_a_loose_value_is_drawn_to_the_mean_and_a_tight_one_is_not() -> None:
    values, _ = figures_of_races(np.random.default_rng(1), 15, 3)
    loose, tight = race_at("loose", 2001, 50), race_at("tight", 2001, 51)
    pooled = pool_scalar([*values, (loose, Figure(24.0, 6.0, 2)), (tight, Figure(24.0, 0.1, 99))], SPREAD, 0.05)
    assert pooled.at(loose).value < 21.5
    assert pooled.at(tight).value > 23.5


def test_without_any_data_the_prior_stands_and_says_so() -> None:
    found = pool_scalar([], SPREAD, 0.05).at(race_at("t", 2023, 1))
    assert (found.value, found.n) == (20.0, 0)
    assert found.se > 5.0
    assert "assumed" in found.note


def test_intervals_of_unseen_tracks_hold_them_as_often_as_they_say() -> None:
    inside, total = 0, 0
    for seed in range(40):
        values, own = figures_of_races(np.random.default_rng(seed), 13, 2)
        left_out = list(own)[-3:]
        pooled = pool_scalar([v for v in values if v[0].grand_prix not in left_out], SPREAD, 0.05)
        for track in left_out:
            found = pooled.at(race_at(track, 2000, 90))
            inside += abs(found.value - own[track]) < 1.645 * found.se
            total += 1
    assert 0.82 < inside / total < 0.97


def test_mixed_model_is_a_plain_mean_where_nothing_is_shared() -> None:
    groups = {"mean": Group(100.0, 0.0, learned=False)}
    model = fit_mixed([1.0, 2.0, 6.0], [1.0, 1.0, 1.0], [{("mean", "all"): 1.0}] * 3, groups)
    value, se = model.predict({("mean", "all"): 1.0})
    assert value == pytest.approx(3.0, abs=1e-3)
    assert se == pytest.approx(3**-0.5, rel=1e-3)


def test_what_one_race_cannot_tell_apart_another_may() -> None:
    """Race one sees only the sum of two figures, race two only the first: together both are known."""
    groups = {"a": Group(50.0, 0.0, learned=False), "b": Group(50.0, 0.0, learned=False)}
    sharp = np.array([[1e-4]])
    rows = [{("a", "x"): 1.0, ("b", "x"): 1.0}, {("a", "x"): 1.0}]
    model = fit_mixed([5.0, 2.0], block_diagonal([sharp, sharp]), rows, groups)
    assert model.predict({("b", "x"): 1.0})[0] == pytest.approx(3.0, abs=0.01)
    assert model.predict({("b", "y"): 1.0}) == pytest.approx((0.0, 50.0))


def test_rates_of_like_groups_are_pooled_and_of_unlike_ones_kept() -> None:
    rng = np.random.default_rng(2)
    alike = pool_rates({f"t{i}": (float(rng.poisson(5)), 500.0) for i in range(25)}, usual=0.01)
    unlike = pool_rates({f"t{i}": (float(rng.poisson(1 if i % 2 else 25)), 500.0) for i in range(24)}, usual=0.01)
    assert alike.strength > 4 * unlike.strength
    assert unlike.at("t0", "x").value > 5 * unlike.at("t1", "x").value
    assert alike.factor("nowhere")[0] == pytest.approx(1.0)
    assert alike.at("nowhere", "x").value == pytest.approx(0.01, rel=0.2)


def test_without_an_event_the_rate_is_not_zero_but_below_the_usual_one() -> None:
    quiet = pool_rates({"a": (0.0, 170.0)}, usual=0.01)
    assert 0.006 < quiet.rate < 0.01
    assert pool_rates({}, usual=0.01).rate == pytest.approx(0.01)


def test_another_era_tells_groups_apart_but_not_the_rate() -> None:
    now = {"a": (2.0, 400.0), "b": (2.0, 400.0)}
    before = {"a": (60.0, 1000.0), "b": (20.0, 1000.0)}
    pooled = pool_rates(now, before, usual=0.005)
    assert pooled.rate == pytest.approx((4 + 4) / (800 + 4 / 0.005))
    assert pooled.at("a", "x").value > 1.5 * pooled.at("b", "x").value


def test_thresholds_of_tracks_are_told_apart_and_an_unseen_one_is_wide() -> None:
    rng = np.random.default_rng(3)
    races = []
    truths = {"easy": 0.6, "usual": 1.3, "hard": 2.4}
    for track, threshold in truths.items():
        for _ in range(3):
            gap, advantage = rng.uniform(0.3, 1.2, 400), rng.normal(0.8, 0.7, 400)
            raw = advantage + np.sqrt(2) * 0.2 * rng.normal(size=400)
            needed = threshold + 1.4 * (gap - 0.6)
            passed = (gap - raw < 0.55) & (rng.uniform(size=400) < 1 / (1 + np.exp(-(raw - needed) / 0.45)))
            races.append((track, passing_grid(gap, advantage, passed, 0.6, 0.2)))
    pooled = pool_passing(races)
    for track, threshold in truths.items():
        found = pooled.threshold(track)
        assert abs(found.value - threshold) < 3 * found.se + 0.06
        assert found.se < 0.25
    assert pooled.scale.value == pytest.approx(0.45, abs=0.12)
    assert pooled.per_gap.value == pytest.approx(1.4, abs=0.4)
    assert pooled.threshold("unseen").se > 0.4


def test_a_track_of_earlier_seasons_alone_is_believed_to_be_far_from_the_others() -> None:
    def grid(threshold: float, pairs: int) -> PassingGrid:
        rng = np.random.default_rng(int(10 * threshold))
        gap, raw = rng.uniform(0.3, 1.2, pairs), rng.normal(0.8, 0.7, pairs) + np.sqrt(2) * 0.2 * rng.normal(size=pairs)
        passed = (gap - raw < 0.55) & (rng.uniform(size=pairs) < 1 / (1 + np.exp(-(raw - threshold - 1.4 * (gap - 0.6)) / 0.45)))
        return passing_grid(gap, raw, passed, 0.6, 0.2)

    entries = {2023: ("bahrain", 1.0), 2024: ("spain", 1.2), 2025: ("canada", 1.4)}
    dry = [(RaceKey(season, 1, slug, 57, {}), grid(threshold, 600)) for season, (slug, threshold) in entries.items()]
    earlier = carried_over(dry, [EarlierPassing(2019, "monaco", grid(3.5, 1200)), EarlierPassing(2019, "bahrain", grid(3.5, 1200))])
    assert [circuit for circuit, _ in earlier] == ["monaco"]  # Bahrain has a dry race of its own
    pooled = pool_passing([(key.circuit, g) for key, g in dry], earlier)
    monaco = pooled.threshold("monaco")
    assert monaco.value > 2.2
    assert monaco.se > 2 * pooled.threshold("bahrain").se
    assert "earlier seasons" in monaco.note
    assert pooled.threshold("bahrain").value < 1.4


def test_log_logistic_tail_comes_back() -> None:
    rng = np.random.default_rng(3)
    u = rng.uniform(size=(40, 25))
    times = 0.9 * (u / (1 - u)) ** (1 / 2.4)
    excess = times - times.min(axis=1, keepdims=True)
    scale, shape = fit_tail(excess.ravel(), np.full(excess.size, 25.0))
    assert scale.value == pytest.approx(0.9, abs=0.06)
    assert shape.value == pytest.approx(2.4, abs=0.2)
    assert scale.se < 0.1
