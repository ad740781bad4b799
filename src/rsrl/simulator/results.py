"""Results of simulated races, and their summary by car."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.season import MAX_CARS, POINTS, RaceRecord

POINTS_BY_POSITION = np.array([0.0, *POINTS, *[0] * (MAX_CARS - len(POINTS))])
"""Points by finishing position, index 0 unused."""


class ResultRows(NamedTuple):
    """Rows of `RaceResults` that the compiled race writes; fields as there."""

    positions: NDArray[np.int8]
    stops: NDArray[np.int8]
    retired: NDArray[np.bool_]
    race_time_s: NDArray[np.float32]
    slow_laps: NDArray[np.int16]


@dataclass(frozen=True)
class RaceResults:
    """Results of `n` races, a column for each car of the record; rows are races in the order asked for."""

    positions: NDArray[np.int8]  # [n, cars] finishing position, 1 for the winner
    stops: NDArray[np.int8]  # [n, cars]
    retired: NDArray[np.bool_]  # [n, cars]
    race_time_s: NDArray[np.float32]  # [n, cars], meaningless for retired cars
    slow_laps: NDArray[np.int16]  # [n, 2] laps behind the safety car, laps of virtual safety car
    seconds: float  # wall-clock time of the simulation

    @classmethod
    def empty(cls, n: int, cars: int) -> "RaceResults":
        """Room for `n` races of `cars` cars, to be filled."""
        shape = (n, cars)
        return cls(
            np.empty(shape, np.int8), np.empty(shape, np.int8), np.empty(shape, np.bool_), np.empty(shape, np.float32),
            np.empty((n, 2), np.int16), 0.0,
        )  # fmt: skip

    def part(self, rows: slice) -> ResultRows:
        """Views of some rows, to be filled."""
        return ResultRows(self.positions[rows], self.stops[rows], self.retired[rows], self.race_time_s[rows], self.slow_laps[rows])

    @property
    def races(self) -> int:
        """Number of races."""
        return len(self.positions)

    def points(self, car: int) -> NDArray[np.float64]:
        """Points of a car in each race, [n]."""
        return POINTS_BY_POSITION[self.positions[:, car]]


@dataclass(frozen=True)
class CarSummary:
    """One car over many simulated races."""

    driver: str
    team: str
    grid: int
    mean_position: float
    p_win: float
    p_podium: float
    p_points: float
    p_retired: float
    mean_stops: float
    positions: list[float]  # share of races finished 1st, 2nd ... last


def summarise(record: RaceRecord, results: RaceResults) -> list[CarSummary]:
    """Means and probabilities per car of the record, in grid order."""
    summaries = []
    for i, car in enumerate(record.cars):
        p = results.positions[:, i]
        shares = np.bincount(p, minlength=len(record.cars) + 1)[1:] / len(p)
        summaries.append(
            CarSummary(
                driver=car.driver,
                team=car.team,
                grid=car.grid,
                mean_position=float(p.mean()),
                p_win=float(shares[0]),
                p_podium=float(shares[:3].sum()),
                p_points=float(shares[: len(POINTS)].sum()),
                p_retired=float(results.retired[:, i].mean()),
                mean_stops=float(results.stops[:, i].mean()),
                positions=[float(s) for s in shares],
            )
        )
    return summaries
