"""The picture of a what-if in the README: every option of lap 10 of Bahrain 2023, what it is worth and where its time goes.

Usage: python benchmarks/explain_figure.py [--seed 0] [--out docs/figures/what-if-bahrain-lap-10.png]
"""

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from rsrl.explanation import explain_what_if, load_explained, reach
from rsrl.explanation.what_if import plot_time_split, plot_what_if
from rsrl.season import find_car, load_race

RACE, LAP = "bahrain-2023", 10


def main() -> None:
    """Draw it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=0, help="names the race")
    parser.add_argument("--out", type=Path, default=Path("docs/figures/what-if-bahrain-lap-10.png"))
    arguments = parser.parse_args()
    record, policy = load_race(RACE), load_explained("all")
    car = find_car(record, None)
    moment = reach(policy.strategist(record), record, car, LAP, seed=arguments.seed)
    explanation = explain_what_if(policy, moment, races=2000, seed=arguments.seed)
    figure, (left, right) = plt.subplots(1, 2, figsize=(12, 4.6), layout="constrained")
    plot_what_if(explanation, left)
    plot_time_split(explanation, right)
    right.set_yticklabels([])
    right.set_title("where the time goes", loc="left", fontsize=9)
    figure.suptitle(f"{record.event} {record.season}. {explanation.sentences[0]}", fontsize=10)
    figure.savefig(arguments.out, dpi=110)


if __name__ == "__main__":
    main()
