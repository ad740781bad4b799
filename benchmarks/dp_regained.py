"""How `strategists.dp.REGAINED` was chosen: mean positions of `dp` by how much of lost time a later safety car is taken to give back.

    python benchmarks/dp_regained.py [--races 2048] [--seed 1000003]

The default car of twelve dry races of 2023, beside `heuristic` (tuned at Bahrain only) on the same races.
"""

import argparse

import numpy as np

from rsrl.evaluation import run_races
from rsrl.season import find_car, load_race
from rsrl.statistics import mean_interval
from rsrl.strategists import DpStrategist, HeuristicStrategist

RACES = (
    "bahrain", "azerbaijan", "spain", "canada", "austria", "great-britain", "hungary", "singapore", "japan", "qatar", "mexico", "las-vegas",
)  # fmt: skip
SHARES = (0.0, 0.2, 0.3, 0.4, 0.5, 0.6, 1.0)


def main() -> None:
    """Print a row for each race: heuristic, then dp less heuristic for each share."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--races", type=int, default=2048)
    parser.add_argument("--seed", type=int, default=1_000_003)
    options = parser.parse_args()
    print(f"{'race':16s} heuristic" + "".join(f"  dp {share:3.1f}" for share in SHARES))
    columns: list[list[np.ndarray]] = [[] for _ in SHARES]
    for name in RACES:
        record = load_race(f"{name}-2023")
        car = find_car(record, None)
        base = run_races(HeuristicStrategist(record, car, 0), record, car, options.seed, options.races).position
        for column, share in zip(columns, SHARES, strict=True):
            own = run_races(DpStrategist(record, car, 0, regained=share), record, car, options.seed, options.races).position
            column.append(own - base)
        print(f"{name:16s}    P{base.mean():5.2f}" + "".join(f"  {column[-1].mean():+5.2f}" for column in columns), flush=True)
    means = [np.concatenate(column) for column in columns]
    print(f"{'all':16s}          " + "".join(f"  {mean.mean():+5.3f}" for mean in means))
    half = mean_interval(means[3])[1] - means[3].mean()
    print(f"95 % interval of the last row: +-{half:.3f}")


if __name__ == "__main__":
    main()
