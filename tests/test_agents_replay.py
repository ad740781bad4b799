import numpy as np
import pytest

from rsrl.agents.replay import Races, Replay

LAPS = 7


def races(first: int, lengths: list[int]) -> Races:
    """Races number `first`, `first` + 1 ... of these lengths; a lap's reward is 100 times its race plus the lap, its features both."""
    made = Races.empty(LAPS, len(lengths), 2)
    for i, laps in enumerate(lengths):
        made.laps[i] = laps
        for lap in range(laps + 1):
            made.features[lap, i] = first + i, lap
        for lap in range(laps):
            made.action[lap, i] = lap % 4
            made.reward[lap, i] = 100 * (first + i) + lap
    return made


def filled(capacity: int, lengths: list[int]) -> Replay:
    replay = Replay(capacity, LAPS, 2)
    for first in range(0, len(lengths), 2):
        replay.add(races(first, lengths[first : first + 2]))
    return replay


def test_the_oldest_races_make_room() -> None:
    replay = filled(3, [7, 3, 5, 2])
    assert replay.size == 3
    assert sorted(replay.races.laps.tolist()) == [2, 3, 5]
    assert sorted(replay.races.features[0, :, 0].tolist()) == [1.0, 2.0, 3.0]


@pytest.mark.parametrize("capacity", [3, 10])
def test_laps_are_sampled_uniformly_from_those_driven(capacity: int) -> None:
    lengths = [7, 3, 5, 2]
    laps = filled(capacity, lengths).sample_laps(np.random.default_rng(0), (40, 50))
    kept = range(len(lengths) - min(capacity, len(lengths)), len(lengths))
    driven = [(race, lap) for race in kept for lap in range(lengths[race])]
    race, lap = laps.features[..., 0].astype(int), laps.features[..., 1].astype(int)
    shares = [np.mean((race == r) & (lap == n)) for r, n in driven]
    assert sum(shares) == pytest.approx(1.0)
    np.testing.assert_allclose(shares, 1 / len(driven), atol=4 * (1 / len(driven) / 2000) ** 0.5)
    assert (laps.reward == 100 * race + lap).all()
    assert (laps.action == lap % 4).all()
    assert (laps.next_features == laps.features + np.array([0, 1])).all()
    assert (laps.ended == (lap == np.array(lengths)[race] - 1)).all()


def test_races_are_sampled_whole() -> None:
    lengths = np.array([7, 3, 5, 2])
    sampled = filled(10, lengths.tolist()).sample_races(np.random.default_rng(0), 20, 6)
    assert sampled.features.shape == (20, LAPS + 1, 6, 2)
    assert sampled.laps.shape == (20, 6)
    race = sampled.features[:, 0, :, 0].astype(int)
    assert set(race.ravel().tolist()) == {0, 1, 2, 3}
    assert (sampled.laps == lengths[race]).all()
    for lap in range(LAPS):
        driven = lap < sampled.laps
        assert (sampled.features[:, lap, :, 1] == lap)[driven].all()
        assert (sampled.reward[:, lap] == 100 * race + lap)[driven].all()
        assert (sampled.action[:, lap] == lap % 4)[driven].all()


def test_a_restored_buffer_goes_on_as_the_saved_one() -> None:
    old, new = filled(3, [7, 3, 5, 2]), Replay(3, LAPS, 2)
    new.restore({name: value.copy() for name, value in old.state().items()})
    for replay in (old, new):
        replay.add(races(4, [6]))
    one, two = (r.sample_races(np.random.default_rng(5), 3, 4) for r in (old, new))
    assert all(np.array_equal(getattr(one, name), getattr(two, name)) for name in Races._fields)
