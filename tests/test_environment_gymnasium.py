"""The Gymnasium environments: Gymnasium's own checker, seeds, resets, masks, outcomes, and the single one against the vectorised one."""

import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from synthetic_race import synthetic_race

from rsrl.environment import ENV_ID, RaceEnv, RaceVectorEnv
from rsrl.errors import RsrlError

RECORD = synthetic_race(retire_per_lap=0.02)


def call(mask: NDArray[np.int8], observation: NDArray[np.float32]) -> int:
    """A legal call that depends on the observation alone: boxes on about a lap in five."""
    code = int(abs(float(observation.sum())) * 1000) % 20
    return code % 4 if code < 4 and mask[code % 4] else int(np.flatnonzero(mask)[0])


def play(
    env: RaceEnv, observation: NDArray[np.float32], info: dict[str, Any]
) -> tuple[list[NDArray[np.float32]], list[float], dict[str, Any]]:
    """One race to its end: observations, rewards, last info."""
    observations, rewards, terminated = [observation], [], False
    while not terminated:
        observation, reward, terminated, truncated, info = env.step(call(info["action_mask"], observation))
        assert not truncated
        observations.append(observation)
        rewards.append(reward)
    return observations, rewards, info


@pytest.mark.parametrize("feature_set", ["full", "paper"])
def test_gymnasiums_checker_has_nothing_to_say(feature_set: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made = gymnasium.make(ENV_ID, race="bahrain-2023", driver="HAM", feature_set=feature_set)
        check_env(made.unwrapped)
        observation, info = made.reset(seed=1)  # and the passive checker that make() wraps around
        terminated = False
        while not terminated:
            assert observation in made.observation_space
            observation, _, terminated, _, info = made.step(call(info["action_mask"], observation))
        assert 1 <= info["position"] <= 20


def test_the_id_can_be_made_by_naming_the_package() -> None:
    assert isinstance(gymnasium.make(f"rsrl.environment:{ENV_ID}", race=RECORD).unwrapped, RaceEnv)


def test_a_seed_names_a_series_of_races() -> None:
    env = RaceEnv(RECORD)
    series = [env.reset(seed=9), env.reset(), env.reset()]
    again = [env.reset(seed=9), env.reset(), env.reset()]
    other = env.reset(seed=10)
    for (a, _), (b, _) in zip(series, again, strict=True):
        np.testing.assert_array_equal(a, b)
    ends = []
    for seed, resets in ((9, 1), (9, 2), (10, 1)):
        observation, info = env.reset(seed=seed)
        for _ in range(resets - 1):
            observation, info = env.reset()
        ends.append(np.concatenate(play(env, observation, info)[0]).tobytes())
    assert len(set(ends)) == 3
    assert other[0].shape == series[0][0].shape


def test_without_a_seed_races_differ_between_environments() -> None:
    def first_laps() -> bytes:
        env = RaceEnv(RECORD)
        env.reset()
        return env.step(0)[0].tobytes()

    assert len({first_laps() for _ in range(4)}) > 1


def test_what_is_returned_is_the_callers_to_keep() -> None:
    env = RaceEnv(RECORD)
    observation, info = env.reset(seed=3)
    kept, mask = observation.copy(), info["action_mask"].copy()
    env.step(0)
    np.testing.assert_array_equal(observation, kept)
    np.testing.assert_array_equal(info["action_mask"], mask)


def test_the_last_info_tells_how_the_race_ended() -> None:
    env = RaceEnv(RECORD)
    observation, info = env.reset(seed=1)
    infos = []
    for _ in range(40):
        assert "position" not in info
        _, rewards, info = play(env, observation, info)
        infos.append(info)
        points = (25, 18, 15, 12, 10, 8, 6, 4, 2, 1)
        assert rewards[-1] in {-10.0, 0.0, *(100.0 * p for p in points)}
        observation, info = env.reset()
    assert any(i["retired"] for i in infos)
    assert all(i["valid"] for i in infos if not i["retired"])
    assert not any(i["failed"] for i in infos)
    assert {type(infos[0][n]) for n in ("position", "stops")} == {int}
    assert all(1 <= i["position"] <= 20 for i in infos)


def test_a_call_without_a_set_ends_the_race_as_a_failure() -> None:
    env = RaceEnv(synthetic_race(sets=(1, 2, 1), plans=("S-H@3",)))
    env.reset(seed=1)
    _, reward, terminated, truncated, info = env.step(1)
    assert (reward, terminated, truncated) == (-1000.0, True, False)
    assert info["failed"]
    assert not info["valid"]
    assert info["position"] == 20


def test_masks_of_both_kinds_agree() -> None:
    env = RaceEnv(RECORD)
    _, info = env.reset(seed=2)
    np.testing.assert_array_equal(info["action_mask"].astype(bool), env.action_masks())
    assert info["action_mask"].dtype == np.int8  # what Discrete.sample(mask) asks for
    assert env.action_space.sample(info["action_mask"]) in range(4)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"race": "atlantis-2023"}, "unknown race 'atlantis-2023'"),
        ({"driver": "XXX"}, "unknown driver 'XXX'"),
        ({"feature_set": "half"}, "unknown feature set 'half'"),
    ],
)
def test_unknown_names_are_refused_by_both_faces(options: dict[str, Any], message: str) -> None:
    with pytest.raises(RsrlError, match=message):
        gymnasium.make(ENV_ID, **options)
    with pytest.raises(RsrlError, match=message):
        gymnasium.make_vec(ENV_ID, num_envs=2, **options)


