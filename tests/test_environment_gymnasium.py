"""The Gymnasium environments: Gymnasium's own checker, seeds, resets, masks, outcomes, and the single one against the vectorised one."""

import re
import warnings
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from numpy.typing import NDArray
from synthetic_race import synthetic_race

import rsrl
from rsrl.environment import ENV_ID, RaceEnv, RaceVectorEnv, gymnasium_env
from rsrl.errors import RsrlError
from rsrl.season import RaceRecord

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
    assert isinstance(gymnasium.make(f"rsrl:{ENV_ID}", race=RECORD).unwrapped, RaceEnv)
    assert isinstance(gymnasium.make_vec(f"rsrl:{ENV_ID}", num_envs=2, race=RECORD).unwrapped, RaceVectorEnv)


@pytest.mark.parametrize("mode", ["ansi", "rgb_array"])
def test_gymnasiums_checker_accepts_each_render_mode(mode: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make(ENV_ID, race="bahrain-2023", driver="HAM", render_mode=mode).unwrapped)


def test_a_race_can_be_given_by_the_path_of_its_file() -> None:
    path = Path(rsrl.__file__).parent / "season" / "races" / "bahrain-2023.toml"
    made = [gymnasium.make(ENV_ID, race=race, driver="HAM").reset(seed=3)[0] for race in (path, str(path), "bahrain-2023")]
    np.testing.assert_array_equal(made[0], made[1])
    np.testing.assert_array_equal(made[0], made[2])


def test_a_driver_goes_to_the_season_as_typed(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str | None] = []

    def find_car(record: RaceRecord, driver: str | None) -> int:
        asked.append(driver)
        return 0

    monkeypatch.setattr(gymnasium_env, "find_car", find_car)
    for driver in (44, "44", "Hamilton", None):
        RaceEnv(RECORD, driver)
    assert asked == ["44", "44", "Hamilton", None]


def test_a_line_of_text_a_lap() -> None:
    env = RaceEnv(RECORD, render_mode="ansi")
    with pytest.raises(RsrlError, match="call reset"):
        env.render()
    observation, info = env.reset(seed=1)
    grid = env.render()
    assert isinstance(grid, str)
    assert grid.startswith(f"lap  0/{RECORD.laps}  P{RECORD.cars[env.environment.car].grid}")
    lines, calls, terminated = [], [], False
    while not terminated:
        calls.append(call(info["action_mask"], observation))
        observation, _, terminated, _, info = env.step(calls[-1])
        lines.append(env.render())
    for lap, (line, made) in enumerate(zip(lines, calls, strict=True), 1):
        assert isinstance(line, str)
        assert "\n" not in line
        assert line.startswith(f"lap {lap:2}/{RECORD.laps}  P")
        assert ("stay out", "box for soft", "box for medium", "box for hard")[made] in line
        assert re.search(r"(soft|medium|hard) (1 lap|\d+ laps)  ", line)
        assert "ahead" in line
        assert "behind" in line
    assert str(lines[-1]).endswith(f"{'retired,' if info['retired'] else 'finished'} P{info['position']}")
    boxed = next(i for i, made in enumerate(calls[:-1]) if made)
    assert f"{('soft', 'medium', 'hard')[calls[boxed] - 1]} 0 laps" in str(lines[boxed])
    env.reset()
    assert "on the grid" in str(env.render())


def test_a_picture_grows_with_the_race() -> None:
    env = RaceEnv(RECORD, render_mode="rgb_array")
    _, info = env.reset(seed=1)
    pictures = [env.render()]
    for _ in range(3):
        *_, info = env.step(int(np.flatnonzero(info["action_mask"])[0]))
        pictures.append(env.render())
    for picture in pictures:
        assert isinstance(picture, np.ndarray)
        assert picture.shape == (320, 480, 3)
        assert picture.dtype == np.dtype(np.uint8)
    assert len({np.asarray(picture).tobytes() for picture in pictures}) == 4
    np.testing.assert_array_equal(np.asarray(pictures[-1]), np.asarray(env.render()))


