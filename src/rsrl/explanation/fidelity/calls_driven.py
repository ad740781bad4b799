"""What a policy calls, and which states it meets, in races that it drives itself."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.season import RaceRecord
from rsrl.state import COLUMN, FEATURES


@dataclass(frozen=True)
class Driven:
    """Decisions of races driven, those with more than one legal call.

    Attributes:
        races: how many races.
        legal, calls: in how many decisions each call may be made, and is, int64 [4].
        low, high: least and greatest value of each feature met, float32 [RAW_SIZE].
    """

    races: int
    legal: NDArray[np.int64]
    calls: NDArray[np.int64]
    low: NDArray[np.float32]
    high: NDArray[np.float32]

    @property
    def decisions(self) -> int:
        """With more than one legal call."""
        return int(self.calls.sum())

    def holds(self, raw: NDArray[np.float32]) -> bool:
        """Whether every number of a raw row lies between the least and greatest met."""
        return bool(((raw >= self.low) & (raw <= self.high))[NUMBERS].all())


NUMBERS = np.array([COLUMN[f.name] for f in FEATURES if f.kind == "continuous"])


def drive(policy: ExplainedPolicy, record: RaceRecord, car: int, *, races: int, seed: int) -> Driven:
    """Let a policy call so many races, and count."""
    environment, strategist = RaceEnvironment(record, car, batch=races), policy.strategist(record)
    numbers = np.arange(races, dtype=np.int64)
    environment.reset(seed, numbers)
    strategist.begin(environment, seed, numbers)
    legal, calls = np.zeros(4, np.int64), np.zeros(4, np.int64)
    low, high = np.full(len(FEATURES), np.inf, np.float32), np.full(len(FEATURES), -np.inf, np.float32)
    while not environment.done.all():
        called = strategist.decide(environment)
        here = ~environment.done & (environment.legal.sum(axis=1) > 1)
        if here.any():
            legal += environment.legal[here].sum(axis=0)
            calls += np.bincount(called[here], minlength=4)
            low = np.minimum(low, environment.raw[here].min(axis=0))
            high = np.maximum(high, environment.raw[here].max(axis=0))
        environment.step(called)
    return Driven(races, legal, calls, low, high)
