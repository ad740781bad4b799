"""Stable-Baselines3's DQN trains on the environment; skipped, saying so, where that library is not installed."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from synthetic_race import quiet, synthetic_race

from rsrl.environment import RaceEnv

ROOT = Path(__file__).parents[1]

pytestmark = [
    pytest.mark.sb3,
    pytest.mark.skipif(importlib.util.find_spec("stable_baselines3") is None, reason="Stable-Baselines3 is not installed"),
    pytest.mark.filterwarnings("default"),  # what that library and torch warn about is theirs
]


def test_its_checker_accepts_the_environment() -> None:
    from stable_baselines3.common.env_checker import check_env

    check_env(RaceEnv(synthetic_race()), warn=True)


def test_dqn_learns_to_finish_within_the_rules() -> None:
    from stable_baselines3 import DQN

    env = RaceEnv(synthetic_race(laps=8, plans=("S-H@4",), **quiet()))
    model = DQN(
        "MlpPolicy", env, learning_starts=500, train_freq=2, target_update_interval=200, exploration_fraction=0.6, learning_rate=1e-3,
        batch_size=64, seed=0, device="cpu",
    )  # fmt: skip
    model.learn(5_000)
    rewards, valid = [], []
    for number in range(10):
        observation, info = env.reset(seed=1) if number == 0 else env.reset()
        terminated, total = False, 0.0
        while not terminated:
            action = int(model.predict(observation, deterministic=True)[0])
            observation, reward, terminated, _, info = env.step(action)
            total += reward
        rewards.append(total)
        valid.append(info["valid"])
    assert all(valid)
    assert np.mean(rewards) > 0  # one who stops for no second compound, or for a tyre that is gone, loses 1000


def test_the_documented_example_runs() -> None:
    command = [sys.executable, str(ROOT / "examples" / "stable_baselines3_dqn.py"), "--steps", "600", "--races", "4"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ)
    assert done.returncode == 0, done.stderr
    rows = done.stdout.splitlines()
    assert [row[:24].strip() for row in rows] == ["", "Stable-Baselines3 DQN", "stay out while allowed"]
