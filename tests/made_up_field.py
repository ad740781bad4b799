"""A made-up race with a plain best plan and the choices of its field, for tests of plans beside those that were run."""

from typing import Any

import polars as pl
from synthetic_race import synthetic_race

from rsrl.calibration import RaceFacts
from rsrl.calibration.choices import CarChoice, RaceChoices
from rsrl.calibration.entry import RaceKey
from rsrl.evaluation.backtest.shipped_races import ShippedRace
from rsrl.season import RaceRecord
from rsrl.simulator import Plan

LAPS = 30
FACTS = RaceFacts({}, LAPS, frozenset(), "made up", {}, frozenset(), {}, {}, {})


def chose(*plans: str, green: bool = True) -> RaceChoices:
    """A field in order of the grid, car by car as `M-H@11`."""
    cars = []
    for i, text in enumerate(plans):
        plan = Plan.parse(text)
        stops = (green,) * plan.stops
        cars.append(CarChoice(f"C{i:02d}", f"T{i // 2}", i + 1, plan.compounds, plan.laps, stops, LAPS, True))
    return RaceChoices(RaceKey(2099, 1, "bahrain", LAPS, {}), tuple(cars), False, False, None, 0)


def race_of(record: RaceRecord, choices: RaceChoices) -> ShippedRace:
    """A race of which nothing is known but its figures and its choices."""
    return ShippedRace(record, pl.DataFrame(), FACTS, choices)


def medium_hard() -> RaceRecord:
    """Medium and hard are best by far: softs are slow and wear fast, a stop costs much; cars are far apart."""
    tyres = {"S": (1.5, 0.5, 0.0, 0.0), "M": (0.0, 0.06, 0.0, 0.0), "H": (0.2, 0.02, 0.0, 0.0)}
    none: dict[str, Any] = dict.fromkeys(("sc_lap1", "sc_per_lap", "vsc_per_lap", "retire_per_lap", "retire_lap1", "start_sd_s"), 0.0)
    return synthetic_race(laps=LAPS, cars=8, tyres=tyres, pace_step_s=0.6, lap_noise_sd_s=0.01, **none)
