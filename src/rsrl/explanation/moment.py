"""A decision of a race with all that led to it: what the explainers explain."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.season import RaceRecord
from rsrl.strategists import Strategist

Arrays = tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.int32]]


@dataclass(frozen=True)
class Moment:
    """A race before one lap.

    Attributes:
        record, car: whose race it is.
        lap: the lap to be called, 1 for the first.
        raw: raw feature rows float32 [T, RAW_SIZE] of the decisions so far; the last is the one at hand.
        legal: bool [4], calls that may be made.
        calls: int8 [T - 1], calls made before.
        arrays: the simulator's state f, k, r (`simulator.layout`). `rollouts.roll_out_plans` uses nothing hidden in it.
        seed, race: which simulated race it comes from; None where it comes from elsewhere.
    """

    record: RaceRecord
    car: int
    lap: int
    raw: NDArray[np.float32]
    legal: NDArray[np.bool_]
    calls: NDArray[np.int8]
    arrays: Arrays
    seed: int | None = None
    race: int | None = None

    @property
    def driver(self) -> str:
        """Code of the car's driver."""
        return self.record.cars[self.car].driver


def reach(strategist: Strategist, record: RaceRecord, car: int, lap: int, *, seed: int = 0, race: int = 0) -> Moment:
    """Let a strategist call a simulated race up to the decision for lap `lap`.

    Raises:
        RsrlError: there is no such lap, or the car's race is over before it.
    """
    if not 1 <= lap <= record.laps:
        raise RsrlError(f"lap {lap} is outside the race: {record.name} has laps 1 to {record.laps}")
    environment = RaceEnvironment(record, car)
    numbers = np.array([race], np.int64)
    environment.reset(seed, numbers)
    strategist.begin(environment, seed, numbers)
    rows, calls = [environment.raw[0].copy()], []
    for driven in range(1, lap):
        call = strategist.decide(environment)
        environment.step(call)
        if environment.done[0]:
            raise RsrlError(
                f"the race of {record.cars[car].driver} is over after lap {driven}; choose a lap up to {driven}, or another --seed"
            )
        calls.append(call[0])
        rows.append(environment.raw[0].copy())
    b = environment.races
    return Moment(
        record, car, lap, np.stack(rows), environment.legal[0].copy(), np.array(calls, np.int8),
        (b.f[0].copy(), b.k[0].copy(), b.r[0].copy()), seed, race,
    )  # fmt: skip
