import numpy as np
import pytest

from rsrl.agents.replay import Replay
from rsrl.errors import RsrlError


def filled(capacity: int, race_laps: list[int]) -> Replay:
    """Races one after another; a lap's reward is its number since the beginning, its features the lap of its race."""
    replay, count = Replay(capacity, 1), 0
    for laps in race_laps:
        for lap in range(laps):
            replay.add([lap], lap % 4, float(count), [lap + 1], lap == laps - 1, first=lap == 0)
            count += 1
    return replay


def test_the_oldest_laps_make_room() -> None:
    replay = filled(5, [4, 4])
    assert replay.size == 5
    assert sorted(replay.laps.reward.tolist()) == [3.0, 4.0, 5.0, 6.0, 7.0]


def test_samples_are_whole_laps() -> None:
    laps = filled(100, [7, 3, 5]).sample(np.random.default_rng(0), 200)
    assert (laps.next_features == laps.features + 1).all()
    assert set(laps.reward.tolist()) == set(map(float, range(15)))


@pytest.mark.parametrize("capacity", [100, 11])
def test_a_sequence_stays_within_one_race_and_in_order(capacity: int) -> None:
    replay = filled(capacity, [7, 3, 5])
    laps, counts = replay.sample_sequences(np.random.default_rng(0), 300, 4)
    assert counts[0].all()
    assert not (counts[1:] & ~counts[:-1]).any()  # once over, over
    both = counts[1:] & counts[:-1]
    assert (laps.reward[1:] == laps.reward[:-1] + 1)[both].all()
    assert not (laps.ended[:-1] & both).any()
    assert (laps.features[1:] == laps.next_features[:-1])[both].all()
    assert counts.sum(axis=0).max() == 4


def test_a_sequence_stops_at_the_newest_lap_of_a_race_under_way() -> None:
    replay = Replay(6, 1)
    for lap in range(8):
        replay.add([lap], 0, float(lap), [lap + 1], False, first=lap == 0)
    laps, counts = replay.sample_sequences(np.random.default_rng(0), 100, 4)
    assert laps.reward[counts].min() == 2.0
    assert (counts.sum(axis=0) == np.minimum(8 - laps.reward[0], 4)).all()


def test_a_restored_buffer_goes_on_as_the_saved_one() -> None:
    old, new = filled(11, [7, 3, 5]), Replay(11, 1)
    new.restore({name: value.copy() for name, value in old.state().items()})
    one, two = (r.sample_sequences(np.random.default_rng(5), 50, 4) for r in (old, new))
    assert (one[0].reward == two[0].reward).all()
    assert (one[1] == two[1]).all()
    with pytest.raises(RsrlError, match="another size"):
        Replay(12, 1).restore(old.state())
