"""Write a strategist of your own and compare it with the rules of the pit wall.

python examples/own_strategist.py
"""

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.evaluation import leaderboard, run_races
from rsrl.season import find_car, load_race
from rsrl.state import COLUMN, Action
from rsrl.strategists import Strategist, made_legal, make_strategist

RACES = 384
TYRE_LIFE_LAPS = 16


class EverySixteenLaps(Strategist):
    """Boxes for hard whenever the set is sixteen laps old, and under any safety car once it is half that."""

    name = "every 16 laps"

    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        """Nothing to remember from lap to lap."""

    def decide(self, environment: RaceEnvironment) -> NDArray[np.int8]:
        """One call for each race of the batch; `rsrl.state.FEATURES` lists what can be read."""
        age_laps = environment.raw[:, COLUMN["tyre_age_laps"]]
        safety_car = environment.raw[:, COLUMN["safety_car"]] > 0
        laps_left = environment.raw[:, COLUMN["laps_left"]]
        old = age_laps >= np.where(safety_car, TYRE_LIFE_LAPS / 2, TYRE_LIFE_LAPS)
        calls = np.where(old & (laps_left > TYRE_LIFE_LAPS / 2), Action.PIT_HARD, Action.NO_PIT).astype(np.int8)
        return made_legal(calls, environment.legal)


def main() -> None:
    """Let both call the same races."""
    record = load_race("bahrain-2023")
    car = find_car(record, "HAM")
    mine = run_races(EverySixteenLaps(), record, car, seed=7, races=RACES)
    rules = run_races(make_strategist("heuristic", record, car), record, car, seed=7, races=RACES)
    for row in leaderboard(mine, [rules]):
        print(f"{row.strategist:14} P{row.mean_position:.2f}, {row.mean_stops:.2f} stops")


if __name__ == "__main__":
    main()
