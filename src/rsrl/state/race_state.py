"""The paper's `UnifiedRaceState` and `UnifiedRaceStrategy`: one description of a race for every source, one of what is to be done."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.season import COMPOUNDS, TRACK_STATUS_NAMES, RaceRecord, track_code
from rsrl.simulator import Figures, compile_figures
from rsrl.simulator import layout as at
from rsrl.state.expectation import REGAINED, expectation_table
from rsrl.state.features import RAW_SIZE
from rsrl.state.observe import NO_GAP, TimingData, observe_row
from rsrl.state.outlook import outlook_table
from rsrl.state.race_context import RaceContext, mean_stop_s, race_figures
from rsrl.state.vocabulary import Action


@dataclass(frozen=True)
class CarState:
    """One car as everybody on the pit wall sees it."""

    driver: str
    position: int  # 1 is the leader
    gap_to_leader_s: float | None  # None for a car that has retired
    last_lap_s: float
    compound: str  # S, M or H
    tyre_age_laps: int  # laps that the set has run, those before the race included
    stops: int
    running: bool = True
    just_stopped: bool = False  # boxed at the end of the last lap
    form_s: float = 0.0  # form of the day against the season's figures, by the laps shown so far
    worn_laps: float | None = None  # age of the set in racing laps, which slow laps add less to; None: tyre_age_laps
    set_luck_s: float = 0.0  # pace on the set fitted beyond form and compound, by the laps shown on it


@dataclass(frozen=True)
class UnifiedRaceState:
    """A race after `laps_completed` laps, with the track status of the coming lap; made by a translator from any source.

    Attributes:
        track_status: 0 green, 1 virtual safety car, 2 safety car, 3 red flag.
        status_laps: laps since that status began, 0 on its first lap.
        compounds_used, sets_left: of the car that is called; sets_left counts soft, medium, hard, the fitted set not included.
        previous_gap_ahead_s: gap to the car then ahead, one lap earlier; None where there was none.
    """

    race: str
    driver: str
    laps_completed: int
    total_laps: int
    track_status: int
    status_laps: int
    cars: tuple[CarState, ...]
    compounds_used: frozenset[str]
    sets_left: tuple[int, int, int]
    previous_gap_ahead_s: float | None = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.laps_completed < self.total_laps:
            raise RsrlError(f"state: lap {self.laps_completed} of {self.total_laps} leaves nothing to decide")
        if self.track_status not in range(len(TRACK_STATUS_NAMES)):
            raise RsrlError(f"state: track_status is {self.track_status}; 0 green, 1 virtual safety car, 2 safety car, 3 red flag")
        if self.driver not in {c.driver for c in self.cars if c.running}:
            raise RsrlError(f"state: {self.driver} is not among the running cars")
        if bad := {c.compound for c in self.cars} - set(COMPOUNDS):
            raise RsrlError(f"state: unknown compound {sorted(bad)[0]!r}; compounds are {', '.join(COMPOUNDS)}")


@dataclass(frozen=True)
class UnifiedRaceStrategy:
    """A strategist's answer for one lap: the call, and, where it has them, the values behind it and the stops it plans."""

    action: Action
    q_values: dict[str, float] | None = None  # by action name, in the policy's units: of reward, or minus positions
    planned_stops: tuple[tuple[int, str], ...] = field(default=())  # (lap, compound)


class Observer:
    """Turns states of one race into raw feature rows, with the same compiled code the simulator's states go through."""

    def __init__(self, record: RaceRecord, car: int) -> None:
        self.record = record
        self.car = car
        self.figures: Figures = compile_figures(record)
        pit_cost_s = mean_stop_s(self.figures, car)
        self.context = RaceContext(
            track=track_code(record.grand_prix, record.season),
            reference_s=np.float32(self.figures.track[at.T_BASE]),
            pit_cost_s=pit_cost_s,
            outlook=outlook_table(self.figures, float(pit_cost_s[0]), car),
            expectation=expectation_table(self.figures, car, regained=REGAINED),
            paces=np.ascontiguousarray(self.figures.cars[at.C_PACE]),
            figures=race_figures(record, car, pit_cost_s),
        )
        self._pace_of = {entry.driver: self.context.paces[i] for i, entry in enumerate(record.cars)}

    def row(self, state: UnifiedRaceState) -> NDArray[np.float32]:
        """Raw feature row float32 [RAW_SIZE] of a state. Raises RsrlError where the state is of another race or car."""
        own_driver = self.record.cars[self.car].driver
        if state.driver != own_driver or state.total_laps != self.record.laps:
            raise RsrlError(f"state of {state.driver} over {state.total_laps} laps does not belong to {own_driver} at {self.record.name}")
        if unknown := {c.driver for c in state.cars} - set(self._pace_of):
            raise RsrlError(f"state: {min(unknown)} did not start at {self.record.name}")
        cars = sorted(state.cars, key=lambda c: (not c.running, c.position))
        own = next(i for i, c in enumerate(cars) if c.driver == state.driver)
        soft, medium, hard = state.sets_left
        # numbers of the types that the environment passes, so that one compiled `observe` serves both
        timing = TimingData(
            lap=state.laps_completed,
            status=np.int32(state.track_status),
            since=np.int32(state.status_laps),
            running=np.int32(sum(c.running for c in cars)),
            # what stands for a retired car's time is never read
            time=np.array([NO_GAP if c.gap_to_leader_s is None else c.gap_to_leader_s for c in cars], np.float32),
            last_lap=np.array([c.last_lap_s for c in cars], np.float32),
            place=np.arange(len(cars), dtype=np.int32),
            order=np.arange(len(cars), dtype=np.int32),
            compound=np.array([COMPOUNDS.index(c.compound) for c in cars], np.int32),
            age=np.array([c.tyre_age_laps for c in cars], np.int32),
            wear=np.array([c.tyre_age_laps if c.worn_laps is None else c.worn_laps for c in cars], np.float32),
            stops=np.array([c.stops for c in cars], np.int32),
            stopped=np.array([c.just_stopped for c in cars], np.int32),
            form=np.array([c.form_s for c in cars], np.float32),
            set_luck=np.array([c.set_luck_s for c in cars], np.float32),
            used=np.int32(sum(1 << COMPOUNDS.index(c) for c in state.compounds_used)),
            sets_left=(np.int32(soft), np.int32(medium), np.int32(hard)),
            previous_gap=NO_GAP if state.previous_gap_ahead_s is None else np.float32(state.previous_gap_ahead_s),
        )
        context = self.context._replace(paces=np.array([self._pace_of[c.driver] for c in cars], np.float32))
        out = np.zeros(RAW_SIZE, np.float32)
        observe_row(out, own, timing, context, np.int32(self.record.laps), self.figures.tyres)
        return out
