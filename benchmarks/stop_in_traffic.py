"""What one more stop costs in the race beyond its own time: the ground of `calibration.choices.parameters.STOP_BEYOND_S`.

    python benchmarks/stop_in_traffic.py [--races 400] [--seed 1000003] [--season 2023]

For cars that start 2nd, 8th and 14th in every dry race without a limit on laps a set: the best plan of one stop and the best of two on an
empty track, both run in the simulated race on the same luck. What two stops lose more there than on the empty track is the price of
traffic and of safety cars, in which a stop not yet made is cheap.
"""

import argparse

import numpy as np

from rsrl.season import COMPOUNDS, RaceRecord, load_race, race_names
from rsrl.simulator import Plan, compile_figures, simulate_plans
from rsrl.statistics import mean_interval
from rsrl.strategists import CleanAir

GRIDS = (2, 8, 14)
RETIRED_S = 100_000.0


def beyond_s(record: RaceRecord, seed: int, races: int) -> list[float]:
    """Loss of the second stop in the race beyond the empty track, s, by car; a race without plans of both kinds gives none."""
    clean_air = CleanAir(record, 0)
    best: dict[int, tuple[float, Plan]] = {}
    for family in clean_air.families((0, 1, 2)):
        at, stops = int(family.time_s.argmin()), len(family.compounds) - 1
        if stops not in best or family.time_s[at] < best[stops][0]:
            best[stops] = float(family.time_s[at]), Plan(family.compounds, tuple(int(x) for x in family.laps[at]))
    if not {1, 2} <= set(best):
        return []
    alone_s = best[2][0] - best[1][0]
    found, figures = [], compile_figures(record)
    for grid in GRIDS:
        car = min(range(len(record.cars)), key=lambda i: abs(record.cars[i].grid - grid))
        _, times = simulate_plans(figures, car, [best[1][1], best[2][1]], seed, np.arange(races, dtype=np.int64))
        kept = times[:, (times < RETIRED_S).all(axis=0)]
        found.append(float((kept[1] - kept[0]).mean()) - alone_s)
    return found


def main() -> None:
    """Print a row for each race, and the mean."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--races", type=int, default=400)
    parser.add_argument("--seed", type=int, default=1_000_003)
    parser.add_argument("--season", type=int, default=2023)
    options = parser.parse_args()
    rows, cold = [], []
    for name in (n for n in race_names() if n.endswith(str(options.season))):
        record = load_race(name)
        if record.wet or record.max_laps_per_set:
            continue
        rows.append(beyond_s(record, options.seed, options.races))
        cold.append(np.mean([record.tyres[c].cold_loss_s.value for c in COMPOUNDS]))
        print(f"{name:22s} " + " ".join(f"{x:+6.2f}" for x in rows[-1]) + f"   cold lap {cold[-1]:.2f}", flush=True)
    low, high = mean_interval(np.array([np.mean(r) for r in rows if r]))
    print(f"traffic: {np.mean([np.mean(r) for r in rows if r]):+.2f} s [{low:+.2f}, {high:+.2f}]; cold lap {np.mean(cold):.2f} s")


if __name__ == "__main__":
    main()
