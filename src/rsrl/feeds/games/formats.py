"""What is in a packet of the Formula One games: NumPy record types of the seasons 2023 to 2026.

The layouts follow the publisher's description of each season's UDP output: little endian, packed, a header of 29 bytes, then one slot for
each car. Fields have the description's names in our spelling, with units where they have one. `SIZES` are the sizes that each season's
description states; a layout that does not come out at its size is wrong.
"""

from functools import cache
from typing import Any, Final

import numpy as np

__all__ = ["FORMATS", "HEADER", "SIZES", "Field", "car_slots", "packet_type"]

FORMATS: Final = (2023, 2024, 2025, 2026)

SESSION, LAP_DATA, EVENT, PARTICIPANTS, CAR_STATUS, CLASSIFICATION, CAR_DAMAGE, HISTORY, TYRE_SETS = 1, 2, 3, 4, 7, 8, 10, 11, 12
"""Packet ids that a strategist needs."""

SIZES: Final[dict[int, tuple[int, int, int, int]]] = {
    0: (1349, 1349, 1349, 1325),
    SESSION: (644, 753, 753, 926),
    LAP_DATA: (1131, 1285, 1285, 1399),
    EVENT: (45, 45, 45, 45),
    PARTICIPANTS: (1306, 1350, 1284, 1470),
    5: (1107, 1133, 1133, 1233),
    6: (1352, 1352, 1352, 1448),
    CAR_STATUS: (1239, 1239, 1239, 1445),
    CLASSIFICATION: (1020, 1020, 1042, 1134),
    9: (1218, 1306, 954, 1062),
    CAR_DAMAGE: (953, 953, 1041, 1133),
    HISTORY: (1460, 1460, 1460, 1460),
    TYRE_SETS: (231, 231, 231, 231),
    13: (217, 237, 273, 273),
}
"""Bytes of a whole packet by id, in each of `FORMATS`."""

Field = tuple[str, Any] | tuple[str, Any, tuple[int, ...]]

HEADER_FIELDS: Final[list[Field]] = [
    ("packet_format", "<u2"), ("game_year", "u1"), ("game_major_version", "u1"), ("game_minor_version", "u1"), ("packet_version", "u1"),
    ("packet_id", "u1"), ("session_uid", "<u8"), ("session_time_s", "<f4"), ("frame", "<u4"), ("overall_frame", "<u4"),
    ("player_car", "u1"), ("secondary_player_car", "u1"),
]  # fmt: skip
HEADER: Final = np.dtype(HEADER_FIELDS)

_ZONE: Final[list[Field]] = [("start", "<f4"), ("end", "<f4")]
_FORECAST: Final[list[Field]] = [
    ("session_type", "u1"), ("minutes_ahead", "u1"), ("weather", "u1"), ("track_c", "i1"), ("track_change", "i1"), ("air_c", "i1"),
    ("air_change", "i1"), ("rain_percent", "u1"),
]  # fmt: skip


def _bytes(*names: str) -> list[Field]:
    return [(name, "u1") for name in names]


