"""Any car of a race observed as the called one is.

On it rest races whose other cars are called by a policy, and races that run on other figures than the pit walls believe in.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rsrl.compiled import kernel
from rsrl.environment.kernels import observe_race, write_legal
from rsrl.environment.race_environment import Observation, RaceEnvironment, Transition
from rsrl.season import RaceRecord
from rsrl.simulator import RaceBatch, Rivals
from rsrl.state import RAW_SIZE, Observer


@kernel()
def observe_rows(fig, f, k, r, car, context, raw, legal):
    """Raw rows float32 [n, RAW_SIZE] and legal calls bool [n, 4] of one car in every race of a batch."""
    for i in range(f.shape[0]):
        write_legal(fig.whole, k[i], r[i], car, legal[i])
        observe_race(fig, raw[i], f[i], k[i], r[i], car, context)


class FieldObserver:
    """Observes a list of cars in every race of a batch. What a car that has retired shows means nothing.

    Attributes:
        cars: indices.
        raw: raw feature rows float32 [cars, B, RAW_SIZE].
        legal: bool [cars, B, 4].

    Args:
        record: the figures the pit wall believes in.
    """

    def __init__(self, record: RaceRecord, cars: Sequence[int], batch: int) -> None:
        self.cars = tuple(cars)
        self._observers = [Observer(record, car) for car in self.cars]
        self.raw = np.zeros((len(self.cars), batch, RAW_SIZE), np.float32)
        self.legal = np.zeros((len(self.cars), batch, 4), np.bool_)

    def observe(self, races: RaceBatch) -> None:
        """Fill `raw` and `legal` from the races as they stand."""
        for i, observer in enumerate(self._observers):
            observe_rows(observer.figures, races.f, races.k, races.r, observer.car, observer.context, self.raw[i], self.legal[i])


class FieldCaller(Protocol):
    """Calls many cars of many races at once, each from its own observation."""

    def begin(self, cars: int, batch: int, rows: NDArray[np.int64]) -> None:
        """The races of these rows int64 [m] of a batch begin, with so many cars to call."""

    def decide(self, raw: NDArray[np.float32], legal: NDArray[np.bool_]) -> NDArray[np.int8]:
        """Legal calls int8 [cars, B] from raw rows float32 [cars, B, RAW_SIZE] and legal bool [cars, B, 4]."""


class FieldEnvironment(RaceEnvironment):
    """A `RaceEnvironment` with other company, or with figures that are not what the pit walls believe.

    Attributes:
        record: what the pit walls believe in: observations and strategists read it, the races run on `record` as given.

    Args:
        record: what the races run on.
        rivals: as of `RaceEnvironment`; not looked at where `caller` calls them all.
        caller: calls every car but `car`.
        believed: the figures observations are made with; None for `record`.
    """

    def __init__(
        self,
        record: RaceRecord,
        car: int,
        *,
        feature_set: str = "full",
        batch: int = 1,
        rivals: Rivals | None = None,
        caller: FieldCaller | None = None,
        believed: RaceRecord | None = None,
    ) -> None:
        others = tuple(i for i in range(len(record.cars)) if i != car) if caller else ()
        super().__init__(record, car, feature_set=feature_set, batch=batch, rivals=rivals, outside=others)
        self._caller = caller
        self._others = FieldObserver(believed or record, others, batch)
        self._own = FieldObserver(believed, (car,), batch) if believed else None
        self.record = believed or record

    def reset_rows(self, seed: int, races: NDArray[np.int64], rows: NDArray[np.int64]) -> Observation:
        """As of `RaceEnvironment`."""
        observation = super().reset_rows(seed, races, rows)
        if self._caller:
            self._caller.begin(len(self._others.cars), self.batch, rows)
        return observation._replace(features=self._believe(observation.features))

    def step(self, actions: NDArray[np.int8]) -> Transition:
        """As of `RaceEnvironment`; the other cars are called first, from the same lap."""
        if self._caller:
            self._others.observe(self.races)
            self.races.actions[:, list(self._others.cars)] = self._caller.decide(self._others.raw, self._others.legal).T
        transition = super().step(actions)
        return transition._replace(features=self._believe(transition.features))

    def _believe(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        """The called car's observation as the believed figures make it."""
        if self._own is None:
            return features
        self._own.observe(self.races)
        self.raw[:] = self._own.raw[0]
        return self.encoder(self.raw, features)
