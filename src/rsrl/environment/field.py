"""Observations of any car of a race, not only of the called one.

Used for races in which a policy calls the other cars too, and for races that run on figures other than those the pit walls assume.
"""

from collections.abc import Sequence
from typing import Protocol, Unpack

import numpy as np
from numpy.typing import NDArray

from rsrl.compiled import kernel
from rsrl.environment.kernels import observe_race, write_legal
from rsrl.environment.race_environment import EnvironmentOptions, Observation, RaceEnvironment, Transition
from rsrl.season import RaceRecord
from rsrl.simulator import RaceBatch
from rsrl.state import RAW_SIZE, Observer


@kernel()
def observe_rows(fig, f, k, r, car, context, raw, legal):
    """Raw rows float32 [n, RAW_SIZE] and legal calls bool [n, 4] of one car in every race of a batch."""
    for i in range(f.shape[0]):
        write_legal(fig.whole, k[i], r[i], car, legal[i])
        observe_race(fig.whole, fig.tyres, raw[i], f[i], k[i], r[i], car, context)


class FieldObserver:
    """Observes a list of cars in every race of a batch. Rows of a car that has retired have no meaning.

    Attributes:
        cars: indices.
        raw: raw feature rows float32 [cars, B, RAW_SIZE].
        legal: bool [cars, B, 4].

    Args:
        record: the figures that the pit wall assumes.
    """

    def __init__(self, record: RaceRecord, cars: Sequence[int], batch: int) -> None:
        self.cars = tuple(cars)
        self._observers = [Observer(record, car) for car in self.cars]
        self.raw = np.zeros((len(self.cars), batch, RAW_SIZE), np.float32)
        self.legal = np.zeros((len(self.cars), batch, 4), np.bool_)

    def observe(self, races: RaceBatch) -> None:
        """Fill `raw` and `legal` from the current state of the races."""
        for i, observer in enumerate(self._observers):
            observe_rows(observer.figures, races.f, races.k, races.r, observer.car, observer.context, self.raw[i], self.legal[i])


class FieldCaller(Protocol):
    """Calls many cars of many races at once, each from its own observation."""

    def begin(self, cars: int, batch: int, rows: NDArray[np.int64]) -> None:
        """Races of the rows int64 [m] of a batch begin, with `cars` cars to call."""

    def decide(self, raw: NDArray[np.float32], legal: NDArray[np.bool_]) -> NDArray[np.int8]:
        """Legal calls int8 [cars, B] from raw rows float32 [cars, B, RAW_SIZE] and legal bool [cars, B, 4]."""


class FieldEnvironment(RaceEnvironment):
    """A `RaceEnvironment` whose other cars a policy calls, or whose races run on figures other than those the pit walls assume.

    Attributes:
        record: what the pit walls assume; observations and strategists read it.

    Args:
        record: what the races run on.
        caller: calls every car but `car`; None leaves them to `rivals`.
        believed: the figures that observations are made with; None for `record`.
        options: feature_set, batch, rivals: as of `RaceEnvironment`.
    """

    def __init__(
        self,
        record: RaceRecord,
        car: int,
        caller: FieldCaller | None = None,
        believed: RaceRecord | None = None,
        **options: Unpack[EnvironmentOptions],
    ) -> None:
        others = tuple(i for i in range(len(record.cars)) if i != car) if caller else ()
        super().__init__(record, car, outside=others, **options)
        self._caller = caller
        self._others = FieldObserver(believed or record, others, self.batch)
        self._own = FieldObserver(believed, (car,), self.batch) if believed else None
        self.record = believed or record

    def reset_rows(self, seed: int, races: NDArray[np.int64], rows: NDArray[np.int64]) -> Observation:
        """As of `RaceEnvironment`."""
        observation = super().reset_rows(seed, races, rows)
        if self._caller:
            self._caller.begin(len(self._others.cars), self.batch, rows)
        return observation._replace(features=self._believe(observation.features))

    def step(self, actions: NDArray[np.int8]) -> Transition:
        """As of `RaceEnvironment`; the other cars are called first, in the state before the same lap."""
        if self._caller:
            self._others.observe(self.races)
            self.races.actions[:, list(self._others.cars)] = self._caller.decide(self._others.raw, self._others.legal).T
        transition = super().step(actions)
        return transition._replace(features=self._believe(transition.features))

    def _believe(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        """The called car's observation, made with the believed figures."""
        if self._own is None:
            return features
        self._own.observe(self.races)
        self.raw[:] = self._own.raw[0]
        return self.encoder(self.raw, features)
