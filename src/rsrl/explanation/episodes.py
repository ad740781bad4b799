"""Races called by a policy, kept lap by lap: the states a race leads to, and the plan it mostly comes to."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.explanation.moment import Arrays, Moment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.season import COMPOUNDS, RaceRecord
from rsrl.simulator import layout as at


@dataclass(frozen=True)
class Driven:
    """Races of one car called by a policy.

    Attributes:
        raw: rows before each lap, float32 [laps, races, RAW_SIZE].
        legal: bool [laps, races, 4]; calls: int8 [laps, races].
        arrays: state f, k, r before each lap, [laps, races, ...].
        going: bool [laps, races], the race is not over.
    """

    record: RaceRecord
    car: int
    seed: int
    raw: NDArray[np.float32]
    legal: NDArray[np.bool_]
    calls: NDArray[np.int8]
    arrays: Arrays
    going: NDArray[np.bool_]

    def moment(self, lap: int, race: int) -> Moment:
        """Race number `race` before lap `lap`, 1 for the first."""
        i = lap - 1
        f, k, r = (a[i, race].copy() for a in self.arrays)
        return Moment(
            self.record, self.car, lap, self.raw[:lap, race].copy(), self.legal[i, race].copy(), self.calls[:i, race].copy(), (f, k, r),
            self.seed, race,
        )  # fmt: skip


def drive(policy: ExplainedPolicy, record: RaceRecord, car: int, races: int, seed: int) -> Driven:
    """Races number 0, 1 ... of a seed, called by the policy."""
    environment = RaceEnvironment(record, car, batch=races)
    strategist = policy.strategist(record)
    numbers = np.arange(races, dtype=np.int64)
    environment.reset(seed, numbers)
    strategist.begin(environment, seed, numbers)
    b, laps = environment.races, record.laps
    raw = np.empty((laps, *environment.raw.shape), np.float32)
    legal, going = np.empty((laps, races, 4), np.bool_), np.empty((laps, races), np.bool_)
    calls = np.zeros((laps, races), np.int8)
    f, k, r = (np.empty((laps, *a.shape), a.dtype) for a in (b.f, b.k, b.r))
    for lap in range(laps):
        raw[lap], legal[lap], going[lap] = environment.raw, environment.legal, ~environment.done
        f[lap], k[lap], r[lap] = b.f, b.k, b.r
        calls[lap] = strategist.decide(environment)
        environment.step(calls[lap])
    return Driven(record, car, seed, raw, legal, calls, (f, k, r), going)


def common_plan(driven: Driven) -> tuple[str, dict[int, tuple[int, int]]]:
    """The order of compounds that most races which reach the last lap come to; by lap, its compound and the laps on that set before it.

    The plan is told as `S-H@14-S@36`, each stop on the median lap among those races.
    """
    k, car = driven.arrays[1], driven.car
    to_the_end = np.flatnonzero(driven.going[-1])
    paths = Counter[tuple[int, ...]]()
    stops: dict[tuple[int, ...], list[list[int]]] = {}
    for race in to_the_end:
        made, fitted = k[:, race, at.K_STOPS, car], k[:, race, at.K_COMPOUND, car]
        laps = [int(i) for i in np.flatnonzero(np.diff(made) > 0) + 1]
        path = (int(fitted[0]), *(int(fitted[lap]) for lap in laps))
        paths[path] += 1
        stops.setdefault(path, []).append(laps)
    if not paths:
        return "", {}
    path = max(paths, key=lambda p: (paths[p], p))
    laps = [round(float(np.median(column))) for column in zip(*stops[path], strict=True)]
    text = "".join(f"-{COMPOUNDS[c]}@{lap}" for c, lap in zip(path[1:], laps, strict=True))
    edges = [0, *laps, driven.record.laps]
    on = {lap: (c, lap - 1 - a) for c, a, b in zip(path, edges, edges[1:], strict=False) for lap in range(a + 1, b + 1)}
    return COMPOUNDS[path[0]] + text, on
