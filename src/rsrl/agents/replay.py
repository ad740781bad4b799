"""Replay buffer of the paper's agents: a ring of a fixed number of laps."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError


class Laps(NamedTuple):
    """Transitions of one lap each, as arrays of equal leading shape [...]; `ended` marks the last lap of a race."""

    features: NDArray[np.float32]
    action: NDArray[np.int8]
    reward: NDArray[np.float32]
    next_features: NDArray[np.float32]
    ended: NDArray[np.bool_]


class Replay:
    """The last `capacity` laps, in the order driven.

    Attributes:
        size: number of laps stored.
        laps: the ring; slot `position` is written next.
        first: whether a slot holds the first lap of a race, bool [capacity].
    """

    def __init__(self, capacity: int, n_features: int) -> None:
        self.capacity = capacity
        self.size = 0
        self.position = 0
        self.first = np.zeros(capacity, np.bool_)
        wide = (capacity, n_features)
        self.laps = Laps(
            np.zeros(wide, np.float32),
            np.zeros(capacity, np.int8),
            np.zeros(capacity, np.float32),
            np.zeros(wide, np.float32),
            np.zeros(capacity, np.bool_),
        )

    def add(self, features: Any, action: int, reward: float, next_features: Any, ended: bool, first: bool) -> None:
        """Append a copy of one lap, replacing the oldest where the ring is full."""
        at = self.position
        laps = self.laps
        laps.features[at] = features
        laps.action[at] = action
        laps.reward[at] = reward
        laps.next_features[at] = next_features
        laps.ended[at] = ended
        self.first[at] = first
        self.position = (at + 1) % self.capacity
        self.size = min(self.size + 1, self.capacity)

    def sample(self, rng: np.random.Generator, batch: int) -> Laps:
        """`batch` laps sampled uniformly with replacement, arrays [batch, ...]."""
        chosen = rng.integers(0, self.size, batch)
        return self._take(chosen)

    def sample_sequences(self, rng: np.random.Generator, batch: int, length: int) -> tuple[Laps, NDArray[np.bool_]]:
        """`batch` sequences of up to `length` laps, arrays [length, batch, ...], and a mask of valid laps, bool [length, batch].

        A sequence starts at a uniformly sampled lap and ends with its race or with the newest lap stored.
        """
        start = rng.integers(0, self.size, batch)  # in order of age, 0 the oldest
        offset = np.arange(length)[:, None]
        oldest = self.position if self.size == self.capacity else 0
        order = start + offset
        slots = (oldest + np.minimum(order, self.size - 1)) % self.capacity
        new_race = self.first[slots] & (offset > 0)
        counts = (order < self.size) & (np.cumsum(new_race, axis=0) == 0)
        return self._take(slots), counts

    def _take(self, slots: NDArray[np.int64]) -> Laps:
        laps = self.laps
        return Laps(laps.features[slots], laps.action[slots], laps.reward[slots], laps.next_features[slots], laps.ended[slots])

    def state(self) -> dict[str, NDArray[Any]]:
        """The ring as named arrays."""
        return self.laps._asdict() | {"first": self.first, "position": np.array([self.size, self.position])}

    def restore(self, state: dict[str, NDArray[Any]]) -> None:
        """Continue from a `state()`; raises RsrlError where it is of another size."""
        for name, mine in self.state().items():
            if name not in state or state[name].shape != mine.shape:
                raise RsrlError(f"training state's replay {name} is missing or of another size; start training anew")
        for name, ring in self.laps._asdict().items():
            ring[:] = state[name]
        self.first[:] = state["first"]
        self.size, self.position = (int(n) for n in state["position"])
