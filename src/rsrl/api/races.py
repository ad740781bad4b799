"""Races and plans: `rsrl.simulate`, `rsrl.plan`, and the Gymnasium environment."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import gymnasium
import numpy as np
from numpy.typing import NDArray

from rsrl.compile_watch import announce
from rsrl.environment import race_and_car
from rsrl.errors import RsrlError
from rsrl.registration import ENV_ID
from rsrl.season import COMPOUNDS, RaceRecord, c_numbers, find_car, read_compound
from rsrl.simulator import CarSummary, Plan, RaceResults, check_plan, summarise
from rsrl.simulator import simulate as simulate_races
from rsrl.strategists import PlanSearchResult, search_plans

if TYPE_CHECKING:
    import polars as pl

Race = str | Path | RaceRecord
Driver = str | int | None


@dataclass(frozen=True)
class Simulation:
    """Races of one Grand Prix.

    Attributes:
        record: the Grand Prix.
        results: arrays by race and car.
    """

    record: RaceRecord
    results: RaceResults

    @property
    def cars(self) -> tuple[CarSummary, ...]:
        """Each car's mean position and probabilities, best mean position first."""
        return tuple(sorted(summarise(self.record, self.results), key=lambda car: car.mean_position))

    def car(self, driver: Driver = None) -> CarSummary:
        """One car's mean position and probabilities. Raises RsrlError for a driver who did not start."""
        return summarise(self.record, self.results)[self._index(driver)]

    def positions(self, driver: Driver = None) -> NDArray[np.int8]:
        """One car's finishing position in each race, int8 [races]. Raises RsrlError for a driver who did not start."""
        return self.results.positions[:, self._index(driver)]

    def to_frame(self) -> "pl.DataFrame":
        """One row for each car, as `cars`."""
        import polars as pl

        return pl.DataFrame([vars(car) for car in self.cars])

    def _index(self, driver: Driver) -> int:
        return find_car(self.record, None if driver is None else str(driver))


def simulate(
    race: Race, *, races: int = 2000, seed: int = 0, driver: Driver = None, plan: str | Plan | None = None, threads: int | None = None
) -> Simulation:
    """Simulate a race many times, as `rsrl simulate`.

    Args:
        races: how many.
        seed: the same seed gives the same safety cars, rivals and noise whatever the plan, so two runs differ by the plan alone.
        driver: whose plan it is.
        plan: such as `S-H@14-S@36`; None lets the driver be called as the rivals are.
        threads: how many; None for one a core. Never changes the result.

    Raises:
        RsrlError: no such race or driver, a wet race, or a plan that breaks the rules.

    Example:
        >>> import rsrl
        >>> one = rsrl.simulate("bahrain-2023", driver="HAM", plan="S-H@14-S@36", races=500, seed=1)
        >>> two = rsrl.simulate("bahrain-2023", driver="HAM", plan="S-H@18-H@38", races=500, seed=1)
        >>> print(f"P{one.car('HAM').mean_position:.2f}, P{two.car('HAM').mean_position:.2f}")
        P6.59, P6.26
    """
    announce()
    record, car = race_and_car(race, driver)
    plans = {}
    if plan is not None:
        plans[car] = plan if isinstance(plan, Plan) else Plan.parse(plan, record)
        check_plan(plans[car], record, car)
    return Simulation(record, simulate_races(record, races, seed, plans=plans, threads=threads))


def plan(
    race: Race, *, driver: Driver = None, start: str | None = None, races: int = 200_000, seed: int = 0, sc_rule: bool = False
) -> PlanSearchResult:
    """Search for the best pit stop plans of a race, as `rsrl plan`.

    Args:
        start: starting tyre, such as `S`, `soft` or `C3`; None compares all.
        races: approximate number of races to simulate.
        sc_rule: allow stops to be brought forward under a safety car, and search for the best rule.

    Raises:
        RsrlError: no such race, driver or tyre, or fewer races than a search needs.

    Example:
        >>> import rsrl
        >>> found = rsrl.plan("bahrain-2023", driver="HAM", start="S", races=2000)
        >>> print(found.best)
        S-H@16-H@33
    """
    announce()
    record, car = race_and_car(race, driver)
    letter = None if start is None else read_compound(start, record.tyres)
    if start is not None and letter is None:
        raise RsrlError(f"start is {start!r}; tyres are {', '.join(COMPOUNDS)} ({c_numbers(record.tyres)})")
    code = None if letter is None else COMPOUNDS.index(letter)
    return search_plans(record, car, code, seed=seed, budget=races, sc_rule=sc_rule)


def make_env(
    race: Race = "bahrain-2023", driver: Driver = None, *, feature_set: str = "full", render_mode: str | None = None
) -> "gymnasium.Env[NDArray[np.float32], int]":
    """The Gymnasium environment `rsrl/Race-v0`: one race, one decision a lap; `gymnasium.make_vec` makes many side by side.

    Args:
        feature_set: `full`, `named` or `paper`.
        render_mode: `ansi` for a line of text a lap, `rgb_array` for a picture.

    Raises:
        RsrlError: no such race, driver, feature set or render mode.

    Example:
        >>> import rsrl
        >>> env = rsrl.make_env("bahrain-2023", "HAM", render_mode="ansi")
        >>> observation, info = env.reset(seed=1)
        >>> observation, reward, terminated, truncated, info = env.step(0)
        >>> print(env.render())
        lap  1/57  P9   ahead   0.1 s  behind   0.7 s  soft 1 lap  green  stay out
    """
    return gymnasium.make(ENV_ID, race=race, driver=driver, feature_set=feature_set, render_mode=render_mode)
