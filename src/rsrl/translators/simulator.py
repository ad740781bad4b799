"""The simulator's arrays as a `UnifiedRaceState`, and a simulated race that takes `UnifiedRaceStrategy` as calls."""

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.season import COMPOUND_NAMES, COMPOUNDS, RaceRecord
from rsrl.simulator import Plan, RaceBatch, compile_figures
from rsrl.simulator import layout as at
from rsrl.simulator.lap import OUT
from rsrl.state import CarState, UnifiedRaceState, UnifiedRaceStrategy


class Races(Protocol):
    """Races in the simulator's arrays, such as a `simulator.RaceBatch`."""

    f: NDArray[np.float32]
    k: NDArray[np.int32]
    r: NDArray[np.int32]


def simulated_state(record: RaceRecord, batch: Races, row: int, car: int) -> UnifiedRaceState:
    """Race `row` of a batch as the pit wall of `car` sees it before the coming lap.

    `Observer.row` of it equals the raw row of the environment bit for bit. Times that stand in the arrays for "retired" and "nobody ahead"
    become None.

    Raises:
        RsrlError: the car has retired, or the race is over.
    """
    f, k, r = batch.f[row], batch.k[row], batch.r[row]
    place = k[at.K_PLACE]
    return UnifiedRaceState(
        race=record.name,
        driver=record.cars[car].driver,
        laps_completed=int(r[at.R_LAP]),
        total_laps=record.laps,
        track_status=int(r[at.R_STATUS]),
        status_laps=int(r[at.R_SINCE]),
        cars=tuple(_car_state(record, f, k, r, i) for i in np.argsort(place[: len(record.cars)])),
        compounds_used=frozenset(c for code, c in enumerate(COMPOUNDS) if k[at.K_USED, car] >> code & 1),
        sets_left=_sets_left(k, car),
        previous_gap_ahead_s=None if f[at.F_GAP, car] >= OUT else float(f[at.F_GAP, car]),
    )


def _car_state(record: RaceRecord, f: NDArray[np.float32], k: NDArray[np.int32], r: NDArray[np.int32], car: int) -> CarState:
    place = int(k[at.K_PLACE, car])
    leader = k[at.K_ORDER, 0]
    running = place < int(r[at.R_RUNNING])
    return CarState(
        driver=record.cars[car].driver,
        position=place + 1,
        gap_to_leader_s=float(f[at.F_TIME, car] - f[at.F_TIME, leader]) if running else None,  # in float32, as in the environment
        last_lap_s=float(f[at.F_LAP, car]),
        compound=COMPOUNDS[k[at.K_COMPOUND, car]],
        tyre_age_laps=int(k[at.K_AGE, car]),
        stops=int(k[at.K_STOPS, car]),
        running=running,
        just_stopped=bool(k[at.K_STOPPED, car]),
        form_s=float(f[at.F_FORM, car]),
        worn_laps=float(f[at.F_WEAR, car]),
        set_luck_s=float(f[at.F_LUCK, car]),
    )


def _sets_left(k: NDArray[np.int32], car: int) -> tuple[int, int, int]:
    soft, medium, hard = (int(k[at.K_SOFT_SETS + code, car]) for code in range(3))
    return soft, medium, hard


class SimulatedRace:
    """Race number `race` of `seed`, one car of it called from outside; a `Translator`.

    Attributes:
        batch: the race itself, a batch of one.
    """

    def __init__(self, record: RaceRecord, car: int, seed: int, race: int = 0, *, plans: Mapping[int, Plan] | None = None) -> None:
        self.record, self.car = record, car
        self.batch = RaceBatch(compile_figures(record), 1, outside=(car,), plans=plans)
        self.batch.start(seed, np.array([race], np.int64))

    def state(self) -> UnifiedRaceState | None:
        """The race before the coming lap; None after the flag or the car's retirement."""
        over = self.batch.r[0, at.R_FLAGGED] or self.batch.k[0, at.K_PLACE, self.car] >= self.batch.r[0, at.R_RUNNING]
        return None if over else simulated_state(self.record, self.batch, 0, self.car)

    def apply(self, strategy: UnifiedRaceStrategy) -> None:
        """Run the coming lap with the call. Raises RsrlError after the end, or for a compound without a set left."""
        state = self.state()
        if state is None:
            raise RsrlError(f"{self.record.name}: the race is over for {self.record.cars[self.car].driver}; there is nothing left to call")
        call = int(strategy.action)
        if call and state.sets_left[call - 1] < 1:
            raise RsrlError(
                f"{state.driver} has no set of {COMPOUND_NAMES[call - 1]}s left after lap {state.laps_completed}; call another tyre"
            )
        self.batch.actions[0, self.car] = call
        self.batch.advance()

    def position(self) -> int:
        """Position as classified if the race ended now, 1 for the winner."""
        return int(self.batch.positions()[0, self.car])
