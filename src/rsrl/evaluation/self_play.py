"""A policy among rivals that are called by a policy too: does its lead remain without rivals who call as teams do?"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rsrl.agents import Agent
from rsrl.environment import FieldEnvironment
from rsrl.evaluation.paired import BATCH, Progress, RaceLog, run_in
from rsrl.season import RaceRecord
from rsrl.state import RAW_SIZE, Encoder
from rsrl.strategists import Strategist, made_legal


class PolicyField:
    """Calls any number of cars with one agent, each from its own observation and with its own memory.

    A call that is not legal is put right as any strategist's is: an agent trained without the mask must not wreck its rivals' races.
    """

    def __init__(self, agent: Agent, record: RaceRecord) -> None:
        self._agent = agent
        self._encoder = Encoder(agent.feature_set, record.scaling)
        self._memory = np.zeros((0, 0, 0), np.float32)

    def begin(self, cars: int, batch: int, rows: NDArray[np.int64]) -> None:
        """Empty the memory of the races that begin."""
        empty = self._agent.initial_memory(cars * batch)
        fresh = empty.reshape(cars, batch, empty.shape[1])  # of no width for a feed-forward network
        if self._memory.shape != fresh.shape:
            self._memory = fresh
        self._memory[:, rows] = fresh[:, rows]

    def decide(self, raw: NDArray[np.float32], legal: NDArray[np.bool_]) -> NDArray[np.int8]:
        """The agent's best legal calls, int8 [cars, B]."""
        cars, batch = raw.shape[:2]
        flat = legal.reshape(cars * batch, 4)
        features = self._encoder(raw.reshape(cars * batch, RAW_SIZE))
        calls, memory = self._agent.act(features, flat, self._memory.reshape(cars * batch, self._memory.shape[2]))
        self._memory = memory.reshape(self._memory.shape)
        return made_legal(calls, flat).reshape(cars, batch)


def self_play(
    agent: Agent,
    strategists: Sequence[Strategist],
    record: RaceRecord,
    car: int,
    seed: int,
    races: int,
    *,
    first_race: int = 0,
    progress: Progress | None = None,
) -> list[RaceLog]:
    """Let strategists call one car, each on the same races, while the agent calls all the others.

    Where the agent itself is among the strategists (a `PolicyStrategist`), its log is the policy against itself; the others say what
    they would have made of the same car among such rivals.

    Raises:
        RsrlError: no races.
    """
    logs = []
    for i, strategist in enumerate(strategists):
        environment = FieldEnvironment(record, car, batch=min(BATCH, races), caller=PolicyField(agent, record))
        logs.append(run_in(environment, strategist, seed, races, first_race=first_race))
        if progress:
            progress(i + 1, len(strategists))
    return logs
