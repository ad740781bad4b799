"""Toy environments with a known best policy, for the learners' tests."""

import copy
from typing import Any, NamedTuple

import numpy as np

from rsrl.agents.networks import Duelling, Params, greedy_actions
from rsrl.rollouts import Branches, Branching


class Seen(NamedTuple):
    features: Any
    legal: Any


class Lap(NamedTuple):
    features: Any
    legal: Any
    reward: Any
    terminated: Any
    truncated: Any


class Ended(NamedTuple):
    position: Any


class LittleRace:
    """Seven laps on a wearing tyre, with a flag on lap 2 or 4 that makes one stop, `delay` laps later, cheap.

    State: lap, tyre age, compound, whether another compound has been used. A lap costs `wear * age`, a stop costs `stop`
    or, in the one cheap lap, `cheap`. Only soft and hard exist (medium is never legal). Finishing without a second
    compound costs 1000. Whether and when a flag is shown depends on (seed, race) alone; with `delay` above zero the flag is
    seen only on its lap, so a policy without memory cannot know the cheap lap. Without delay the best policy needs none.
    """

    laps = 7
    feature_set = "full"
    stop, cheap, base = 120.0, 0.0, 60.0
    wear = (16.0, 12.0)  # soft, hard
    flags = (1, 3)  # laps (from 0) on which a flag can be shown
    calls = (0, 1, 3)

    def __init__(self, delay: int = 0) -> None:
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
        self.total = np.zeros(batch)
        return Seen(self._observe(), self._legal())

    def flag_of(self, seed: int, race: int) -> int:
        return self.flags[(seed + race) % 2]  # as many of either in every batch

    def _legal(self) -> Any:
        return np.tile(np.array([True, True, False, True]), (len(self.age), 1))

    def _observe(self) -> Any:
        f = np.zeros((len(self.age), self.n_features), np.float32)
        if self.lap < self.laps:
            f[:, self.lap] = 1.0
        f[:, self.laps] = self.age / 10
        f[:, self.laps + 1] = self.tyre == 0
        f[:, self.laps + 2] = self.tyre == 1
        f[:, self.laps + 3] = self.valid
        f[:, self.laps + 4] = self.lap == self.flag_lap
        return f

    def lap_reward(self, lap: int, flag_lap: Any, state: tuple[Any, Any, Any], action: Any) -> tuple[Any, tuple[Any, Any, Any]]:
        """Reward and next (age, tyre, valid), of one car or of arrays of them: the rule of environment and exact solution alike."""
        age, tyre, valid = state
        box = np.not_equal(action, 0)
        reward = self.base - np.where(tyre == 0, *self.wear) * age
        reward = reward - box * np.where(lap == flag_lap + self.delay, self.cheap, self.stop)
        new = np.where(box, np.where(np.equal(action, 1), 0, 1), tyre)
        valid = valid | (new != tyre)
        if lap == self.laps - 1:
            reward = reward - 1000.0 * ~valid
        return reward, (np.where(box, 0, age + 1), new, valid)

    def step(self, actions: Any) -> Lap:
        going = ~self.done
        failed = going & (actions == 2)
        reward, state = self.lap_reward(self.lap, self.flag_lap, (self.age, self.tyre, self.valid), actions)
        self.age, self.tyre, self.valid = (
            np.where(going & ~failed, new, old) for new, old in zip(state, (self.age, self.tyre, self.valid), strict=True)
        )
        self.lap += 1
        self.done = self.done | failed | (self.lap == self.laps)
        reward = np.where(failed, -1000.0, np.where(going, reward, 0.0)).astype(np.float32)
        self.total = self.total + reward
        return Lap(self._observe(), self._legal(), reward, self.done, np.zeros_like(self.done))

    def outcome(self) -> Ended:
        return Ended(-self.total)

    def best_return(self, remembers: bool) -> float:
        """Mean return of the best policy, by dynamic programming over what it knows: which flag was shown, or not."""

        def value(lap: int, state: tuple[Any, Any, Any], candidates: tuple[int, ...]) -> float:
            if lap == self.laps:
                return 0.0
            groups = [(f,) for f in candidates if f == lap] + [tuple(f for f in candidates if f != lap)]
            if not remembers:
                groups = [self.flags]
            total = 0.0
            for group in groups:
                if not group:
                    continue
                options = []
                for action in self.calls:
                    outcomes = [self.lap_reward(lap, f, state, action) for f in group]
                    options.append(sum(float(r) for r, _ in outcomes) / len(group) + value(lap + 1, outcomes[0][1], group))
                total += max(options) * len(group) / len(candidates)
            return float(total)

        return value(0, (np.int64(0), np.int64(0), np.bool_(False)), self.flags)