def test_misuse_is_refused() -> None:
    env = RaceEnv(RECORD)
    with pytest.raises(RsrlError, match="call reset"):
        env.step(0)
    env.reset(seed=1)
    for action in (4, -1, 1.5):
        with pytest.raises(RsrlError, match="action is"):
            env.step(action)  # type: ignore[arg-type]
    with pytest.raises(RsrlError, match="no options, found race"):
        env.reset(options={"race": "bahrain-2023"})
    with pytest.raises(RsrlError, match="below 2"):
        env.reset(seed=2**64)
    vector = RaceVectorEnv(2, RECORD)
    with pytest.raises(RsrlError, match="call reset"):
        vector.step(np.zeros(2, np.int64))
    vector.reset(seed=1)
    for actions in (np.zeros(3, np.int64), np.array([0, 4]), np.array([0, -1]), np.zeros(2)):
        with pytest.raises(RsrlError, match="actions must be 2 whole numbers"):
            vector.step(actions)  # type: ignore[arg-type]
    with pytest.raises(RsrlError, match="one seed"):
        vector.reset(seed=[1, 2])  # type: ignore[arg-type]
    with pytest.raises(RsrlError, match="num_envs is 0"):
        RaceVectorEnv(0, RECORD)


def test_the_vector_face_is_the_single_face_many_times() -> None:
    n, steps, seed = 5, 90, 4
    single = RaceEnv(RECORD)
    observation, info = single.reset(seed=seed)
    episodes = []
    for _ in range(20 * n):
        episodes.append(play(single, observation, info))
        observation, info = single.reset()

    vector = gymnasium.make_vec(ENV_ID, num_envs=n, race=RECORD)
    assert isinstance(vector.unwrapped, RaceVectorEnv)
    assert vector.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    observations, infos = vector.reset(seed=seed)
    race, lap = np.arange(n), np.zeros(n, int)
    ended = np.zeros(n, bool)
    finished = 0
    for _ in range(steps):
        assert observations in vector.observation_space
        actions = np.array([call(m, o) for m, o in zip(infos["action_mask"], observations, strict=True)])
        observations, rewards, terminated, truncated, infos = vector.step(actions)
        assert not truncated.any()
        for i in range(n):
            if ended[i]:  # the step after the last one starts the next race, whatever the action
                race[i], lap[i] = race[i] + n, 0
                assert (rewards[i], terminated[i]) == (0.0, False)
            else:
                lap[i] += 1
                assert rewards[i] == episodes[race[i]][1][lap[i] - 1]
            expected, _, outcome = episodes[race[i]]
            np.testing.assert_array_equal(observations[i], expected[lap[i]])
            assert terminated[i] == (lap[i] == len(expected) - 1)
            if terminated[i]:
                finished += 1
                assert all(infos[name][i] == outcome[name] and infos[f"_{name}"][i] for name in ("position", "valid", "retired", "stops"))
        ended = terminated
    assert finished > 3 * n
