"""Tuning of the heuristic's constants by the cross-entropy method, on races that nothing is evaluated on.

`python -m rsrl.strategists.tuning` continues from the present constants on Bahrain 2023 and prints the result.
"""

from dataclasses import astuple, fields

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.season import RaceRecord, find_car, load_race
from rsrl.strategists.heuristic import HeuristicRules, HeuristicStrategist

TUNING_SEED = 1_000_003
BATCH = 512
SPREAD = 0.4
"""Initial standard deviation of a constant: this times (its absolute value + this)."""

FLOORS = {"clear_air_s": 0.3, "held_up_s": 0.3, "young_laps": 1.0, "logistic_scale_s": 0.02}
MIN_SD = 0.02


def mean_position(rules: HeuristicRules, environment: RaceEnvironment, races: int, seed: int = TUNING_SEED) -> float:
    """Mean finishing position of the heuristic on races 0, 1 ... of a seed, rounded up to whole batches of the environment."""
    strategist = HeuristicStrategist(environment.record, environment.car, 0, rules)
    positions = []
    for first in range(0, races, environment.batch):
        numbers = np.arange(first, first + environment.batch, dtype=np.int64)
        environment.reset(seed, numbers)
        strategist.begin(environment, seed, numbers)
        for _ in range(environment.laps):
            environment.step(strategist.decide(environment))
        positions.append(environment.outcome().position)
    return float(np.concatenate(positions).mean())


def tune_rules(
    record: RaceRecord, car: int, start: HeuristicRules, *, races: int = 4096, generations: int = 12, population: int = 24, elite: int = 6
) -> HeuristicRules:
    """Constants of the best mean position found from `start`; each generation is drawn around the elite of the last."""
    environment = RaceEnvironment(record, car, batch=BATCH)
    rng = np.random.default_rng(0)
    mean = np.array(astuple(start))
    sd = SPREAD * (np.abs(mean) + SPREAD)
    for _ in range(generations):
        drawn = mean + sd * rng.standard_normal((population, len(mean)))
        drawn[0] = mean
        scores = [mean_position(_rules(row), environment, races) for row in drawn]
        best = drawn[np.argsort(scores, kind="stable")[:elite]]
        mean = 0.3 * mean + 0.7 * best.mean(axis=0)
        sd = np.maximum(0.3 * sd + 0.7 * best.std(axis=0), MIN_SD)
    return _rules(mean)


def _rules(values: NDArray[np.float64]) -> HeuristicRules:
    """Rules from the values of their constants, bounded below by `FLOORS`."""
    names = [field.name for field in fields(HeuristicRules)]
    return HeuristicRules(**{name: max(float(value), FLOORS.get(name, -np.inf)) for name, value in zip(names, values, strict=True)})


if __name__ == "__main__":
    bahrain = load_race("bahrain-2023")
    tuned = tune_rules(bahrain, find_car(bahrain, None), HeuristicRules())
    for name, value in zip((f.name for f in fields(HeuristicRules)), astuple(tuned), strict=True):
        print(f"{name} = {value:.2f}")