def test_rendering_changes_no_race() -> None:
    plain, shown = RaceEnv(RECORD), RaceEnv(RECORD, render_mode="ansi")
    assert RaceEnv(RECORD).render_mode is None
    for env in (plain, shown):
        env.reset(seed=2)
    assert plain.render() is None
    for _ in range(4):
        np.testing.assert_array_equal(plain.step(0)[0], shown.step(0)[0])
        shown.render()


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_one_race_side_by_side_is_gymnasiums_own_vector_of_one(mode: AutoresetMode) -> None:
    """Observations, rewards, ends and all of `info`, key by key and type by type, over several races."""
    theirs: Any = SyncVectorEnv([lambda: RaceEnv(RECORD)], autoreset_mode=mode)
    ours: Any = gymnasium.make_vec(ENV_ID, num_envs=1, race=RECORD, autoreset_mode=mode)
    assert ours.metadata["autoreset_mode"] is mode
    observations, infos = theirs.reset(seed=4)
    same((observations, infos), ours.reset(seed=4))
    ended = 0
    for _ in range(3 * RECORD.laps):
        actions = np.array([call(infos["action_mask"][0], observations[0])])
        step = theirs.step(actions)
        same(step, ours.step(actions))
        observations, _, terminated, _, infos = step
        ended += int(terminated[0])
    assert ended >= 2


def same(a: Any, b: Any) -> None:
    """Raise where two results of an environment differ."""
    if isinstance(a, dict):
        assert set(a) == set(b)
        for name in a:
            same(a[name], b[name])
    elif isinstance(a, tuple):
        assert len(a) == len(b)
        for one, other in zip(a, b, strict=True):
            same(one, other)
    elif isinstance(a, np.ndarray) and a.dtype == object:
        assert [one is None for one in a] == [other is None for other in b]
        for one, other in zip(a, b, strict=True):
            same(one, other)
    else:
        np.testing.assert_array_equal(a, b)


def test_same_step_goes_on_with_the_next_race_of_each_row() -> None:
    n = 5
    later = RaceVectorEnv(n, RECORD)
    at_once = RaceVectorEnv(n, RECORD, autoreset_mode="SameStep")
    seen: list[list[list[bytes]]] = []
    for env in (later, at_once):
        observations, infos = env.reset(seed=4)
        races: list[list[bytes]] = [[observation.tobytes()] for observation in observations]
        done: list[list[bytes]] = []
        resting = np.zeros(n, bool)
        for _ in range(3 * RECORD.laps):
            actions = np.array([call(m, o) for m, o in zip(infos["action_mask"], observations, strict=True)])
            observations, _, ended, _, infos = env.step(actions)
            for i in range(n):
                if resting[i]:
                    races[i] = [observations[i].tobytes()]
                elif ended[i] and env is at_once:
                    assert infos["_final_obs"][i]
                    assert infos["final_info"]["_position"][i]
                    done.append([*races[i], infos["final_obs"][i].tobytes()])
                    races[i] = [observations[i].tobytes()]
                else:
                    races[i].append(observations[i].tobytes())
                    if ended[i]:
                        done.append(races[i])
            resting = ended if env is later else np.zeros(n, bool)
        seen.append(done)
    assert len(seen[0]) > 2 * n
    known = {tuple(race) for race in seen[1]}
    assert sum(tuple(race) in known for race in seen[0]) == len(seen[0])


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
        ({"race": Path("atlantis-2023")}, "unknown race 'atlantis-2023'"),
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
    with pytest.raises(RsrlError, match="autoreset_mode is 'never'; there are 'NextStep', 'SameStep'"):
        RaceVectorEnv(2, RECORD, autoreset_mode="never")
    with pytest.raises(RsrlError, match="races side by side are not drawn"):
        RaceVectorEnv(2, RECORD, render_mode="ansi")
    with pytest.raises(RsrlError, match="unknown render mode 'human'"):
        RaceEnv(RECORD, render_mode="human")


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
