"""Whole races driven in batch by the current policy with experiments: what RSRL's learner learns from."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.agents.config import RsrlConfig
from rsrl.agents.exploration import Experiments, explore
from rsrl.agents.interface import TrainingEnvironment
from rsrl.agents.networks import N_ACTIONS, Network, Params, greedy_actions


class Races(NamedTuple):
    """A batch of races, cut into minibatches: N minibatches, T laps, B races each.

    Attributes:
        features: before each decision, float32 [N, T, B, F].
        legal: bool [N, T, B, 4].
        actions: int8 [N, T, B].
        rewards: in the environment's units, float32 [N, T, B].
        running: the race was still running before the decision, bool [N, T, B].
        followed: the decision was the greedy one, bool [N, T, B].
    """

    features: NDArray[np.float32]
    legal: NDArray[np.bool_]
    actions: NDArray[np.int8]
    rewards: NDArray[np.float32]
    running: NDArray[np.bool_]
    followed: NDArray[np.bool_]


def empty_races(config: RsrlConfig, environment: TrainingEnvironment) -> Races:
    """Room for one iteration's races."""
    shape = (config.races // config.minibatch_races, environment.laps, config.minibatch_races)
    return Races(
        np.zeros((*shape, environment.n_features), np.float32),
        np.zeros((*shape, N_ACTIONS), np.bool_),
        np.zeros(shape, np.int8),
        np.zeros(shape, np.float32),
        np.zeros(shape, np.bool_),
        np.zeros(shape, np.bool_),
    )


def collect(
    out: Races,
    config: RsrlConfig,
    environment: TrainingEnvironment,
    network: Network,
    params: Params,
    races: tuple[int, NDArray[np.int64]],
    experiments: Experiments,
) -> None:
    """Drive the races named `races` (seed, race numbers) and write them to `out`."""
    groups, _, group_races = out.actions.shape[:3]
    split = (groups, group_races)
    seen = environment.reset(*races)
    memory = np.zeros((groups * group_races, network.memory_size), np.float32)
    running = np.ones(groups * group_races, np.bool_)
    for lap in range(environment.laps):
        features, legal = seen.features, seen.legal
        out.features[:, lap] = features.reshape(*split, -1)
        out.legal[:, lap] = legal.reshape(*split, N_ACTIONS)
        out.running[:, lap] = running.reshape(split)
        q, memory = network.step(params, features, memory)
        greedy = greedy_actions(q, legal)
        actions = explore(experiments, lap, greedy, legal, config.pit_chance, config.delay_chance)
        out.actions[:, lap] = actions.reshape(split)
        out.followed[:, lap] = (actions == greedy).reshape(split)
        seen = environment.step(actions)
        out.rewards[:, lap] = seen.reward.reshape(split)
        running = running & ~(seen.terminated | seen.truncated)
