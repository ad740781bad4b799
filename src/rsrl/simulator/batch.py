"""A batch of races that is stepped lap by lap from outside, and the lap-by-lap trace of a race."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Unpack

import numpy as np
from numpy.typing import NDArray

from rsrl.season import RaceRecord
from rsrl.simulator import layout as at
from rsrl.simulator.figures import Figures
from rsrl.simulator.plans import Plan
from rsrl.simulator.race import advance_batch, classify, start_batch
from rsrl.simulator.setup import RaceOptions, Rivals, assign_callers, set_up


class RaceBatch:
    """`n` races side by side. Any cars may be called from outside; the others run plans or react.

    Attributes:
        figures: parameters of the race.
        table, callers: plan table and who decides each car's stops, as of `setup.assign_callers`.
        f, k, r: state arrays float32 [n, F_ROWS, CARS], int32 [n, K_ROWS, CARS], int32 [n, R_SIZE]; rows in layout.py.
        actions: int8 [n, CARS], to be filled before each lap for the cars called from outside.
    """

    def __init__(
        self,
        figures: Figures,
        n: int,
        *,
        outside: Sequence[int] = (),
        plans: Mapping[int, Plan] | None = None,
        rivals: Rivals | None = None,
    ) -> None:
        self.figures = figures
        self.table, self.callers = assign_callers(figures, plans or {}, outside=outside, rivals=rivals)
        self.f = np.zeros((n, at.F_ROWS, at.CARS), np.float32)
        self.k = np.zeros((n, at.K_ROWS, at.CARS), np.int32)
        self.r = np.zeros((n, at.R_SIZE), np.int32)
        self.actions = np.zeros((n, at.CARS), np.int8)

    def start(self, seed: int, races: NDArray[np.int64]) -> None:
        """Put every race on its grid; `races` int64 [n] are race numbers of the seed."""
        start_batch(self.figures, self.table, seed, races, self.callers, self.f, self.k, self.r)

    def advance(self) -> None:
        """Run one lap of every race with the actions now in `actions`."""
        advance_batch(self.figures, self.table, self.f, self.k, self.r, self.actions)

    def positions(self) -> NDArray[np.int8]:
        """Classification as it stands, int8 [n, cars], 1 for the winner."""
        out = np.empty((len(self.r), self.figures.whole[at.I_CARS]), np.int8)
        for k, r, row in zip(self.k, self.r, out, strict=True):
            classify(self.figures.whole, k, r, row)
        return out


@dataclass(frozen=True)
class Trace:
    """Races lap by lap; arrays are [races, laps, cars] by car index unless said otherwise."""

    race_time_s: NDArray[np.float64]  # at the end of the lap
    lap_time_s: NDArray[np.float32]  # a stop's loss is split between in-lap and out-lap; race_time_s has all of it at the stop
    place: NDArray[np.int8]  # on the road, 1 for the leader, at the end of the lap
    compound: NDArray[np.int8]  # fitted during the lap
    tyre_age_laps: NDArray[np.int16]  # laps on the set, this lap included
    stopped: NDArray[np.bool_]  # boxed at the end of the lap
    running: NDArray[np.bool_]  # completed the lap
    track_status: NDArray[np.int8]  # [races, laps]


def trace_races(record: RaceRecord, races: int, seed: int, **options: Unpack[RaceOptions]) -> Trace:
    """The same races as `simulate`, recorded lap by lap; options as of `RaceOptions`. Raises RsrlError as `simulate` does."""
    setup = set_up(record, races, **options)
    batch = RaceBatch(setup.figures, races, plans=setup.plans, rivals=setup.rivals)
    batch.start(seed, setup.numbers)
    cars = len(record.cars)
    shape = (races, record.laps, cars)
    trace = Trace(
        np.zeros(shape), np.zeros(shape, np.float32), np.zeros(shape, np.int8), np.zeros(shape, np.int8), np.zeros(shape, np.int16),
        np.zeros(shape, np.bool_), np.zeros(shape, np.bool_), np.zeros(shape[:2], np.int8),
    )  # fmt: skip
    for lap in range(record.laps):
        trace.track_status[:, lap] = batch.r[:, at.R_STATUS]
        trace.compound[:, lap] = batch.k[:, at.K_COMPOUND, :cars]
        trace.tyre_age_laps[:, lap] = batch.k[:, at.K_AGE, :cars] + 1
        batch.advance()
        trace.race_time_s[:, lap] = batch.f[:, at.F_TIME, :cars] + batch.r[:, at.R_CLOCK_MS, None] / 1000.0
        trace.lap_time_s[:, lap] = batch.f[:, at.F_LAP, :cars]
        trace.place[:, lap] = batch.k[:, at.K_PLACE, :cars] + 1
        trace.stopped[:, lap] = batch.k[:, at.K_STOPPED, :cars] == 1
        trace.running[:, lap] = batch.k[:, at.K_PLACE, :cars] < batch.r[:, at.R_RUNNING, None]
    return trace