class LittleRaces(LittleRace):
    """The little race, without delay, as RSRL's learner wants it: at decisions every call is run to the flag under the policy at hand.

    A "position" is minus the return, 60 points to the place; no stop is an extra one.
    """

    expected_scale_s = 0.0
    points_a_place = 60.0

    def branch(self, params: Params, branching: Branching, seed: int, iteration: int, races: int) -> Branches:
        rng = np.random.default_rng([seed, iteration])
        seen: Any = self.reset(seed, iteration * races + np.arange(races))
        every, driven, branched = np.arange(races), np.zeros(races), np.zeros(races, np.int64)
        planned = rng.random(races) < branching.plan_share
        features, legal, positions = [], [], []
        for _ in range(self.laps):
            q = np.where(seen.legal, self._values(params, seen), -np.inf)
            best = q.argmax(axis=1)
            other = np.where(np.arange(4) == best[:, None], -np.inf, q).argmax(axis=1)
            gap = q[every, best] - q[every, other]
            chance = branching.least + (branching.most - branching.least) * np.exp(-gap / branching.scale)
            rows = (rng.random(races) < chance) & (branched < branching.decisions)
            branched += rows
            stop = np.where(best > 0, best, other)
            tried = np.zeros((races, 4), bool)
            tried[:, 0] = tried[every, stop] = tried[every, best] = tried[every, other] = True
            tried |= (rng.random(races) < branching.all_calls)[:, None]
            returns = driven[:, None] + np.stack([self._run_on(params, call) for call in range(4)], axis=1)
            features.append(seen.features[rows])
            legal.append(seen.legal[rows])
            positions.append(np.where(tried & seen.legal, -returns / self.points_a_place, np.nan)[rows])
            u, stop = rng.random(races), rng.choice(self.calls[1:], races)
            call = np.where(best == 0, np.where(u < branching.pit_chance, stop, 0), np.where(u < branching.delay_chance, 0, best))
            seen = self.step(np.where(planned, np.where(u < 2 / self.laps, stop, 0), call))
            driven += seen.reward
        places = np.concatenate(positions).astype(np.float32)
        extra_stops = np.where(np.isfinite(places), np.float32(0.0), np.float32(np.nan))
        return Branches(np.concatenate(features).astype(np.float32), np.concatenate(legal), places, extra_stops)

    def _values(self, params: Params, seen: Any) -> Any:
        hidden = len(params["q.weight"])
        return Duelling(self.n_features, hidden).step(params, seen.features, None)[0]

    def _run_on(self, params: Params, call: int) -> Any:
        """Return [races] from here to the flag of one call, the policy making the others."""
        race = copy.copy(self)
        lap = race.step(np.full(len(self.age), call))
        total = lap.reward.astype(np.float64)
        while race.lap < race.laps:
            lap = race.step(greedy_actions(self._values(params, lap), lap.legal))
            total += lap.reward
        return total


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
        self.missed = np.zeros(len(races), np.int64)
        return Seen(self._observe(), np.ones((len(races), 4), bool))

    def _observe(self) -> Any:
        shown = self.lap == 0 or not self.remember
        return np.eye(4, dtype=np.float32)[self.colour] * shown

    def step(self, actions: Any) -> Lap:
        reward = np.where(actions == self.colour, 10.0, 0.0).astype(np.float32) * (self.lap < self.laps)
        self.missed = self.missed + (actions != self.colour)
        self.lap += 1
        ended = np.full(len(self.colour), self.lap >= self.laps)
        return Lap(self._observe(), np.ones((len(ended), 4), bool), reward, ended, np.zeros_like(ended))

    def outcome(self) -> Ended:
        return Ended(1 + self.missed)
