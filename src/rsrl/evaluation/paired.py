"""The same races called by every strategist, with the result of each race."""

import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rsrl.agents import TRAINING_SEED, ModelMetadata, NetworkAgent
from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.season import RaceRecord
from rsrl.simulator import POINTS_BY_POSITION
from rsrl.state import COLUMN
from rsrl.strategists import Strategist

BATCH = 384
"""Races in a batch. The last batch is filled up, so that the result of a race does not depend on how many races are asked for; a
strategist that treats each race by itself gets no more races than asked for."""

APART = 2**32
"""First race number of an evaluation whose seed is that of a model's training, which uses races from 0."""

TIMED_RACES = 3
"""Races over which the time of one decision is taken."""

Progress = Callable[[int, int], None]
"""Called with (races done, races in all)."""


@dataclass(frozen=True)
class RaceLog:
    """Results of one strategist in races number `races`; arrays by race, in that order.

    Attributes:
        position: 1 for the winner; a retired car is classified where it stopped.
        points: without the fastest lap's.
        stops: made.
        invalid: not retired, yet out of the rules: one compound only, too few sets, or a call that could not be carried out.
        retired: did not finish.
        start: compound drawn for the start, code.
        calls: int8 [races, laps], 0 stay out, 1 to 3 box; 0 after a race has ended.
        decision_ms: time of one decision when a single race is called; NaN where it was not measured.
    """

    strategist: str
    races: NDArray[np.int64]
    position: NDArray[np.int64]
    points: NDArray[np.float64]
    stops: NDArray[np.int64]
    invalid: NDArray[np.bool_]
    retired: NDArray[np.bool_]
    start: NDArray[np.int8]
    calls: NDArray[np.int8]
    decision_ms: float

    def stints(self, race: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Compounds of a race's stints and the last lap of each but the final one; `race` is a row of the log."""
        laps = np.flatnonzero(self.calls[race])
        return (int(self.start[race]), *(int(c) - 1 for c in self.calls[race, laps])), tuple(int(lap) + 1 for lap in laps)


def first_unseen_race(seed: int, models: Iterable[tuple[object, ModelMetadata]]) -> int:
    """Number of the first race of a seed to evaluate models on: 0, or APART where one of them trained on races of this very seed.

    Of policies from elsewhere no such seed is known.
    """
    trained = {about.seed for policy, about in models if isinstance(policy, NetworkAgent)}
    return APART if seed - TRAINING_SEED in trained else 0


def run_races(
    strategist: Strategist, record: RaceRecord, car: int, seed: int, races: int, *, first_race: int = 0, progress: Progress | None = None
) -> RaceLog:
    """Let a strategist call races number first_race, first_race + 1 ... of a seed. The same for any number of races asked for.

    Raises:
        RsrlError: no races.
    """
    whole = races - races % BATCH if strategist.batch_invariant else races
    logs = []
    for done, part in ((0, whole), (whole, races - whole)):
        if part or not races:
            environment = RaceEnvironment(record, car, batch=BATCH if done < whole or not strategist.batch_invariant else part)
            told = _part_of(progress, done, races)
            logs.append(run_in(environment, strategist, seed, part, first_race=first_race + done, progress=told))
    return replace(_joined(logs), decision_ms=decision_time_ms(strategist, record, car, seed))


def _part_of(progress: Progress | None, before: int, races: int) -> Progress | None:
    return (lambda done, _: progress(before + done, races)) if progress else None


def _joined(logs: Sequence[RaceLog]) -> RaceLog:
    """Logs of one strategist, one after the other."""
    arrays: dict[str, Any] = {
        f.name: np.concatenate([getattr(log, f.name) for log in logs])
        for f in fields(RaceLog)
        if f.name not in ("strategist", "decision_ms")
    }
    return replace(logs[0], **arrays)


def run_in(
    environment: RaceEnvironment, strategist: Strategist, seed: int, races: int, *, first_race: int = 0, progress: Progress | None = None
) -> RaceLog:
    """`run_races` in a given environment, in batches of its size; no decision is timed.

    Raises:
        RsrlError: no races.
    """
    if races < 1:
        raise RsrlError(f"races is {races}; ask for one at least")
    outcomes, starts, calls = [], [], []
    batch = environment.batch
    for done in range(0, races, batch):
        numbers = np.arange(first_race + done, first_race + done + batch, dtype=np.int64)
        start, called = _call_batch(strategist, environment, seed, numbers, _by_lap(progress, done, min(batch, races - done), races))
        outcomes.append(environment.outcome())
        starts.append(start)
        calls.append(called)
    position = np.concatenate([o.position for o in outcomes])[:races]
    retired = np.concatenate([o.retired for o in outcomes])[:races]
    return RaceLog(
        strategist=strategist.name,
        races=np.arange(first_race, first_race + races, dtype=np.int64),
        position=position,
        points=POINTS_BY_POSITION[position],
        stops=np.concatenate([o.stops for o in outcomes])[:races],
        invalid=~np.concatenate([o.valid for o in outcomes])[:races] & ~retired,
        retired=retired,
        start=np.concatenate(starts)[:races],
        calls=np.concatenate(calls)[:races],
        decision_ms=math.nan,
    )


def _by_lap(progress: Progress | None, done: int, size: int, races: int) -> Callable[[float], None]:
    """A function that reports the finished share of a batch of `size` races, lap by lap, as races done of all `races`."""
    return lambda share: progress(done + int(size * share), races) if progress else None


def _call_batch(
    strategist: Strategist, environment: RaceEnvironment, seed: int, numbers: NDArray[np.int64], report: Callable[[float], None]
) -> tuple[NDArray[np.int8], NDArray[np.int8]]:
    """Call a batch to the flag: starting tyre int8 [B] and calls int8 [B, laps]. `report` gets the share of laps done."""
    environment.reset(seed, numbers)
    start = environment.raw[:, COLUMN["tyre"]].astype(np.int8)
    strategist.begin(environment, seed, numbers)
    calls = np.zeros((len(numbers), environment.laps), np.int8)
    for lap in range(environment.laps):
        call = strategist.decide(environment)
        stopped = environment.raw[:, COLUMN["stops_made"]].copy()
        environment.step(call)
        made = environment.raw[:, COLUMN["stops_made"]] > stopped
        calls[:, lap] = np.where(made, call, 0)
        if environment.done.all():
            break
        report((lap + 1) / environment.laps)
    report(1.0)
    return start, calls


def decision_time_ms(strategist: Strategist, record: RaceRecord, car: int, seed: int) -> float:
    """Mean time in ms of one decision in a single race; what a strategist does before the race is not counted."""
    environment = RaceEnvironment(record, car, batch=1)
    spent, decisions = 0.0, 0
    for race in range(TIMED_RACES):
        numbers = np.array([race], np.int64)
        environment.reset(seed, numbers)
        strategist.begin(environment, seed, numbers)
        while not environment.done.all():
            begun = time.perf_counter()
            call = strategist.decide(environment)
            spent += time.perf_counter() - begun
            decisions += 1
            environment.step(call)
    return 1000 * spent / decisions
