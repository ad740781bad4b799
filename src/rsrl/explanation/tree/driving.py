"""Races driven by a policy or by a tree, with the policy's own answer to every state: what a tree is fitted to and measured on."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from rsrl.environment import RaceEnvironment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.season import RaceRecord
from rsrl.strategists import Strategist, Tree, TreeRows, TreeStrategist, made_legal

Floats = NDArray[np.float32]
Flags = NDArray[np.bool_]
Calls = NDArray[np.int8]
_BY_LAP: Final = ("rows", "q", "answers", "calls", "legal", "running", "late", "late_q", "late_legal", "late_running")


@dataclass(frozen=True)
class Driven:
    """Races side by side, lap by lap: T laps, R races, C columns.

    Attributes:
        rows: a tree's rows before each lap, float32 [T, R, C].
        q: the policy's values, float32 [T, R, 4]; a recurrent one has followed these very races.
        answers: the policy's calls, int8 [T, R].
        calls: the calls made, int8 [T, R].
        legal: bool [T, R, 4].
        running: the race goes on, bool [T, R].
        late: rows of the state had the car stayed out one lap longer than the driver let it, float32 [T, R, C]; meaningful where a stop was
            called and the race would have gone on. None where not asked for.
        late_q, late_legal: values and legal calls in those states.
        late_running: they exist, bool [T, R].
        position: finishing positions, int64 [R].
        stops, invalid, retired: how the races ended, [R].
    """

    rows: Floats
    q: Floats
    answers: Calls
    calls: Calls
    legal: Flags
    running: Flags
    position: NDArray[np.int64]
    stops: NDArray[np.int64]
    invalid: Flags
    retired: Flags
    late: Floats | None = None
    late_q: Floats | None = None
    late_legal: Flags | None = None
    late_running: Flags | None = None

    @property
    def choices(self) -> Flags:
        """States in which there is something to decide: the race goes on and more than one call is legal, bool [T, R]."""
        return self.running & (self.legal.sum(axis=2) > 1)


class Driver:
    """Drives batches of races of one race record and car.

    Args:
        columns: of the rows to keep; those of a driving tree are made besides.
        batch: races side by side.
        late: also look at what would have come had each stop been made one lap later.
    """

    def __init__(
        self, policy: ExplainedPolicy, record: RaceRecord, car: int, columns: Sequence[str], batch: int, *, late: bool = False
    ) -> None:
        self.policy, self.columns = policy, tuple(columns)
        self.environment = RaceEnvironment(record, car, batch=batch)
        self._encoder = policy.encoder(record)
        self._later = RaceEnvironment(record, car, batch=batch) if late else None

    def drive(self, seed: int, first_race: int, by: "Tree | Strategist | None" = None) -> Driven:
        """Races first_race ... of a seed, driven by the policy, a tree with the legality shield, or any strategist.

        The policy is asked in every state, whoever drives.
        """
        with threadpool_limits(1, "blas"):  # small matrices: threads only get in each other's way, and may change a last bit
            return self._drive(seed, first_race, by)

    def _drive(self, seed: int, first_race: int, by: "Tree | Strategist | None") -> Driven:
        environment, agent = self.environment, self.policy.agent
        numbers = np.arange(first_race, first_race + environment.batch, dtype=np.int64)
        environment.reset(seed, numbers)
        made = TreeRows(self.columns)
        made.begin(len(numbers))
        own = TreeRows(by.columns) if isinstance(by, Tree) and by.columns != self.columns else None
        if own is not None:
            own.begin(len(numbers))
        if isinstance(by, Strategist):
            by.begin(environment, seed, numbers)
        memory = agent.initial_memory(len(numbers))
        laps: list[tuple[NDArray, ...]] = []
        for _ in range(environment.laps):
            if environment.done.all():
                break
            rows = made(environment.raw)
            q, memory = agent.q_values(self._encoder(environment.raw), memory)
            answers = self.policy.chosen(q, environment.legal)
            if isinstance(by, Tree):
                calls = made_legal(by.actions(rows if own is None else own(environment.raw)), environment.legal)
            else:
                calls = answers if by is None else by.decide(environment)
            told = (rows, q, answers, calls, environment.legal.copy(), ~environment.done)
            laps.append(told + self._one_lap_late(calls, made, memory))
            environment.step(calls)
        stacked = (np.stack(column) for column in zip(*laps, strict=True))
        by_lap: dict[str, Any] = dict(zip(_BY_LAP, stacked, strict=False))
        outcome = environment.outcome()
        invalid = ~outcome.valid & ~outcome.retired
        return Driven(**by_lap, position=outcome.position, stops=outcome.stops, invalid=invalid, retired=outcome.retired)

    def positions(self, seed: int, first_race: int, by: Tree) -> NDArray[np.int64]:
        """Finishing positions of races driven by a tree, the policy not asked; int64 [R]."""
        environment, strategist = self.environment, TreeStrategist(by)
        numbers = np.arange(first_race, first_race + environment.batch, dtype=np.int64)
        environment.reset(seed, numbers)
        strategist.begin(environment, seed, numbers)
        while not environment.done.all():
            environment.step(strategist.decide(environment))
        return environment.outcome().position

    def _one_lap_late(self, calls: Calls, made: TreeRows, memory: Floats) -> tuple[NDArray, ...]:
        """The state after a lap in which nobody stopped: rows, the policy's values, legal calls, and where there is such a state."""
        later = self._later
        if later is None:
            return ()
        for there, here in zip((later.races.f, later.races.k, later.races.r), self._arrays(), strict=True):
            there[...] = here
        later.done[...] = self.environment.done
        later.step(np.zeros_like(calls))
        rows = made.peek(later.raw)
        q, _ = self.policy.agent.q_values(self._encoder(later.raw), memory)
        return rows, q, later.legal.copy(), ~later.done & (calls > 0)

    def _arrays(self) -> tuple[NDArray, NDArray, NDArray]:
        races = self.environment.races
        return races.f, races.k, races.r


def joined(parts: Sequence[Driven]) -> Driven:
    """Batches as one: races side by side. A batch whose races all ended early is filled up with races that are over."""
    laps = max(len(part.running) for part in parts)
    arrays: dict[str, Any] = {}
    for name in Driven.__dataclass_fields__:
        values = [getattr(part, name) for part in parts]
        if values[0] is None:
            continue
        if values[0].ndim > 1:
            values = [np.pad(v, [(0, laps - len(v))] + [(0, 0)] * (v.ndim - 1)) for v in values]
            arrays[name] = np.concatenate(values, axis=1)
        else:
            arrays[name] = np.concatenate(values)
    return Driven(**arrays)