def _session(season: int) -> list[Field]:
    fields: list[Field] = [
        ("weather", "u1"), ("track_c", "i1"), ("air_c", "i1"), ("total_laps", "u1"), ("track_length_m", "<u2"), ("session_type", "u1"),
        ("track", "i1"), ("formula", "u1"), ("session_time_left_s", "<u2"), ("session_duration_s", "<u2"),
        *_bytes("pit_speed_limit_km_h", "paused", "is_spectating", "spectator_car", "sli_pro", "marshal_zone_count"),
        ("marshal_zones", [("start", "<f4"), ("flag", "i1")], (21,)), *_bytes("safety_car_status", "network_game", "forecast_count"),
        ("forecasts", _FORECAST, (56 if season == 2023 else 64,)), *_bytes("forecast_accuracy", "ai_difficulty"),
        ("season_link", "<u4"), ("weekend_link", "<u4"), ("session_link", "<u4"),
        *_bytes("pit_window_ideal_lap", "pit_window_latest_lap", "pit_rejoin_position", "steering_assist", "braking_assist"),
        *_bytes("gearbox_assist", "pit_assist", "pit_release_assist", "ers_assist", "drs_assist", "racing_line", "racing_line_type"),
        *_bytes("game_mode", "rule_set"),
        ("time_of_day_min", "<u4"), *_bytes("session_length", "lead_speed_units", "lead_temperature_units", "secondary_speed_units"),
        *_bytes("secondary_temperature_units", "safety_cars", "virtual_safety_cars", "red_flags"),
    ]  # fmt: skip
    if season >= 2024:
        fields += [
            *_bytes("equal_cars", "recovery_mode", "flashback_limit", "surface_type", "low_fuel_mode", "race_starts", "tyre_temperature"),
            *_bytes("pit_lane_tyre_sim", "car_damage", "car_damage_rate", "collisions", "collisions_off_first_lap", "unsafe_release"),
            *_bytes("griefing_off", "corner_cutting", "parc_ferme", "pit_stop_experience", "safety_car_rate", "safety_car_experience"),
            *_bytes("formation_lap", "formation_lap_experience", "red_flag_rate", "affects_licence_solo", "affects_licence_mp"),
            ("sessions_in_weekend", "u1"), ("weekend_structure", "u1", (12,)), ("sector_2_start_m", "<f4"), ("sector_3_start_m", "<f4"),
        ]  # fmt: skip
    if season >= 2026:
        fields += [
            *_bytes("active_aero_status", "full_aero_zone_count"), ("full_aero_zones", _ZONE, (8,)), ("partial_aero_zone_count", "u1"),
            ("partial_aero_zones", _ZONE, (8,)), ("drs_zone_count", "u1"), ("drs_zones", _ZONE, (4,)), ("start_reaction_s", "<f4"),
            *_bytes("abs_assist", "traction_assist", "racing_line_hi_vis", "racing_line_colour_blind", "rewind_prompt"),
        ]  # fmt: skip
    return fields


def _lap_data(season: int) -> list[Field]:
    minutes: list[Field] = [("front_gap_minutes", "u1")] if season >= 2024 else []
    leader_minutes: list[Field] = [("leader_gap_minutes", "u1")] if season >= 2024 else []
    fields: list[Field] = [
        ("last_lap_ms", "<u4"), ("current_lap_ms", "<u4"), ("sector_1_ms", "<u2"), ("sector_1_minutes", "u1"), ("sector_2_ms", "<u2"),
        ("sector_2_minutes", "u1"), ("front_gap_ms", "<u2"), *minutes, ("leader_gap_ms", "<u2"), *leader_minutes,
        ("lap_distance_m", "<f4"), ("total_distance_m", "<f4"), ("safety_car_delta_s", "<f4"),
        *_bytes("position", "lap", "pit_status", "stops", "sector", "lap_invalid", "penalties_s", "warnings", "corner_cutting_warnings"),
        *_bytes("unserved_drive_throughs", "unserved_stop_gos", "grid", "driver_status", "result_status", "pit_timer_active"),
        ("in_lane_ms", "<u2"), ("stop_ms", "<u2"), ("should_serve_penalty", "u1"),
    ]  # fmt: skip
    if season >= 2024:
        fields += [("speed_trap_km_h", "<f4"), ("speed_trap_lap", "u1")]
    return [("cars", fields, (car_slots(season),)), *_bytes("time_trial_best_car", "time_trial_rival_car")]


def _participants(season: int) -> list[Field]:
    ids = "<u2" if season >= 2026 else "u1"
    fields: list[Field] = [
        ("ai", "u1"), ("driver", ids), ("network", ids), ("team", ids), *_bytes("my_team", "race_number", "nationality"),
        ("name", "S32" if season >= 2025 else "S48"), *_bytes("telemetry_public", "show_online_names"),
    ]  # fmt: skip
    fields += ([("tech_level", "<u2")] if season >= 2024 else []) + _bytes("platform")
    fields += [("colour_count", "u1"), ("colours", "u1", (4, 3))] if season >= 2025 else []
    return [("active_cars", "u1"), ("cars", fields, (car_slots(season),))]


