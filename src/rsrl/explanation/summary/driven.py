"""A race called by the policy, with all it saw and thought at each decision."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.explanation.moment import Arrays, Moment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.season import RaceRecord


@dataclass(frozen=True)
class DrivenRace:
    """A race of T decisions.

    Attributes:
        record, car, seed, race: which race it is.
        raw: float32 [T, RAW_SIZE], natural units.
        legal: bool [T, 4].
        q: float32 [T, 4], what the policy made of each call.
        calls: int8 [T].
        arrays: the simulator's state before each decision.
        position: finishing position, 1..20.
        retired: the car did not see the flag.
    """

    record: RaceRecord
    car: int
    seed: int
    race: int
    raw: NDArray[np.float32]
    legal: NDArray[np.bool_]
    q: NDArray[np.float32]
    calls: NDArray[np.int8]
    arrays: tuple[Arrays, ...]
    position: int
    retired: bool

    @property
    def laps(self) -> int:
        """Decisions taken, T."""
        return len(self.calls)

    def moment(self, lap: int) -> Moment:
        """The decision for lap `lap`, 1 for the first."""
        return Moment(
            self.record, self.car, lap, self.raw[:lap], self.legal[lap - 1], self.calls[: lap - 1], self.arrays[lap - 1],
            self.seed, self.race,
        )  # fmt: skip

    def margins(self) -> NDArray[np.float64]:
        """By how much each call was better than the best other legal one, [T]; not a number where there was none."""
        rows = np.arange(self.laps)
        others = self.legal.copy()
        others[rows, self.calls] = False
        return _best(self.q[rows, self.calls].astype(np.float64), self.q, others)

    def for_a_stop(self) -> NDArray[np.float64]:
        """By how much the best legal stop is better than staying out, [T]; not a number where either is not legal."""
        boxes = self.legal.copy()
        boxes[:, 0] = False
        boxes[~self.legal[:, 0]] = False
        return -_best(self.q[:, 0].astype(np.float64), self.q, boxes)


def _best(own: NDArray[np.float64], q: NDArray[np.float32], others: NDArray[np.bool_]) -> NDArray[np.float64]:
    """`own` [T] less the best of `others` [T, 4]."""
    best = np.where(others, q.astype(np.float64), -np.inf).max(axis=1)
    return np.where(others.any(axis=1), own - best, np.nan)


def drive(policy: ExplainedPolicy, record: RaceRecord, car: int, *, seed: int = 0, race: int = 0) -> DrivenRace:
    """Let the policy call race number `race` of `seed` to the flag, or to the car's retirement."""
    environment = RaceEnvironment(record, car)
    environment.reset(seed, np.array([race], np.int64))
    encoder, memory = policy.encoder(record), policy.agent.initial_memory(1)
    raw, legal, values, calls, arrays = [], [], [], [], []
    while not environment.done[0]:
        q, memory = policy.agent.q_values(encoder(environment.raw), memory)
        call = policy.chosen(q, environment.legal)
        b = environment.races
        raw.append(environment.raw[0].copy())
        legal.append(environment.legal[0].copy())
        values.append(q[0])
        calls.append(call[0])
        arrays.append((b.f[0].copy(), b.k[0].copy(), b.r[0].copy()))
        environment.step(call)
    outcome = environment.outcome()
    return DrivenRace(
        record, car, seed, race, np.stack(raw), np.stack(legal), np.stack(values), np.array(calls, np.int8), tuple(arrays),
        int(outcome.position[0]), bool(outcome.retired[0]),
    )  # fmt: skip
