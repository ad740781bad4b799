"""The plausible range of each fitted figure; a season file with a value outside it is refused, not clipped."""

from typing import Final

BOUNDS: Final[dict[str, tuple[float, float]]] = {
    "base_lap_s": (45.0, 150.0),
    "fuel_s_per_kg": (0.0, 0.1),
    "fuel_start_kg": (50.0, 115.0),
    "lap_noise_sd_s": (0.01, 3.0),
    "stint_sd_s": (0.0, 2.0),
    "evolution_s": (-4.0, 8.0),
    "start_loss_s": (0.0, 20.0),
    "start_per_place_s": (0.0, 1.0),
    "start_sd_s": (0.0, 5.0),
    "drs_gain_s": (0.0, 2.0),
    "drs_window_s": (0.0, 3.0),
    "dirty_air_loss_s": (0.0, 3.0),
    "dirty_air_window_s": (0.1, 6.0),
    "following_gap_s": (0.1, 3.0),
    "pass_threshold_s": (-1.0, 6.0),
    "pass_scale_s": (0.01, 3.0),
    "pass_per_gap": (0.0, 6.0),
    "pass_loss_s": (0.0, 2.0),
    "passed_loss_s": (0.0, 2.0),
    "blue_flag_loss_s": (0.0, 6.0),
    "lapping_loss_s": (0.0, 3.0),
    "offset_s": (-5.0, 5.0),
    "wear_s_per_lap": (-0.05, 1.0),
    "curvature_s_per_lap2": (0.0, 0.05),
    "cold_loss_s": (-1.0, 5.0),
    "loss_green_s": (8.0, 50.0),
    "loss_vsc_s": (4.0, 50.0),
    "loss_sc_s": (2.0, 50.0),
    "in_lap_share": (0.0, 1.0),
    "stack_s": (0.0, 15.0),
    "tail_scale_s": (0.0, 5.0),
    "tail_shape": (1.0, 20.0),
    "tail_max_s": (0.0, 120.0),
    "sc_lap1": (0.0, 1.0),
    "sc_per_lap": (0.0, 0.2),
    "vsc_per_lap": (0.0, 0.2),
    "red_share": (0.0, 1.0),
    "sc_per_retirement": (0.0, 0.9),
    "vsc_per_retirement": (0.0, 0.9),
    "sc_per_retirement_lap1": (0.0, 0.95),
    "sc_lap_factor": (1.1, 2.5),
    "sc_catch_factor": (1.0, 2.5),
    "vsc_lap_factor": (1.05, 2.5),
    "sc_gap_s": (0.2, 3.0),
    "sc_wear_factor": (0.0, 1.0),
    "vsc_wear_factor": (0.0, 1.0),
    "pace_s": (-5.0, 8.0),
    "form_sd_s": (0.0, 3.0),
    "team_form_share": (0.0, 1.0),
    "noise_factor": (0.1, 5.0),
    "start_gain_s": (-5.0, 5.0),
    "retire_per_lap": (0.0, 0.1),
    "retire_lap1": (0.0, 0.5),
    "stop_loss_s": (-5.0, 5.0),
    "stop_tail_factor": (0.1, 5.0),
    "jitter_sd_laps": (0.0, 10.0),
    "sc_window_laps": (0.0, 60.0),
    "sc_reaction": (0.0, 1.0),
    "vsc_window_laps": (0.0, 60.0),
    "vsc_reaction": (0.0, 1.0),
}

_FAMILIES: Final[dict[str, tuple[float, float]]] = {
    "life_laps": (1.0, 90.0),
    "hazard": (-60.0, 60.0),
    "choice": (-60.0, 60.0),
    "launch_loss_s": (-3.0, 3.0),
}
"""Tables of figures whose names are not fixed."""


def bounds_of(key: str) -> tuple[float, float]:
    """Range of a figure by its dotted name in the season file, such as `rivals.hazard.overdue`."""
    *tables, name = key.split(".")
    return _FAMILIES[tables[-1]] if tables and tables[-1] in _FAMILIES else BOUNDS[name]
