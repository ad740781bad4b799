"""Rollouts of options for one car: each option in the same futures, then any policy to the flag. See batch_kernels.py."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from rsrl.rollouts.batch_kernels import O_COLUMNS, LaneMemory, Lanes, OptionArrays, Starts, drive_lanes, open_lanes
from rsrl.rollouts.belief import belief_of
from rsrl.rollouts.compiled_policy import PolicyInputs
from rsrl.rollouts.hashing import stream_seed
from rsrl.simulator import Figures, available_cores
from rsrl.simulator import layout as at
from rsrl.simulator.race_arrays import RaceArrays, empty_race, empty_races
from rsrl.state import RAW_SIZE

CHUNK_FUTURES: Final = 32
"""Futures driven side by side: their state stays in the processor's cache. Fixed, so that no bit depends on the number of threads."""

Progress = Callable[[int, int], None]
"""Called with (futures done, futures in all)."""

Caller = Callable[[NDArray[np.float32], NDArray[np.bool_], NDArray[np.float32]], tuple[NDArray[np.int8], NDArray[np.float32]]]
"""A policy: calls int8 [n] and its memory afterwards, from inputs float32 [n, F], legal calls bool [n, 4] and memory float32 [n, M]."""


@dataclass(frozen=True)
class Option:
    """Stay out until `offset` laps after the decision, make `call` there (0 stay, 1 + compound), then follow the policy."""

    offset: int
    call: int


STAY: Final = Option(0, 0)


class OptionRollouts:
    """Rolls out races of one record and car from given states, all before the same lap.

    Args:
        inputs: how the policy sees the race.
        caller: the policy; called from several threads at once.
        races: arrays f, k, r of the states, [states, ...].
        memory: of the policy before it is asked about the first lap it calls, float32 [states, M].
        always: whether the policy is asked on every lap: it has a memory, or calls what is not legal.
        salt: keeps the futures apart from all else that is drawn by the same seed.
    """

    def __init__(
        self,
        figures: Figures,
        car: int,
        inputs: PolicyInputs,
        caller: Caller,
        races: RaceArrays,
        memory: NDArray[np.float32],
        *,
        always: bool,
        salt: int,
    ) -> None:
        self._figures, self._car, self._inputs, self._caller = figures, car, inputs, caller
        self._races, self._memory, self._always, self._salt = races, memory, always, salt
        self._beliefs = np.stack([belief_of(figures, f) for f in races.f])
        self._laps = int(figures.whole[at.I_LAPS]) - int(races.r[0, at.R_LAP])

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
        """Results of every option, float64 [futures, options, O_COLUMNS] (`batch_kernels`).

        Futures `first`, `first` + 1 ... of `seed` go on from the states in turn, and are the same for all options.
        """
        out, stream = np.empty((futures, len(options), O_COLUMNS)), stream_seed(self._salt, seed)
        starts = range(0, futures, CHUNK_FUTURES)
        done = 0

        def part(start: int) -> int:
            numbers = np.arange(start, min(start + CHUNK_FUTURES, futures), dtype=np.int64) + first
            out[start : start + len(numbers)] = self._chunk(options, numbers, stream)
            return len(numbers)

        # a matrix library's own threads would stand in the way of these, and could change bits
        with threadpool_limits(1), ThreadPoolExecutor(threads or available_cores()) as pool:
            for size in pool.map(part, starts):
                done += size
                if progress:
                    progress(done, futures)
        return out

    def _chunk(self, options: Sequence[Option], numbers: NDArray[np.int64], seed: int) -> NDArray[np.float64]:
        m = len(options)
        starts = Starts(self._figures, self._figures.rival_plans, self._beliefs, self._races, self._car, np.uint64(seed))
        offsets = np.array([o.offset for o in options], np.int32)
        leaves = np.zeros_like(offsets) if self._always else offsets  # a policy that is asked on every lap shares none
        arrays = OptionArrays(offsets, np.array([o.call for o in options], np.int8), leaves)
        lanes, working = self._lanes(len(numbers) * m), _lane_memory()
        open_lanes(starts, numbers, arrays, lanes, working)
        memory = self._memory[np.repeat(numbers % len(self._memory), m)]
        of_lane = np.tile(leaves, len(numbers))
        duplicate_lanes = np.zeros(0, np.int64)
        for lap in range(self._laps):
            woken = np.flatnonzero(of_lane == lap)
            if lap > 0 and options[0] == STAY and not self._always:
                same = self._same_as_first(woken, m, lanes, arrays.calls)
                duplicate_lanes, woken = np.concatenate([duplicate_lanes, woken[same]]), woken[~same]
            alive = int(lanes.counts[0])
            lanes.alive[alive : alive + len(woken)] = woken
            lanes.counts[0] += len(woken)
            drive_lanes(starts, arrays, self._inputs, lap, self._always, lanes, working)
            if n := int(lanes.counts[1]):
                lane = lanes.asked[:n]
                lanes.calls[lane], memory[lane] = self._caller(lanes.x[:n], lanes.legal[:n], memory[lane])
        lanes.out[duplicate_lanes] = lanes.out[duplicate_lanes // m * m]
        return lanes.out.reshape(len(numbers), m, O_COLUMNS)

    def _same_as_first(self, woken: NDArray[np.int64], m: int, lanes: Lanes, forced: NDArray[np.int8]) -> NDArray[np.bool_]:
        """Lanes about to do what the policy, left alone, does in the same future: its first stop, on this lap, for this compound."""
        first = woken // m * m
        stops = lanes.races.k[:, at.K_STOPS, self._car]
        return (lanes.calls[first] == forced[woken % m]) & (stops[first] == stops[woken])

    def _lanes(self, n: int) -> Lanes:
        return Lanes(
            empty_races(n), np.empty((n, O_COLUMNS)), np.zeros(n, np.int8), np.empty(n, np.int32), np.empty(n, np.int32),
            np.empty((n, self._inputs.width), np.float32), np.empty((n + 1, 4), np.bool_), np.zeros(2, np.int64),
        )  # fmt: skip


def _lane_memory() -> LaneMemory:
    return LaneMemory(
        empty_race(), np.zeros(O_COLUMNS), np.zeros(RAW_SIZE, np.float32), np.zeros(at.CARS, np.int8), np.zeros(at.CARS, np.int8)
    )
