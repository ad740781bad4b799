"""Toy environments with a known best policy, for the learners' tests."""

from typing import Any, NamedTuple

import numpy as np


class Seen(NamedTuple):
    features: Any
    legal: Any


class Lap(NamedTuple):
    features: Any
    legal: Any
    reward: Any
    terminated: Any
    truncated: Any


class LittleRace:
    """Seven laps on a wearing tyre, with a flag on lap 2 or 4 that makes one stop, `delay` laps later, cheap.

    State: lap, tyre age, compound, whether another compound has been used. A lap costs `wear * age`, a stop costs `stop`
    or, in the one cheap lap, `cheap`. Only soft and hard exist (medium is never legal). Finishing without a second
    compound costs 1000. Whether and when a flag is shown depends on (seed, race) alone; with `delay` above zero the flag is
    seen only on its lap, so a policy without memory cannot know the cheap lap.
    """

    laps = 7
    feature_set = "full"
    stop, cheap, base = 120.0, 0.0, 60.0
    wear = (16.0, 12.0)  # soft, hard
    flags = (1, 3)  # laps (from 0) on which a flag can be shown

    def __init__(self, delay: int = 2) -> None:
        self.delay = delay
        self.feature_names = (*(f"lap_{n}" for n in range(self.laps)), "age", "soft", "hard", "valid", "flag")
        self.n_features = len(self.feature_names)

    def reset(self, seed: int, races: Any) -> Seen:
        self.flag_lap = np.array([self.flag_of(seed, int(r)) for r in races])
        batch = len(races)
        self.lap = 0
        self.age = np.zeros(batch, np.int64)
        self.tyre = np.zeros(batch, np.int64)
        self.valid = np.zeros(batch, bool)
        self.done = np.zeros(batch, bool)
        self.features = np.zeros((batch, self.n_features), np.float32)
        return Seen(self._observe(), self._legal())

    def flag_of(self, seed: int, race: int) -> int:
        return self.flags[(seed + race) % 2]  # as many of either in every batch

    def _legal(self) -> Any:
        return np.tile(np.array([True, True, False, True]), (len(self.age), 1))

    def _observe(self) -> Any:
        f = self.features
        f[:] = 0.0
        if self.lap < self.laps:
            f[:, self.lap] = 1.0
        f[:, self.laps] = self.age / 10
        f[:, self.laps + 1] = self.tyre == 0
        f[:, self.laps + 2] = self.tyre == 1
        f[:, self.laps + 3] = self.valid
        f[:, self.laps + 4] = self.lap == self.flag_lap
        return f

    def lap_reward(self, lap: int, flag_lap: int, state: tuple[int, int, bool], action: int) -> tuple[float, tuple[int, int, bool]]:
        """Reward and next (age, tyre, valid) of one car: the rule that both the environment and the exact solution use."""
        age, tyre, valid = state
        reward = self.base - self.wear[tyre] * age
        age += 1
        if action:
            reward -= self.cheap if lap == flag_lap + self.delay else self.stop
            new = 0 if action == 1 else 1
            age, tyre, valid = 0, new, valid or new != tyre
        if lap == self.laps - 1 and not valid:
            reward -= 1000.0
        return reward, (age, tyre, valid)

    def step(self, actions: Any) -> Lap:
        reward = np.zeros(len(self.age), np.float32)
        for i, action in enumerate(actions):
            if self.done[i]:
                continue
            if action == 2:
                reward[i], self.done[i] = -1000.0, True
                continue
            state = (int(self.age[i]), int(self.tyre[i]), bool(self.valid[i]))
            reward[i], (self.age[i], self.tyre[i], self.valid[i]) = self.lap_reward(self.lap, int(self.flag_lap[i]), state, int(action))
        self.lap += 1
        if self.lap == self.laps:
            self.done[:] = True
        return Lap(self._observe(), self._legal(), reward, self.done, np.zeros_like(self.done))

    def best_return(self, remembers: bool) -> float:
        """Mean return of the best policy, by dynamic programming over what it knows: which flag was shown, or not."""

        def value(lap: int, state: tuple[int, int, bool], candidates: tuple[int, ...]) -> float:
            if lap == self.laps:
                return 0.0
            groups = [(f,) for f in candidates if f == lap] + [tuple(f for f in candidates if f != lap)]
            if not remembers:
                groups = [self.flags] if self.delay else groups
            total = 0.0
            for group in groups:
                if not group:
                    continue
                options = []
                for action in (0, 1, 3):
                    outcomes = [self.lap_reward(lap, f, state, action) for f in group]
                    options.append(sum(r for r, _ in outcomes) / len(group) + value(lap + 1, outcomes[0][1], group))
                total += max(options) * len(group) / len(candidates)
            return float(total)

        return value(0, (0, 0, False), self.flags)


def mean_return(agent: Any, environment: Any, seed: int, races: int) -> float:
    """Mean return of an agent's greedy policy."""
    seen = environment.reset(seed, np.arange(races))
    memory = agent.initial_memory(races)
    total = np.zeros(races)
    for _ in range(environment.laps):
        actions, memory = agent.act(seen.features, seen.legal, memory)
        seen = environment.step(actions)
        total += seen.reward
    return float(total.mean())


class Bandit:
    """Three laps; the action that matches the race's colour pays 10, any other nothing. Best return: 30.

    The colour is shown on every lap, or on the first only (`remember`), when the other laps need a memory.
    """

    laps = 3
    n_features = 4
    feature_set = "paper"
    feature_names = ("soft", "medium", "hard", "none")

    def __init__(self, remember: bool = False) -> None:
        self.remember = remember

    def reset(self, seed: int, races: Any) -> Seen:
        self.colour = np.array([(seed + int(r) * 2654435761 // 65536) % 4 for r in races])
        self.lap = 0
        return Seen(self._observe(), np.ones((len(races), 4), bool))

    def _observe(self) -> Any:
        shown = self.lap == 0 or not self.remember
        return np.eye(4, dtype=np.float32)[self.colour] * shown

    def step(self, actions: Any) -> Lap:
        reward = np.where(actions == self.colour, 10.0, 0.0).astype(np.float32) * (self.lap < self.laps)
        self.lap += 1
        ended = np.full(len(self.colour), self.lap >= self.laps)
        return Lap(self._observe(), np.ones((len(ended), 4), bool), reward, ended, np.zeros_like(ended))
