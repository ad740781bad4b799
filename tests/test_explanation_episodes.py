"""The recorder of driven races: what is kept of each step, who drives, who labels, and the moments made from it."""

import numpy as np
import pytest

from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.explanation import Episodes, ExplainedPolicy, load_explained, reach, record_episode
from rsrl.explanation.episodes import EpisodeRecorder
from rsrl.explanation.tree import TreeRecorder, side_by_side
from rsrl.season import RaceRecord
from rsrl.state import COLUMN
from rsrl.strategists import make_strategist

CAR = 6
RACES = 12


@pytest.fixture(scope="module")
def policy() -> ExplainedPolicy:
    return load_explained("all")


@pytest.fixture(scope="module")
def episodes(policy: ExplainedPolicy, bahrain: RaceRecord) -> Episodes:
    return EpisodeRecorder(bahrain, CAR, RACES, policy, states=True, postpone=True).record(8, 100)


def test_the_policy_drives_what_it_labels(policy: ExplainedPolicy, bahrain: RaceRecord, episodes: Episodes) -> None:
    running = episodes.running
    np.testing.assert_array_equal(episodes.calls[running], episodes.labels[running])
    np.testing.assert_array_equal(policy.chosen(episodes.q[running], episodes.legal[running]), episodes.labels[running])
    environment, strategist = RaceEnvironment(bahrain, CAR, batch=RACES), policy.strategist(bahrain)
    environment.reset(8, episodes.races)
    strategist.begin(environment, 8, episodes.races)
    for step in range(bahrain.laps):
        np.testing.assert_array_equal(episodes.running[step], ~environment.done)
        np.testing.assert_array_equal(episodes.raw[step][running[step]], environment.raw[running[step]])
        np.testing.assert_array_equal(episodes.rewards[step], environment.step(strategist.decide(environment)).reward)
    np.testing.assert_array_equal(episodes.outcome.position, environment.outcome().position)


def test_another_driver_is_labelled_by_the_policy(policy: ExplainedPolicy, bahrain: RaceRecord) -> None:
    fixed = make_strategist("fixed", bahrain, CAR)
    labelled = EpisodeRecorder(bahrain, CAR, RACES, policy).record(8, 100, fixed)
    alone = EpisodeRecorder(bahrain, CAR, RACES).record(8, 100, fixed)
    np.testing.assert_array_equal(labelled.calls, alone.calls)
    assert (labelled.calls != labelled.labels)[labelled.choices].any()
    assert np.isnan(alone.q).all()
    assert (alone.labels == -1).all()


def test_a_moment_of_a_recorded_race_is_the_one_reached_by_driving(
    policy: ExplainedPolicy, bahrain: RaceRecord, episodes: Episodes
) -> None:
    race = int(np.flatnonzero(episodes.running[29])[0])
    moment = episodes.moment(30, race)
    reached = reach(policy.strategist(bahrain), bahrain, CAR, 30, seed=8, race=100 + race)
    assert (moment.seed, moment.race, moment.lap) == (reached.seed, reached.race, reached.lap) == (8, 100 + race, 30)
    for one, other in zip(
        (moment.raw, moment.legal, moment.calls, *moment.arrays), (reached.raw, reached.legal, reached.calls, *reached.arrays), strict=True
    ):
        np.testing.assert_array_equal(one, other)
    with pytest.raises(RsrlError, match="lap 58 is outside the race"):
        reach(policy.strategist(bahrain), bahrain, CAR, 58)


def test_a_postponed_stop_is_the_same_race_one_lap_later_without_the_stop(episodes: Episodes) -> None:
    postponed = episodes.postponed
    assert postponed is not None
    assert postponed.running.any()
    assert (episodes.calls[postponed.running] > 0).all()
    age = COLUMN["tyre_age_laps"]
    np.testing.assert_array_equal(postponed.raw[postponed.running][:, age], episodes.raw[postponed.running][:, age] + 1)
    np.testing.assert_array_equal(
        postponed.raw[postponed.running][:, COLUMN["stops_made"]], episodes.raw[postponed.running][:, COLUMN["stops_made"]]
    )


def test_batches_side_by_side_keep_their_races(policy: ExplainedPolicy, bahrain: RaceRecord) -> None:
    recorder = TreeRecorder(policy, bahrain, CAR, ("laps_left", "position"), 4, postpone=True)
    parts = [recorder.record(8, first) for first in (0, 4)]
    both = side_by_side(parts)
    np.testing.assert_array_equal(both.races, np.arange(8))
    np.testing.assert_array_equal(both.rows[:, 4:], parts[1].rows)
    np.testing.assert_array_equal(both.outcome.position, np.concatenate([part.outcome.position for part in parts]))
    assert both.postponed is not None
    assert both.postponed.q.shape == (bahrain.laps, 8, 4)
    assert both.record is bahrain


def test_an_episode_ends_with_its_race(policy: ExplainedPolicy, bahrain: RaceRecord, episodes: Episodes) -> None:
    retired = np.flatnonzero(episodes.outcome.retired)
    for race in (*retired[:1], *np.flatnonzero(~episodes.outcome.retired)[:1]):
        episode = record_episode(policy, bahrain, CAR, seed=8, race=int(episodes.races[race]))
        assert episode.laps == episodes.running[:, race].sum()
        assert (episode.position, episode.retired) == (episodes.outcome.position[race], episodes.outcome.retired[race])
        np.testing.assert_array_equal(episode.raw, episodes.raw[: episode.laps, race])


def test_the_range_of_features_covers_what_was_driven_and_nothing_beyond(episodes: Episodes) -> None:
    rows = episodes.raw[episodes.choices]
    assert all(episodes.covers(row) for row in rows[::50])
    beyond = rows[0].copy()
    beyond[COLUMN["tyre_age_laps"]] = rows[:, COLUMN["tyre_age_laps"]].max() + 1
    assert not episodes.covers(beyond)
