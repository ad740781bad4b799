"""Train Stable-Baselines3's DQN to call the 2023 Bahrain Grand Prix, then compare it with staying out until the rules force a stop.

    pip install rsrl stable-baselines3
    python examples/stable_baselines3_dqn.py --steps 200000

DQN of that library knows no action mask: it finds out by -1000 which tyres are gone. The mask is in `info["action_mask"]`
for those that do.
"""

import argparse
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray
from stable_baselines3 import DQN

from rsrl.environment import ENV_ID

Caller = Callable[[NDArray[np.float32], dict[str, Any]], int]
TEST_SEED = 7


def make(race: str, driver: str | None) -> gymnasium.Env[Any, Any]:
    """The environment with the rewards in units of a thousand, which suits the learner's usual step size."""
    return gymnasium.wrappers.TransformReward(
        gymnasium.make(ENV_ID, race=race, driver=driver, feature_set="full"), lambda r: float(r) / 1000
    )


def train(env: gymnasium.Env[Any, Any], steps: int, seed: int) -> DQN:
    """DQN with a memory of 100,000 laps and exploration that fades over the first half of training."""
    model = DQN(
        "MlpPolicy", env, learning_rate=5e-4, buffer_size=100_000, learning_starts=min(5_000, steps // 2), batch_size=128, gamma=1.0,
        train_freq=8, target_update_interval=2_000, exploration_fraction=0.5, exploration_final_eps=0.01, seed=seed, device="cpu",
    )  # fmt: skip
    return model.learn(steps)


def evaluate(env: gymnasium.Env[Any, Any], caller: Caller, races: int) -> tuple[float, float, float]:
    """Mean finishing position, stops and share of invalid races over the same races of a seed that training has not used."""
    ends = []
    for number in range(races):
        observation, info = env.reset(seed=TEST_SEED) if number == 0 else env.reset()
        terminated = False
        while not terminated:
            observation, _, terminated, _, info = env.step(caller(observation, info))
        ends.append((info["position"], info["stops"], not (info["valid"] or info["retired"])))
    position, stops, invalid = np.mean(ends, axis=0)
    return float(position), float(stops), float(invalid)


def main() -> None:
    """Train, evaluate, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--race", default="bahrain-2023")
    parser.add_argument("--driver", default=None, help="three letters; the race's default driver if left out")
    parser.add_argument("--steps", type=int, default=200_000, help="laps to train for")
    parser.add_argument("--races", type=int, default=300, help="races to compare on")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()

    env = make(arguments.race, arguments.driver)
    model = train(env, arguments.steps, arguments.seed)
    callers: dict[str, Caller] = {
        "Stable-Baselines3 DQN": lambda observation, info: int(model.predict(observation, deterministic=True)[0]),
        "stay out while allowed": lambda observation, info: int(np.flatnonzero(info["action_mask"])[0]),
    }
    print(f"{'':24s}{'position':>10s}{'stops':>8s}{'invalid':>9s}")
    for name, caller in callers.items():
        position, stops, invalid = evaluate(env, caller, arguments.races)
        print(f"{name:24s}{position:10.2f}{stops:8.2f}{invalid:9.1%}")


if __name__ == "__main__":
    main()
