"""What Formula One teams do: before each lap the race is run on many times from where it stands, under each plan worth it.

At every decision the candidates are next stops: now, for each compound, or so many laps later. All of them meet the same futures
(`rollouts.plans`), which hold nothing but what a pit wall knows, pace learned from lap times included (`PaceFilter`). After its next
stop, and under safety cars, the car goes on by clean-air foresight (`foresight`). The call is that of the best mean place (`trial`).
"""

from concurrent.futures import ThreadPoolExecutor
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.rollouts import B_STINT, PLAN_SMOOTH_POSITION, PaceFilter, RolloutMemory, roll_out_plans, rollout_memory
from rsrl.season import GREEN, RaceRecord
from rsrl.simulator import available_cores, compile_figures
from rsrl.simulator import layout as at
from rsrl.strategists.hashing import word_of
from rsrl.strategists.interface import Strategist
from rsrl.strategists.lookahead.candidates import Candidates, NextStops, worth_racing
from rsrl.strategists.lookahead.clean_air_values import foresee
from rsrl.strategists.lookahead.successive_rejects import best_candidate

LAPS_PER_MS: Final = 2500
"""Simulated laps of a race that count as a millisecond of a decision, so that a budget gives the same calls on any machine.

Measured on one core of an AMD EPYC: 0.31 to 0.41 microseconds of processor time a lap. A slower machine takes longer than its budget says.
"""

BUDGET_MS: Final = 20.0
LUCK: Final = 0x9A11
"""Sets a planner's futures apart from the races it calls."""

CANDIDATES: Final = 20
REACH_S: Final = 8.0
REACH_SLOW_S: Final = 30.0
"""Next stops slower in clean air than the best by more are not raced, on a racing lap and under a safety car."""

TASKS_PER_CORE: Final = 4


class PlannerStrategist(Strategist):
    """Calls each race by rollouts.

    Attributes:
        laps_spent: int64 [B], laps simulated for the last decision.

    Raises:
        RsrlError: a budget of nothing.
    """

    races_alone = True

    def __init__(self, record: RaceRecord, car: int, seed: int, budget_ms: float = BUDGET_MS, *, name: str = "planner") -> None:
        if not budget_ms > 0:
            raise RsrlError(f"budget_ms is {budget_ms}; a planner needs some time for a decision")
        self.name, self._car, self._own_seed = name, car, seed
        self.budget_laps = int(budget_ms * LAPS_PER_MS)
        self._figures = compile_figures(record)
        self._foresight = foresee(self._figures, car)
        self._stops = NextStops(self._figures, self._foresight)

    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        """Remember which races these are, and know nothing of their cars' form."""
        self._seed, self._races = seed, races
        self._watch = PaceFilter(self._figures, len(races))
        self.laps_spent = np.zeros(len(races), np.int64)

    def decide(self, environment: RaceEnvironment) -> NDArray[np.int8]:
        """The call of the best candidate, race by race, on all cores."""
        b = environment.races
        self._watch.update(b.f, b.k, b.r)
        calls = np.zeros(environment.batch, np.int8)
        self.laps_spent[:] = 0
        going = np.flatnonzero(~environment.done)

        def call_some(rows: NDArray[np.int64]) -> None:
            memory = rollout_memory()
            for row in rows:
                calls[row] = self._call(environment, int(row), memory)

        parts = np.array_split(going, max(min(len(going), TASKS_PER_CORE * available_cores()), 1))
        if len(parts) == 1:
            call_some(parts[0])
        else:
            with ThreadPoolExecutor(available_cores()) as pool:
                list(pool.map(call_some, parts))
        return calls

    def _call(self, environment: RaceEnvironment, i: int, memory: RolloutMemory) -> int:
        legal = environment.legal[i]
        if legal.sum() == 1:
            return int(legal.argmax())
        candidates = self._candidates(environment, i)
        if (candidates.call == candidates.call[0]).all():
            return int(candidates.call[0])
        b = environment.races
        rows, state = candidates.rows(), (b.f[i], b.k[i], b.r[i])
        done = int(b.r[i, at.R_LAP])
        to_go, seed = environment.laps - done, word_of(LUCK, self._own_seed, self._seed, int(self._races[i]), done)
        futures = 0

        def race(alive: NDArray[np.int64], more: int) -> NDArray[np.float32]:
            nonlocal futures
            out = roll_out_plans(
                self._figures, rows[alive], self._foresight, self._watch.belief[i], state, self._car,
                seed=seed, first=futures, futures=more, spared=self._car, memory=memory,
            )  # fmt: skip
            futures += more
            self.laps_spent[i] += more * len(alive) * to_go
            return out[:, :, PLAN_SMOOTH_POSITION]

        return int(candidates.call[best_candidate(candidates, race, self.budget_laps // to_go)])

    def _candidates(self, environment: RaceEnvironment, i: int) -> Candidates:
        """Next stops worth racing in race `i`."""
        k, r, car = environment.races.k[i], environment.races.r[i], self._car
        status = int(r[at.R_STATUS])
        every = self._stops.all(
            lap=int(r[at.R_LAP]) + 1,
            status=status,
            compound=int(k[at.K_COMPOUND, car]),
            age=int(k[at.K_AGE, car]),
            used=int(k[at.K_USED, car]),
            sets=k[at.K_SOFT_SETS : at.K_SOFT_SETS + 3, car],
            legal=environment.legal[i],
            luck_s=float(self._watch.belief[i, B_STINT, car]),
        )
        return worth_racing(every, CANDIDATES, REACH_S if status == GREEN else REACH_SLOW_S)
