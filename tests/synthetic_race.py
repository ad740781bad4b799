"""A small made-up race for tests: every figure is plain to see, so that its effect can be worked out by hand."""

import dataclasses
from typing import Any

from rsrl.season import (
    COMPOUNDS,
    CarFigures,
    Figure,
    IncidentFigures,
    PitFigures,
    Provenance,
    RaceRecord,
    RivalFigures,
    RivalPlan,
    TrackFigures,
    TyreFigures,
)

TRACK = {
    "base_lap_s": 90.0, "fuel_s_per_kg": 0.03, "fuel_start_kg": 100.0, "lap_noise_sd_s": 0.3, "start_loss_s": 4.0,
    "start_per_place_s": 0.2, "start_sd_s": 0.3, "drs_gain_s": 0.4, "drs_window_s": 1.0, "dirty_air_loss_s": 0.4,
    "dirty_air_window_s": 2.0, "following_gap_s": 0.6, "pass_threshold_s": 0.8, "pass_scale_s": 0.3, "pass_loss_s": 0.2,
    "blue_flag_loss_s": 1.0, "lapping_loss_s": 0.3, "stint_sd_s": 0.0, "evolution_s": 0.0, "passed_loss_s": 0.0,
}  # fmt: skip
TYRES = {  # offset, wear, curvature, cold lap
    "S": (-0.6, 0.10, 0.002, 0.5),
    "M": (0.0, 0.06, 0.001, 0.8),
    "H": (0.4, 0.03, 0.0005, 1.2),
}
PIT = {
    "loss_green_s": 20.0,
    "loss_vsc_s": 13.0,
    "loss_sc_s": 10.0,
    "tail_scale_s": 0.4,
    "tail_shape": 3.0,
    "tail_max_s": 20.0,
    "in_lap_share": 1.0,
    "stack_s": 0.0,
}
INCIDENTS = {
    "sc_lap1": 0.2, "sc_per_lap": 0.04, "vsc_per_lap": 0.03, "sc_lap_factor": 1.5, "sc_catch_factor": 1.2, "vsc_lap_factor": 1.35,
    "sc_gap_s": 0.8, "sc_wear_factor": 0.25, "vsc_wear_factor": 0.5, "red_share": 0.0,
}  # fmt: skip
RIVALS = {"jitter_sd_laps": 1.0, "sc_window_laps": 6.0, "sc_reaction": 0.7, "vsc_window_laps": 4.0, "vsc_reaction": 0.5}
CAR = {
    "form_sd_s": 0.1,
    "noise_factor": 1.0,
    "start_gain_s": 0.0,
    "retire_per_lap": 0.006,
    "retire_lap1": 0.006,
    "stop_loss_s": 0.0,
    "stop_tail_factor": 1.0,
}
PLANS = ("S-H@6", "M-H@8", "H-M@10", "S-M@5-S@11", "M-S@9")


def figure(value: float) -> Figure:
    """A figure without uncertainty."""
    return Figure(value, 0.0, 0)


def tyre(c_number: str, shape: tuple[float, float, float, float], sets: int) -> TyreFigures:
    """A compound from offset, wear, curvature and cold lap."""
    offset, wear, curvature, cold = (figure(v) for v in shape)
    return TyreFigures(c_number, offset, wear, curvature, cold, sets)


def synthetic_race(
    laps: int = 16, cars: int = 20, *, sets: tuple[int, int, int] = (2, 2, 2), plans: tuple[str, ...] = PLANS,
    max_laps_per_set: int = 0, drs_off_laps: int = 2, pace_step_s: float = 0.08, sc_laps: tuple[float, ...] = (0.2, 0.3, 0.3, 0.2),
    vsc_laps: tuple[float, ...] = (0.6, 0.4), tyres: dict[str, tuple[float, float, float, float]] | None = None, **figures: float,
) -> RaceRecord:  # fmt: skip
    """A race of `laps`; car i starts from place i + 1 and is `pace_step_s` slower than the car ahead.

    `figures` replaces any figure of track, pit, incidents, rivals or (for all cars alike) cars by its name.
    """
    groups: list[dict[str, float]] = [TRACK, PIT, INCIDENTS, RIVALS, CAR]
    unknown = set(figures) - {name for group in groups for name in group}
    assert not unknown, unknown

    def part(group: dict[str, float]) -> dict[str, Any]:
        return {name: figure(figures.get(name, value)) for name, value in group.items()}

    shapes = TYRES if tyres is None else tyres
    return RaceRecord(
        name="bahrain-2099", season=2099, round=1, event="Made-up Grand Prix", grand_prix="bahrain", laps=laps, wet=False,
        default_driver="C05", max_laps_per_set=max_laps_per_set, drs_off_laps=drs_off_laps,
        track=TrackFigures(**part(TRACK)),
        tyres={c: tyre(f"C{3 - i}", shapes[c], sets[i]) for i, c in enumerate(COMPOUNDS)},
        pit=PitFigures(**part(PIT)),
        incidents=IncidentFigures(**part(INCIDENTS), sc_laps=sc_laps, vsc_laps=vsc_laps),
        cars=tuple(
            CarFigures(driver=f"C{i:02d}", team=f"T{i // 2}", grid=i + 1, pace_s=figure(pace_step_s * (i - cars / 2)), **part(CAR))
            for i in range(cars)
        ),
        rivals=RivalFigures(plans=tuple(RivalPlan(p, float(1 + i)) for i, p in enumerate(plans)), **part(RIVALS)),
        published=plans,
        provenance=Provenance("made up", "2099-01-01", "0", (), 0, 0),
        scaling=UNSCALED,
    )  # fmt: skip


def quiet(**figures: float) -> dict[str, Any]:
    """Figures without luck: no noise, incidents, retirements, jitter or slow stops; `figures` on top."""
    none = (
        "lap_noise_sd_s", "start_sd_s", "form_sd_s", "sc_lap1", "sc_per_lap", "vsc_per_lap", "retire_per_lap", "retire_lap1",
        "jitter_sd_laps", "tail_scale_s",
    )  # fmt: skip
    return {**dict.fromkeys(none, 0.0), **figures}


def _unscaled() -> dict[str, tuple[float, float]]:
    from rsrl.state import FEATURES

    return {f.name: (0.0, 50.0) for f in FEATURES if f.kind == "continuous" and f.fixed is None}


UNSCALED = _unscaled()
"""A working range for every feature that needs one, wide enough to test with."""


def with_car(record: RaceRecord, car: int, **figures: float) -> RaceRecord:
    """The record with some figures of one car replaced."""
    replaced: dict[str, Any] = {n: figure(v) for n, v in figures.items()}
    changed = dataclasses.replace(record.cars[car], **replaced)
    return dataclasses.replace(record, cars=(*record.cars[:car], changed, *record.cars[car + 1 :]))
