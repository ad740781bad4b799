"""The race with one part of its physics taken out, to see what that part is worth."""

from dataclasses import fields, replace
from typing import Any, Final

from rsrl.errors import RsrlError
from rsrl.season import GREEN, Figure, RaceRecord
from rsrl.simulator import Script

ABLATIONS: Final = ("traffic", "safety-cars", "wear")
_NO_TRAFFIC: Final = ("drs_gain_s", "dirty_air_loss_s", "pass_loss_s", "passed_loss_s", "blue_flag_loss_s", "lapping_loss_s")
_ALWAYS_PASSES_S: Final = -1000.0  # a threshold that every car is above
_NOTE: Final = "taken out"


def without(record: RaceRecord, part: str) -> RaceRecord:
    """The record without `traffic` (cars drive through each other), `safety-cars` (none is ever drawn) or `wear` (tyres never age).

    Raises:
        RsrlError: an unknown part.
    """
    if part == "traffic":
        none: dict[str, Any] = {name: _figure(0.0) for name in _NO_TRAFFIC}
        return replace(record, track=replace(record.track, **none, pass_threshold_s=_figure(_ALWAYS_PASSES_S), pass_per_gap=None))
    if part == "safety-cars":
        return replace(record, incidents=replace(record.incidents, **_zeros(record.incidents, ("sc_lap1", "sc_per_lap", "vsc_per_lap"))))
    if part == "wear":
        names = ("wear_s_per_lap", "curvature_s_per_lap2")
        return replace(record, tyres={c: replace(t, **_zeros(t, names)) for c, t in record.tyres.items()})
    raise RsrlError(f"cannot take out {part!r}; parts are {', '.join(ABLATIONS)}")


def script_without(script: Script, part: str) -> Script:
    """The script to go with it: without safety cars every lap is green."""
    return replace(script, status=(GREEN,) * len(script.status)) if part == "safety-cars" else script


def _figure(value: float) -> Figure:
    return Figure(value, 0.0, 0, _NOTE)


def _zeros(part: Any, names: tuple[str, ...]) -> dict[str, Any]:
    assert {f.name for f in fields(part)} >= set(names)
    return {name: _figure(0.0) for name in names}
