"""Every legal plan and its race time with the track to oneself: exact, and quick enough to do for all of them."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from rsrl.season import RaceRecord
from rsrl.simulator import Figures, Plan, compile_figures
from rsrl.simulator.layout import I_LAPS, Y_COLD
from rsrl.state import expected_stop_s
from rsrl.state.outlook import lap_cost


@dataclass(frozen=True)
class PlanFamily:
    """All legal plans on one sequence of compounds.

    Attributes:
        compounds: codes, stint by stint.
        laps: last lap of each stint but the final one, int64 [plans, stops].
        time_s: expected clean-air race time beyond the reference laps, float64 [plans].
    """

    compounds: tuple[int, ...]
    laps: NDArray[np.int64]
    time_s: NDArray[np.float64]


def stint_times_s(figures: Figures) -> NDArray[np.float64]:
    """Tyre time of a stint from new, float64 [3, laps + 1] by compound and length, the cold first lap of a changed set left out."""
    laps = int(figures.whole[I_LAPS])
    ages = np.arange(laps, dtype=np.float64)
    times = np.zeros((3, laps + 1))
    for compound in range(3):
        cost = [float(lap_cost(figures.tyres, compound, age)) for age in ages]
        times[compound, 1:] = np.cumsum(cost)
    return times


def legal_sequences(record: RaceRecord, stops: int, starts: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
    """Sequences of compounds with so many stops that use two compounds and no more sets than there are."""
    for compounds in product(range(3), repeat=stops + 1):
        enough = all(compounds.count(c) <= sets for c, sets in enumerate(record.sets))
        if compounds[0] in starts and enough and len(set(compounds)) > 1:
            yield compounds


def plan_families(
    record: RaceRecord, car: int, starts: tuple[int, ...], max_stops: int = 3, figures: Figures | None = None
) -> list[PlanFamily]:
    """Every legal plan with 1 to `max_stops` stops, by sequence of compounds. Some 2 million plans for 57 laps and 3 stops."""
    figures = figures or compile_figures(record)
    stints, stop_s = stint_times_s(figures), expected_stop_s(figures, car)
    cold = figures.tyres[:, Y_COLD].astype(np.float64)
    families = []
    for stops in range(1, max_stops + 1):
        laps = np.array(list(combinations(range(1, record.laps), stops)), np.int64)
        lengths = np.diff(laps, axis=1, prepend=0, append=record.laps)
        if record.max_laps_per_set:
            kept = (lengths <= record.max_laps_per_set).all(axis=1)
            laps, lengths = laps[kept], lengths[kept]
        for compounds in legal_sequences(record, stops, starts):
            time_s = np.full(len(laps), stops * stop_s + cold[list(compounds[1:])].sum())
            for stint, compound in enumerate(compounds):
                time_s += stints[compound][lengths[:, stint]]
            families.append(PlanFamily(compounds, laps, time_s))
    return families


def clean_air_time_s(plan: Plan, record: RaceRecord, car: int) -> float:
    """Expected race time of one plan beyond the reference laps, s, on an empty track without safety cars."""
    figures = compile_figures(record)
    stints = stint_times_s(figures)
    lengths = np.diff(plan.laps, prepend=0, append=record.laps)
    cold = sum(float(figures.tyres[c, Y_COLD]) for c in plan.compounds[1:])
    tyres = sum(stints[c, n] for c, n in zip(plan.compounds, lengths, strict=True))
    return float(tyres + cold + plan.stops * expected_stop_s(figures, car))
