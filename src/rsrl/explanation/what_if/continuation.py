"""Races run on from a moment under a forced call and then the policy, in futures that every option shares."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from rsrl.explanation.moment import Arrays, Moment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.explanation.what_if.forward import Forward
from rsrl.rollouts.batch_kernels import O_COLUMNS, drive_lanes, open_futures
from rsrl.rollouts.belief import belief_of
from rsrl.simulator import available_cores
from rsrl.simulator import layout as at
from rsrl.simulator.engine import working_memory
from rsrl.state import RAW_SIZE, Observer
from rsrl.strategists.hashing import stream_seed

CHUNK_FUTURES: Final = 32
"""Futures driven side by side: their state stays in the processor's cache. Fixed, so that no bit depends on the number of threads."""

LUCK: Final = 0x3FA1
"""Sets the futures apart from the races that anybody drives by the same seed."""

Progress = Callable[[int, int], None]
"""Called with (futures done, futures in all)."""


@dataclass(frozen=True)
class Option:
    """What is tried: stay out until `offset` laps after the moment, make `call` there (0 stay, 1 + compound), then follow the policy."""

    offset: int
    call: int


STAY: Final = Option(0, 0)


class Continuation:
    """Runs races of one record and car on from where they stand, all before the same lap.

    Args:
        moments: the states to go on from; one as a rule.
    """

    def __init__(self, policy: ExplainedPolicy, moments: Sequence[Moment]) -> None:
        self._policy = policy
        self.record, self.car, self.lap = moments[0].record, moments[0].car, moments[0].lap
        observer = Observer(self.record, self.car)
        self._figures, self._known = observer.figures, observer.known
        self._encoder = policy.encoder(self.record)
        self._state = tuple(np.stack([m.arrays[i] for m in moments]) for i in range(3))
        self._beliefs = np.stack([belief_of(self._figures, f) for f in self._state[0]])
        self._always = policy.recurrent or not policy.agent.masked
        self._memory = np.concatenate([self._memory_after(m) for m in moments])

    def _memory_after(self, moment: Moment) -> NDArray[np.float32]:
        """The policy's memory [1, M] once it has seen the moment."""
        memory = self._policy.agent.initial_memory(1)
        if self._policy.recurrent:
            for row in self._encoder(moment.raw):
                memory = self._policy.agent.q_values(row[None], memory)[1]
        return memory

    def run(
        self,
        options: Sequence[Option],
        futures: int,
        seed: int,
        *,
        first: int = 0,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> NDArray[np.float64]:
        """Results of every option, float64 [futures, options, O_COLUMNS] (`kernels`).

        Futures `first`, `first` + 1 ... of `seed` go on from the states in turn, and are the same for all options.
        """
        out = np.empty((futures, len(options), O_COLUMNS))
        starts = range(0, futures, CHUNK_FUTURES)
        done = 0

        def part(start: int) -> int:
            numbers = np.arange(start, min(start + CHUNK_FUTURES, futures), dtype=np.int64) + first
            out[start : start + len(numbers)] = self._chunk(options, numbers, stream_seed(LUCK, seed))
            return len(numbers)

        # a matrix library's own threads would stand in the way of these, and could change bits
        with threadpool_limits(1), ThreadPoolExecutor(threads or available_cores()) as pool:
            for size in pool.map(part, starts):
                done += size
                if progress:
                    progress(done, futures)
        return out

    def _chunk(self, options: Sequence[Option], numbers: NDArray[np.int64], seed: int) -> NDArray[np.float64]:
        m, lanes = len(options), len(numbers) * len(options)
        offsets = np.array([o.offset for o in options], np.int32)
        forced = np.array([o.call for o in options], np.int8)
        leaves_at_lap = np.zeros_like(offsets) if self._always else offsets  # a policy that is asked on every lap shares none
        which = numbers % len(self._state[0])
        f, k, r = _lanes(lanes)
        out = np.empty((lanes, O_COLUMNS))
        fs, ks, rs, actions = working_memory()
        g, table = self._figures, self._figures.rival_plans
        open_futures(
            g, table, self._beliefs, *self._state, which, np.uint64(seed), numbers, self.car, leaves_at_lap, fs, ks, rs, actions,
            np.zeros(O_COLUMNS), f, k, r, out,
        )  # fmt: skip
        calls, alive = np.zeros(lanes, np.int8), np.empty(lanes, np.int32)
        asked, counts = np.empty(lanes, np.int32), np.zeros(2, np.int64)
        x, legal = np.empty((lanes, self._encoder.width), np.float32), np.empty((lanes + 1, 4), np.bool_)
        memory = self._memory[np.repeat(which, m)]
        raw, positions = np.zeros(RAW_SIZE, np.float32), np.zeros(at.CARS, np.int8)
        forward = Forward(self._policy.agent)
        of_option = np.tile(leaves_at_lap, len(numbers))
        duplicate_lanes = np.zeros(0, np.int64)
        for lap in range(self.record.laps - self.lap + 1):
            woken = np.flatnonzero(of_option == lap)
            if lap > 0 and options[0] == STAY and not self._always:
                same = self._same_as_first(woken, m, k, calls, forced)
                duplicate_lanes, woken = np.concatenate([duplicate_lanes, woken[same]]), woken[~same]
            alive[counts[0] : counts[0] + len(woken)] = woken
            counts[0] += len(woken)
            drive_lanes(
                g, table, f, k, r, alive, lap, offsets, forced, calls, self.car, self._known, self._encoder.rows, self._encoder.values,
                self._always, actions, positions, raw, counts, x, legal, asked, out,
            )  # fmt: skip
            if n := int(counts[1]):
                lane = asked[:n]
                calls[lane], memory[lane] = forward(x[:n], legal[:n], memory[lane])
        out[duplicate_lanes] = out[duplicate_lanes // m * m]
        return out.reshape(len(numbers), m, O_COLUMNS)

    def _same_as_first(
        self, woken: NDArray[np.int64], m: int, k: NDArray[np.int32], calls: NDArray[np.int8], forced: NDArray[np.int8]
    ) -> NDArray[np.bool_]:
        """Lanes about to do what the policy, left alone, does in the same future: its first stop, on this lap, for this compound."""
        first = woken // m * m
        stops = k[:, at.K_STOPS, self.car]
        return (calls[first] == forced[woken % m]) & (stops[first] == stops[woken])


def _lanes(n: int) -> Arrays:
    f, k = np.empty((n, at.F_ROWS, at.CARS), np.float32), np.empty((n, at.K_ROWS, at.CARS), np.int32)
    return f, k, np.empty((n, at.R_SIZE), np.int32)
