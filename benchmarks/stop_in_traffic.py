"""What one more stop costs in the race beyond its own time: the ground of `calibration.choices.parameters.STOP_BEYOND_S`.

    python benchmarks/stop_in_traffic.py [--races 400] [--seed 1000003] [--season 2023]

For cars that start 2nd, 8th and 14th in every dry race without a limit on laps a set: the best plan of one stop and the best of two on an
empty track, both run in the simulated race on the same luck. What two stops lose more there than on the empty track is the price of
traffic and of safety cars, in which a stop not yet made is cheap.
"""

import argparse

import numpy as np

from rsrl.evaluation.backtest.plan_ranking import CarPlans, plan_means
from rsrl.season import COMPOUNDS, RaceRecord, load_race, race_names
from rsrl.simulator import Plan, compile_figures
from rsrl.statistics import mean_interval

GRIDS = (2, 8, 14)


def beyond_s(record: RaceRecord, seed: int, races: int) -> list[float]:
    """Loss of the second stop in the race beyond the empty track, s, by car; a race without plans of both kinds gives none."""
    by_stops: dict[int, list[tuple[float, Plan]]] = {}
    for compounds, (time_s, laps) in CarPlans(record, 0).by_sequence.items():
        by_stops.setdefault(len(laps), []).append((time_s, Plan(compounds, laps)))
    if not {1, 2} <= set(by_stops):
        return []
    (one_s, one), (two_s, two) = (min(by_stops[stops], key=lambda plan: plan[0]) for stops in (1, 2))
    found, figures = [], compile_figures(record)
    for grid in GRIDS:
        car = min(range(len(record.cars)), key=lambda i: abs(record.cars[i].grid - grid))
        _, mean_s = plan_means(figures, car, [one, two], seed, np.arange(races, dtype=np.int64))
        found.append(float(mean_s[1] - mean_s[0]) - (two_s - one_s))
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
