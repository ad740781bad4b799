"""Working ranges of the features, fitted on simulated races; needed once between calibration and any policy."""

import dataclasses

import numpy as np

from rsrl.environment.race_environment import RaceEnvironment
from rsrl.season import RaceRecord
from rsrl.state import COLUMN, FEATURES, fit_scaling

CARS_SAMPLED = 5
RACES_A_CAR = 100


def with_scaling(record: RaceRecord, seed: int = 0) -> RaceRecord:
    """The record with working ranges fitted on races of cars spread over the grid, each stopping at random once in 15 laps."""
    unit = {f.name: (0.0, 1.0) for f in FEATURES if f.kind == "continuous" and f.fixed is None}
    blank = dataclasses.replace(record, scaling=unit)
    rows = []
    for car in np.linspace(0, len(record.cars) - 1, CARS_SAMPLED).astype(int):
        rng = np.random.default_rng((seed, int(car)))
        environment = RaceEnvironment(blank, int(car), batch=RACES_A_CAR)
        environment.reset(seed, np.arange(RACES_A_CAR, dtype=np.int64))
        for _ in range(record.laps):
            box = rng.random(RACES_A_CAR) < 1 / 15
            stay = environment.legal[:, 0] & ~box
            choice = np.where(environment.legal, rng.random((RACES_A_CAR, 4)), -1.0)
            choice[:, 0] = -0.5
            environment.step(np.where(stay, 0, choice.argmax(axis=1)).astype(np.int8))
            rows.append(environment.raw[~environment.done].copy())
    raw = np.concatenate(rows)
    assert raw.shape[1] == len(COLUMN)
    return dataclasses.replace(record, scaling=fit_scaling(raw))