def _car_status(season: int) -> list[Field]:
    limit: list[Field] = [("ers_harvest_limit_j", "<f4")] if season >= 2026 else []
    fields: list[Field] = [
        *_bytes("traction_control", "abs", "fuel_mix", "front_brake_bias", "pit_limiter"),
        ("fuel_kg", "<f4"), ("fuel_capacity_kg", "<f4"), ("fuel_laps", "<f4"), ("max_rpm", "<u2"), ("idle_rpm", "<u2"),
        *_bytes("gears", "drs_allowed"), ("drs_distance_m", "<u2"), *_bytes("compound", "visual_compound", "tyre_age_laps"), ("flag", "i1"),
        ("ice_power_w", "<f4"), ("mguk_power_w", "<f4"), ("ers_store_j", "<f4"), ("ers_mode", "u1"), ("ers_mguk_lap_j", "<f4"),
        ("ers_mguh_lap_j", "<f4"), *limit, ("ers_deployed_lap_j", "<f4"), ("network_paused", "u1"),
    ]  # fmt: skip
    return [("cars", fields, (car_slots(season),))]


def _car_damage(season: int) -> list[Field]:
    blisters: list[Field] = [("blister_percent", "u1", (4,))] if season >= 2025 else []
    fields: list[Field] = [
        ("wear_percent", "<f4", (4,)), ("tyre_damage_percent", "u1", (4,)), ("brake_damage_percent", "u1", (4,)), *blisters,
        *_bytes("front_left_wing", "front_right_wing", "rear_wing", "floor", "diffuser", "sidepod", "drs_fault", "ers_fault", "gearbox"),
        *_bytes("engine", "mguh_wear", "es_wear", "ce_wear", "ice_wear", "mguk_wear", "tc_wear", "engine_blown", "engine_seized"),
    ]  # fmt: skip
    return [("cars", fields, (car_slots(season),))]


def _classification(season: int) -> list[Field]:
    fields: list[Field] = [
        *_bytes("position", "laps", "grid", "points", "stops", "result_status"), *(_bytes("result_reason") if season >= 2025 else []),
        ("best_lap_ms", "<u4"), ("race_time_s", "<f8"), *_bytes("penalties_s", "penalty_count", "stint_count"),
        ("compounds", "u1", (8,)), ("visual_compounds", "u1", (8,)), ("stint_end_laps", "u1", (8,)),
    ]  # fmt: skip
    return [("car_count", "u1"), ("cars", fields, (car_slots(season),))]


def _history(_: int) -> list[Field]:
    lap: list[Field] = [
        ("lap_ms", "<u4"), ("sector_1_ms", "<u2"), ("sector_1_minutes", "u1"), ("sector_2_ms", "<u2"), ("sector_2_minutes", "u1"),
        ("sector_3_ms", "<u2"), ("sector_3_minutes", "u1"), ("valid_bits", "u1"),
    ]  # fmt: skip
    best = _bytes("best_lap", "best_sector_1_lap", "best_sector_2_lap", "best_sector_3_lap")
    stint = _bytes("end_lap", "compound", "visual_compound")
    return [*_bytes("car", "lap_count", "stint_count"), *best, ("laps", lap, (100,)), ("stints", stint, (8,))]


def _tyre_sets(_: int) -> list[Field]:
    before = _bytes("compound", "visual_compound", "wear_percent", "available", "session", "life_laps", "usable_laps")
    return [("car", "u1"), ("sets", [*before, ("lap_delta_ms", "<i2"), ("fitted", "u1")], (20,)), ("fitted", "u1")]


def _event(_: int) -> list[Field]:
    return [("code", "S4"), ("details", "u1", (12,))]


_BODIES: Final = {
    SESSION: _session, LAP_DATA: _lap_data, EVENT: _event, PARTICIPANTS: _participants, CAR_STATUS: _car_status,
    CLASSIFICATION: _classification, CAR_DAMAGE: _car_damage, HISTORY: _history, TYRE_SETS: _tyre_sets,
}  # fmt: skip


def car_slots(season: int) -> int:
    """Slots for cars in a packet of a season."""
    return 24 if season >= 2026 else 22


@cache
def packet_type(season: int, packet_id: int) -> np.dtype | None:
    """The record type of a whole packet, header and body; None for one that is not read."""
    if season not in FORMATS or packet_id not in _BODIES:
        return None
    return np.dtype([("header", HEADER), *_BODIES[packet_id](season)])
