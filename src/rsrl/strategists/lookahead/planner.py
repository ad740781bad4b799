"""Monte Carlo planning as Formula One teams do it: before each lap, the rest of the race is simulated for every promising next stop.

At every decision the candidates are next stops: on the coming lap, for each compound, or on a later one. All candidates meet the same
futures (`rollouts.plans`), drawn from what a pit wall knows, pace estimated from lap times included (`PaceFilter`). After its
next stop, and under safety cars, the car in a future follows the clean-air value function (`clean_air_values`). Successive rejects pick
the candidate of the best mean finishing position (`successive_rejects`).
"""

from concurrent.futures import ThreadPoolExecutor
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.rollouts import B_STINT, PLAN_SMOOTH_POSITION, PaceFilter, RolloutMemory, roll_out_plans, rollout_memory
from rsrl.rollouts.hashing import stream_seed
from rsrl.season import GREEN, RaceRecord
from rsrl.simulator import available_cores, compile_figures
from rsrl.simulator import layout as at
from rsrl.strategists.interface import Strategist
from rsrl.strategists.lookahead.candidates import Candidates, CandidateStops, shortlist
from rsrl.strategists.lookahead.clean_air_values import clean_air_values
from rsrl.strategists.lookahead.successive_rejects import best_candidate

LAPS_PER_MS: Final = 2500
"""Simulated laps that count as a millisecond of a decision, so that a budget gives the same calls on any machine.

Measured on one core of an AMD EPYC: 0.31 to 0.41 microseconds of processor time a lap. A slower machine exceeds the budget in time.
"""

BUDGET_MS: Final = 20.0
SEED_SALT: Final = 0x9A11
"""Keeps the random numbers of the planner's futures apart from those of the races it calls."""

MAX_CANDIDATES: Final = 20
MAX_COST_S: Final = 8.0
MAX_COST_CAUTION_S: Final = 30.0
"""Next stops that lose more than this to the best in clean air are not simulated, on a green lap and under a safety car."""

TASKS_PER_CORE: Final = 4


class PlannerStrategist(Strategist):
    """Calls each race by simulating candidate stops to the flag.

    Args:
        seed: of the planner's futures.
        budget_ms: time for one decision, counted as `LAPS_PER_MS` simulated laps a millisecond.

    Attributes:
        laps_simulated: int64 [B], for the last decision.

    Raises:
        RsrlError: the budget is not positive.
    """

    batch_invariant = True

    def __init__(self, record: RaceRecord, car: int, seed: int, budget_ms: float = BUDGET_MS, *, name: str = "planner") -> None:
        if not budget_ms > 0:
            raise RsrlError(f"budget_ms is {budget_ms}; give a planner more than zero milliseconds for a decision")
        self.name, self._car, self._own_seed = name, car, seed
        self.budget_laps = int(budget_ms * LAPS_PER_MS)
        self._figures = compile_figures(record)
        self._foresight = clean_air_values(self._figures, car)
        self._stops = CandidateStops(self._figures, self._foresight, car)

    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        """Start these races with no knowledge of the cars' form."""
        self._seed, self._races = seed, races
        self._pace_filter = PaceFilter(self._figures, len(races))
        self.laps_simulated = np.zeros(len(races), np.int64)

    def decide(self, environment: RaceEnvironment) -> NDArray[np.int8]:
        """The call of the best candidate of each race; races are spread over all cores."""
        b = environment.races
        self._pace_filter.update(b.f, b.k, b.r)
        calls = np.zeros(environment.batch, np.int8)
        self.laps_simulated[:] = 0
        running = np.flatnonzero(~environment.done)

        def call_some(rows: NDArray[np.int64]) -> None:
            memory = rollout_memory()
            for row in rows:
                calls[row] = self._call(environment, int(row), memory)

        parts = np.array_split(running, max(min(len(running), TASKS_PER_CORE * available_cores()), 1))
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
        rows, state = candidates.plan_rows(), (b.f[i], b.k[i], b.r[i])
        done = int(b.r[i, at.R_LAP])
        to_go, seed = environment.laps - done, stream_seed(SEED_SALT, self._own_seed, self._seed, int(self._races[i]), done)
        futures = 0

        def simulate(alive: NDArray[np.int64], more: int) -> NDArray[np.float32]:
            nonlocal futures
            out = roll_out_plans(
                self._figures, rows[alive], self._foresight, self._pace_filter.belief[i], state, self._car,
                seed=seed, first=futures, futures=more, spared=self._car, memory=memory,
            )  # fmt: skip
            futures += more
            self.laps_simulated[i] += more * len(alive) * to_go
            return out[:, :, PLAN_SMOOTH_POSITION]

        return int(candidates.call[best_candidate(candidates, simulate, self.budget_laps // to_go)])

    def _candidates(self, environment: RaceEnvironment, i: int) -> Candidates:
        """The candidates to simulate in race `i`."""
        k, r, car = environment.races.k[i], environment.races.r[i], self._car
        status = int(r[at.R_STATUS])
        every = self._stops.every_stop(
            lap=int(r[at.R_LAP]) + 1,
            status=status,
            compound=int(k[at.K_COMPOUND, car]),
            age=int(k[at.K_AGE, car]),
            used=int(k[at.K_USED, car]),
            stops_made=int(k[at.K_STOPS, car]),
            sets=k[at.K_SOFT_SETS : at.K_SOFT_SETS + 3, car],
            legal=environment.legal[i],
            stint_offset_s=float(self._pace_filter.belief[i, B_STINT, car]),
        )
        return shortlist(every, MAX_CANDIDATES, MAX_COST_S if status == GREEN else MAX_COST_CAUTION_S)
