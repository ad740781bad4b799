"""What is known of a race and a car before the start. A policy knows a track by these figures (`FIGURES`), not by its name."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.season import COMPOUNDS, TRACK_STATUS_NAMES, RaceRecord
from rsrl.simulator import Figures, compile_figures
from rsrl.state.expectation import Expectation
from rsrl.state.features import FIGURES
from rsrl.state.outlook import expected_stop_s


class RaceContext(NamedTuple):
    """What the compiled observer needs to know of a race and a car, the same on every lap.

    Attributes:
        track: code of the track, -1 for one that has none.
        reference_s: lap time of which a lap time is expressed as a ratio, s.
        pit_cost_s: float32 [4], mean loss of a stop by track status, s.
        outlook: table of `outlook_table`.
        expectation: of `expectation_table`.
        paces: float32 [cars], lap time of each car against the mean of the field, s.
        figures: float32, the columns of `FIGURES`.
    """

    track: int
    reference_s: np.float32
    pit_cost_s: NDArray[np.float32]
    outlook: NDArray[np.float32]
    expectation: Expectation
    paces: NDArray[np.float32]
    figures: NDArray[np.float32]


def context_figures(record: RaceRecord, car: int) -> NDArray[np.float32]:
    """The figures of a race and car, float32 [len(FIGURES)]."""
    return race_figures(record, car, mean_stop_s(compile_figures(record), car))


def mean_stop_s(figures: Figures, car: int) -> NDArray[np.float32]:
    """Mean loss of a stop by track status, float32 [4]."""
    return np.array([expected_stop_s(figures, car, status) for status in range(len(TRACK_STATUS_NAMES))], np.float32)


def race_figures(record: RaceRecord, car: int, pit_cost_s: NDArray[np.float32]) -> NDArray[np.float32]:
    """The figures of a race and car, float32 [len(FIGURES)], in their order; `pit_cost_s` [4] by track status."""
    soft, medium, hard = (record.tyres[c] for c in COMPOUNDS)
    paces = np.array([entry.pace_s.value for entry in record.cars])
    plans = record.rivals.plans
    weight = sum(p.weight for p in plans)
    values = {
        "race_laps": record.laps,
        "pit_loss_s": pit_cost_s[0],
        "pit_loss_vsc_s": pit_cost_s[1],
        "pit_loss_sc_s": pit_cost_s[2],
        "wear_soft_s": soft.wear_s_per_lap.value,
        "wear_medium_s": medium.wear_s_per_lap.value,
        "wear_hard_s": hard.wear_s_per_lap.value,
        "offset_soft_s": soft.offset_s.value - medium.offset_s.value,
        "offset_hard_s": hard.offset_s.value - medium.offset_s.value,
        "pass_threshold_s": record.track.pass_threshold_s.value,
        "sc_chance": record.incidents.sc_per_lap.value,
        "vsc_chance": record.incidents.vsc_per_lap.value,
        "set_limit_laps": record.max_laps_per_set,
        "rival_stops": sum(p.plan.count("@") * p.weight for p in plans) / weight,
        "grid": record.cars[car].grid,
        "pace_s": paces[car] - paces.mean(),
        "pace_place": 1 + int((paces < paces[car]).sum()),
        "field_spread_s": paces.std(),
    }
    return np.array([values[f.name] for f in FIGURES], np.float32)
