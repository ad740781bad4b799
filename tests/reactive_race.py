"""A made-up race whose rivals react, for tests: coefficients plain enough to be worked out by hand."""

import dataclasses

from rsrl.season import CHOICE_FEATURES, HAZARD_FEATURES, LIFE_NAMES, Figure, RaceRecord

HAZARD = {
    "stops_0": -6.0, "stops_1": -6.5, "stops_2": -7.5, "stops_3": -9.0, "age_0": 1.0, "age_1": 1.0, "green_age_to_80": 8.0,
    "green_age_to_95": 8.0, "green_age_to_110": 6.0, "left_to_50": 3.0, "left_to_110": 0.7, "reach_to_120": 1.5, "one_compound": 0.4,
    "soft": 0.2, "hard": -0.3, "near_ahead": -0.4, "near_behind": 0.8, "ahead_stopped": 0.5, "behind_stopped": 1.0, "window_open": 1.2,
    "mate_stopped": -0.7, "sc_first": 3.0, "sc_second": 2.0, "sc_later": 0.5, "vsc_first": 1.5, "vsc_later": 0.7, "sc_age_to_40": 5.0,
    "vsc_age_to_70": 3.0, "sc_left_to_100": 1.0, "vsc_left_to_30": 0.5, "sc_one_compound": 0.6, "vsc_one_compound": -0.5,
}  # fmt: skip
CHOICE = {"usual_soft": -0.5, "usual_hard": 0.3, "left_to_80": 0.5, "left_to_180": -3.0, "same": -0.6, "second_compound": 1.5}
LIVES = {"S": 5.0, "M": 7.0, "H": 9.0, "S2": 6.0, "M2": 8.0, "H2": 10.0}


def reactive(record: RaceRecord, spread: float = 0.0, **coefficients: float) -> RaceRecord:
    """The record with rivals that react. `spread`: standard error of usual stints, as a share; coefficients replace those of boxing."""
    assert set(HAZARD) <= set(HAZARD_FEATURES)
    assert set(CHOICE) <= set(CHOICE_FEATURES)
    hazard = dict.fromkeys(HAZARD_FEATURES, 0.0) | HAZARD | coefficients
    scale = record.laps / 16
    return dataclasses.replace(
        record,
        rivals=dataclasses.replace(
            record.rivals,
            hazard={n: Figure(hazard[n], 0.0, 1) for n in HAZARD_FEATURES},
            choice={n: Figure(CHOICE.get(n, 0.0), 0.0, 1) for n in CHOICE_FEATURES},
            life_laps={n: Figure(LIVES[n] * scale, LIVES[n] * scale * spread, 1) for n in LIFE_NAMES},
        ),
    )
