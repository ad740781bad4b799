"""Replay buffer of the paper's agents: a ring of whole races, as Hausknecht and Stone (2015) keep episodes."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class Laps(NamedTuple):
    """Transitions of one lap each, as arrays of equal leading shape [...]; `ended` marks the last lap of a race."""

    features: NDArray[np.float32]
    action: NDArray[np.int8]
    reward: NDArray[np.float32]
    next_features: NDArray[np.float32]
    ended: NDArray[np.bool_]


class Races(NamedTuple):
    """Whole races of up to L laps, arrays [..., L, N, ...]; laps from `laps` on were not driven and mean nothing.

    Attributes:
        features: before each lap and after the last, float32 [..., L + 1, N, F].
        action: int8 [..., L, N].
        reward: float32 [..., L, N].
        laps: laps driven, int32 [..., N].
    """

    features: NDArray[np.float32]
    action: NDArray[np.int8]
    reward: NDArray[np.float32]
    laps: NDArray[np.int32]

    @classmethod
    def empty(cls, laps: int, count: int, n_features: int) -> "Races":
        """`count` races of no laps, with room for `laps`."""
        return cls(
            np.zeros((laps + 1, count, n_features), np.float32),
            np.zeros((laps, count), np.int8),
            np.zeros((laps, count), np.float32),
            np.zeros(count, np.int32),
        )


class Replay:
    """The last `capacity` races.

    Attributes:
        size: number of races stored.
        races: the ring, races along the second axis but of `laps`; slot `position` is written next.
    """

    def __init__(self, capacity: int, laps: int, n_features: int) -> None:
        self.capacity = capacity
        self.size = 0
        self.position = 0
        self.races = Races.empty(laps, capacity, n_features)

    def add(self, races: Races) -> None:
        """Append copies of races [N], N up to the capacity, in place of the oldest where the ring is full."""
        count = len(races.laps)
        slots = (self.position + np.arange(count)) % self.capacity
        self.races.features[:, slots] = races.features
        self.races.action[:, slots] = races.action
        self.races.reward[:, slots] = races.reward
        self.races.laps[slots] = races.laps
        self.position = (self.position + count) % self.capacity
        self.size = min(self.size + count, self.capacity)

    def sample_laps(self, rng: np.random.Generator, shape: tuple[int, ...]) -> Laps:
        """Laps sampled uniformly with replacement from all laps of all races, arrays [*shape, ...]."""
        ends = np.cumsum(self.races.laps[: self.size])
        chosen = rng.integers(0, ends[-1], shape)
        race = np.searchsorted(ends, chosen, side="right")
        length = self.races.laps[race]
        lap = chosen - (ends[race] - length)
        features, action, reward, _ = self.races
        return Laps(features[lap, race], action[lap, race], reward[lap, race], features[lap + 1, race], lap == length - 1)

    def sample_races(self, rng: np.random.Generator, steps: int, batch: int) -> Races:
        """Whole races sampled uniformly with replacement, arrays [steps, L, batch, ...]."""
        chosen = rng.integers(0, self.size, (steps, batch))
        features, action, reward, laps = self.races
        return Races(
            np.stack([features[:, rows] for rows in chosen]),
            np.stack([action[:, rows] for rows in chosen]),
            np.stack([reward[:, rows] for rows in chosen]),
            laps[chosen],
        )

    def state(self) -> dict[str, NDArray[Any]]:
        """The ring as named arrays."""
        return self.races._asdict() | {"position": np.array([self.size, self.position])}

    def restore(self, state: dict[str, NDArray[Any]]) -> None:
        """Continue from the `state()` of a ring of the same size."""
        for name, ring in self.races._asdict().items():
            ring[:] = state[name]
        self.size, self.position = (int(n) for n in state["position"])
