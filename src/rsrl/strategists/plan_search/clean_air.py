"""Expected race time of every legal plan on an empty track: exact, and fast enough for a million plans."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from rsrl.season import RaceRecord
from rsrl.simulator import Figures, Plan, compile_figures
from rsrl.simulator import layout as at
from rsrl.state import expected_stop_s
from rsrl.state.outlook import lap_cost

MAX_STOPS = 3


@dataclass(frozen=True)
class PlanFamily:
    """All legal plans of one compound sequence.

    Attributes:
        compounds: codes, stint by stint.
        laps: last lap of each stint except the final one, int64 [plans, stops].
        time_s: expected clean-air race time, relative to reference laps throughout, float64 [plans].
    """

    compounds: tuple[int, ...]
    laps: NDArray[np.int64]
    time_s: NDArray[np.float64]


class CleanAir:
    """Race times of one car's plans on an empty track without safety cars.

    Each stop costs its mean loss, the launch what its compound gives or takes.
    """

    def __init__(self, record: RaceRecord, car: int) -> None:
        self._record = record
        self._sets = record.sets_of(car)
        figures = compile_figures(record)
        self._stints = stint_times_s(figures, max(max(laps, default=0) for laps in self._sets))
        self._launch = figures.tyres[:, at.Y_LAUNCH].astype(np.float64)
        self._cold = figures.tyres[:, at.Y_COLD].astype(np.float64)
        self._stop_s = expected_stop_s(figures, car)

    def time_s(self, plan: Plan) -> float:
        """Expected race time of a plan, relative to reference laps throughout, s."""
        edges = np.array([0, *plan.laps, self._record.laps])
        return float(self._times_s(plan.compounds, np.diff(edges)[None])[0])

    def families(self, starts: tuple[int, ...], max_stops: int = MAX_STOPS) -> list[PlanFamily]:
        """Every legal plan of 1 to `max_stops` stops from these starting compounds, by compound sequence; no family is empty.

        About a million plans for 57 laps and 3 stops.
        """
        families = []
        limit, counts = self._record.max_laps_per_set, [len(laps) for laps in self._sets]
        for stops in range(max(self._record.min_sets - 1, 1), max_stops + 1):
            laps = np.array(list(combinations(range(1, self._record.laps), stops)), np.int64).reshape(-1, stops)
            lengths = np.diff(laps, axis=1, prepend=0, append=self._record.laps)
            if limit:
                kept = (lengths <= limit).all(axis=1)
                laps, lengths = laps[kept], lengths[kept]
            if len(laps):
                families += [PlanFamily(c, laps, self._times_s(c, lengths)) for c in legal_sequences(counts, stops, starts)]
        return families

    def _times_s(self, compounds: tuple[int, ...], lengths: NDArray[np.int64]) -> NDArray[np.float64]:
        """Times of plans of one compound sequence from their stint lengths, int64 [plans, stints]; the freshest set is fitted first."""
        stops = len(compounds) - 1
        launch_s = float(self._launch[compounds[0]])
        time_s = np.full(len(lengths), launch_s + stops * self._stop_s + self._cold[list(compounds[1:])].sum())
        for stint, compound in enumerate(compounds):
            before = self._sets[compound][compounds[:stint].count(compound)]
            worn = self._stints[compound]
            time_s += worn[before + lengths[:, stint]] - worn[before]
        return time_s


def stint_times_s(figures: Figures, used: int = 0) -> NDArray[np.float64]:
    """Tyre time of a stint on a new set, by compound and stint length, float64 [3, laps + used + 1]; without the cold first lap.

    `used`: laps that a set may have run before the race. The difference of two times is that of a stint on a used set.
    """
    laps = int(figures.whole[at.I_LAPS]) + used
    times = np.zeros((3, laps + 1))
    for compound in range(3):
        times[compound, 1:] = np.cumsum([float(lap_cost(figures.tyres, compound, age)) for age in range(laps)])
    return times


def legal_sequences(sets: Sequence[int], stops: int, starts: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
    """Compound sequences of `stops` stops that use at least two compounds and no more than the car's `sets` of each, [3]."""
    for compounds in product(range(3), repeat=stops + 1):
        enough = all(compounds.count(c) <= n for c, n in enumerate(sets))
        if compounds[0] in starts and enough and len(set(compounds)) > 1:
            yield compounds
